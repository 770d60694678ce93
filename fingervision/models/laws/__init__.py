"""Effects computed by the mechanics of a drawn gripper, one per module.

`EFFECT` of a module is the name of the effect in the catalogue that its `law` computes.
"""

import importlib
import pkgutil
from types import ModuleType

from fingervision.domain.model import PhysicalLaw
from fingervision.models.small_answer import DrawnAnswer


def _modules() -> list[ModuleType]:
    found = [importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__)]
    return [module for module in found if hasattr(module, "EFFECT")]


def laws_of(drawn: DrawnAnswer) -> dict[str, PhysicalLaw]:
    """Compute the formulas of effects for a drawing, by name of effect; effects that cannot occur in it are omitted."""
    laws = {module.EFFECT: module.law(drawn) for module in _modules()}
    return {name: law for name, law in laws.items() if law is not None}
