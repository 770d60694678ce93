"""Physical effects, one a file, named as in the catalogue: a module that holds an `EFFECT` is an entry."""

import importlib
import pkgutil
from functools import cache

from fingervision.domain.effect import Effect


@cache
def catalogue() -> dict[str, Effect]:
    """List the effects by name, in the order in which they act in the measuring chain."""
    modules = (importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__))
    effects = [module.EFFECT for module in modules if hasattr(module, "EFFECT")]
    return {effect.name: effect for effect in sorted(effects, key=lambda effect: effect.order)}
