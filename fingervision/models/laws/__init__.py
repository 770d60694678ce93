"""Effects of the catalogue computed by the physics of a drawn gripper, one per file; each states its EFFECT."""

import importlib
import pkgutil
from types import ModuleType

from fingervision.domain.model import PhysicalLaw
from fingervision.models.drawn_answer import DrawnAnswer


def _modules() -> list[ModuleType]:
    found = [importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    return [module for module in found if hasattr(module, "EFFECT")]


def laws_of(drawn: DrawnAnswer) -> dict[str, PhysicalLaw]:
    """Compute the laws of a drawing, by the effect's name; effects that the drawing cannot show are omitted."""
    laws = {module.EFFECT: module.law(drawn) for module in _modules()}
    return {name: law for name, law in laws.items() if law is not None}
