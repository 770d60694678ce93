"""How a drawn gripper itself obeys effects of the catalogue, one a file: a module that states its EFFECT is a law."""

import importlib
import pkgutil
from types import ModuleType

from fingervision.domain.model import PhysicalLaw
from fingervision.models.drawn_answer import DrawnAnswer


def _modules() -> list[ModuleType]:
    found = [importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    return [module for module in found if hasattr(module, "EFFECT")]


def laws_of(drawn: DrawnAnswer) -> dict[str, PhysicalLaw]:
    """Work out the laws that a drawing obeys, by the effect's name; those that it cannot show are left out."""
    laws = {module.EFFECT: module.law(drawn) for module in _modules()}
    return {name: law for name, law in laws.items() if law is not None}
