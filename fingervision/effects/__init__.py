"""Physical effects, one a file, named as in the catalogue: a module that holds an `EFFECT` is an entry."""

import importlib
import pkgutil
import sys
from functools import cache

from fingervision.domain.effect import Effect, Stage
from fingervision.domain.errors import ArgumentError
from fingervision.effects.effect_list import EffectList

_own: dict[str, Effect] = {}


@cache
def _built_in() -> dict[str, Effect]:
    modules = (importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__))
    effects = [module.EFFECT for module in modules if hasattr(module, "EFFECT")]
    return {effect.name: effect for effect in effects}


def catalogue() -> dict[str, Effect]:
    """List the effects by name, in the order in which they act in the measuring chain."""
    known = {**_built_in(), **_own}
    return dict(sorted(known.items(), key=lambda item: (list(Stage).index(item[1].stage), item[1].order)))


def register(effect: Effect) -> Effect:
    """Add an effect to the catalogue of this process, and give it back; one of the same name is replaced.

    Raises
    ------
    ArgumentError
        Its name is that of a built-in effect.
    """
    if effect.name in _built_in():
        raise ArgumentError("name", "be one that the catalogue has not", f"{effect.name} is a built-in effect")
    _own[effect.name] = effect
    return effect


def withdraw(name: str) -> None:
    """Take back what was registered; nothing happens where nothing was."""
    _own.pop(name, None)


# `fingervision.effects` itself can be iterated and asked by name.
sys.modules[__name__].__class__ = EffectList
