"""Physical effects, one per file, named as in the catalogue: every module that holds an `EFFECT` is an entry.

Effects from other distributions (entry points of the group `fingervision.effects`), from files, and from this session
are entries of the catalogue too.
"""

import importlib
import pkgutil
import sys
from contextlib import AbstractContextManager
from functools import cache
from pathlib import Path

from fingervision.domain.effect import Effect, Stage
from fingervision.domain.further_check import FurtherCheck
from fingervision.effects.effect_list import EffectList
from fingervision.effects.trial import BUILT_IN, effects_in
from fingervision.plugins.origin import SESSION, Origin
from fingervision.plugins.registry import Registry
from fingervision.plugins.watched_import import importing

__all__ = ["REGISTRY", "added_effects", "catalogue", "origin_of", "register", "that_show", "withdraw"]


@cache
def _built_in() -> dict[str, Effect]:
    modules = (importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__))
    found = [module.EFFECT for module in modules if hasattr(module, "EFFECT")]
    BUILT_IN[:] = found
    return {effect.name: effect for effect in found}


REGISTRY: Registry[Effect] = Registry(
    "fingervision.effects", "effect", lambda: tuple(_built_in()), lambda name: _built_in()[name], effects_in
)
_by_version: dict[int, tuple[dict[str, Effect], dict[str, Origin]]] = {}


def catalogue() -> dict[str, Effect]:
    """List the effects by name, in the order in which they act in the measuring chain."""
    return _catalogue()[0]


def origin_of(name: str) -> Origin:
    """State where an effect of the catalogue comes from."""
    return _catalogue()[1][name]


def that_show(check: FurtherCheck) -> tuple[str, ...]:
    """Names of the effects that are visible in a check, in the catalogue's order."""
    return tuple(name for name, effect in catalogue().items() if effect.checks.get(check) is True)


def register(effect: Effect) -> Effect:
    """Add an effect to the catalogue of this process, and give it back.

    A registered effect is replaced when another of the same name is registered, because a notebook cell may run twice.

    Raises
    ------
    PluginShapeError
        The object is not an effect, or its function returns an invalid response.
    PluginNameError
        Another effect has the same name.
    """
    ((name, checked),) = REGISTRY.checked(effect, f"The effect {getattr(effect, 'name', effect)!s}", SESSION).items()
    REGISTRY.add(name, checked)
    return effect


def withdraw(name: str) -> None:
    """Remove a registered effect; nothing happens where there is none."""
    REGISTRY.remove(name)


def added_effects(paths: tuple[Path, ...]) -> AbstractContextManager[None]:
    """Add the effects of some files while a `with` block lasts."""
    return REGISTRY.with_files(paths)


def _catalogue() -> tuple[dict[str, Effect], dict[str, Origin]]:
    version = REGISTRY.version
    if version in _by_version:
        return _by_version[version]
    entries = sorted(REGISTRY.entries(), key=lambda entry: _place(entry.value, built_in=entry.origin.built_in))
    found = {entry.name: entry.value for entry in entries}, {entry.name: entry.origin for entry in entries}
    if not importing():
        _by_version.clear()
        _by_version[version] = found
    return found


def _place(effect: Effect, *, built_in: bool) -> tuple[int, float, bool, str]:
    """Sort key in the chain: stage, then `order`; at equal order built-in effects come first, then the name decides."""
    return list(Stage).index(effect.stage), effect.order, not built_in, effect.name


# `fingervision.effects` itself can be iterated and asked by name.
sys.modules[__name__].__class__ = EffectList
