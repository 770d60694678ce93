"""Physical effects, one per module, named as in the catalogue: every module that defines `EFFECT` is an entry.

The catalogue also contains effects from other distributions (entry points of the group `fingervision.effects`), from
files, and from the present session.
"""

import copyreg
import importlib
import pickle
import pkgutil
import sys
from contextlib import AbstractContextManager
from dataclasses import fields
from functools import cache
from pathlib import Path
from typing import Any

from fingervision.domain.effect import DriveEffect, Effect, PointEffect, Stage
from fingervision.domain.further_check import FurtherCheck
from fingervision.effects.effect_list import EffectList
from fingervision.effects.trial import effects_in
from fingervision.plugins.origin import SESSION, Origin
from fingervision.plugins.registry import Registry
from fingervision.plugins.watched_import import importing

__all__ = ["REGISTRY", "added_effects", "catalogue", "origin_of", "register", "that_show", "withdraw"]


def _pickled(effect: Effect) -> str | tuple[Any, ...]:
    """Pickle an effect of this package, or a decorated function, by its name, and another effect as it is.

    What a notebook or script decorates is sent whole by cloudpickle, where that is in use (by Dask and joblib).
    """
    if _built_in().get(effect.name) is effect:
        return _unpickled, (effect.name,)
    act = getattr(effect, "act", None)
    home = getattr(act, "__module__", ""), getattr(act, "__qualname__", "")
    if getattr(sys.modules.get(home[0]), home[1], None) is not effect:
        return object.__reduce_ex__(effect, 2)
    if home[0] == "__main__" and "cloudpickle" in sys.modules:
        values = {each.name: getattr(effect, each.name) for each in fields(effect)}
        return _made_of, (type(effect), sys.modules["cloudpickle"].dumps(values))
    return _imported, home


def _unpickled(name: str) -> Effect:
    return _built_in()[name]


def _imported(module: str, name: str) -> Effect:
    found: Effect = getattr(importlib.import_module(module), name)
    return found


def _made_of(kind: type[Effect], values: bytes) -> Effect:
    return kind(**pickle.loads(values))


for _kind in (Effect, DriveEffect, PointEffect):
    copyreg.pickle(_kind, _pickled)


@cache
def _built_in() -> dict[str, Effect]:
    modules = (importlib.import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__))
    found = [module.EFFECT for module in modules if hasattr(module, "EFFECT")]
    return {effect.name: effect for effect in found}


REGISTRY: Registry[Effect] = Registry(
    "fingervision.effects",
    "effect",
    lambda: tuple(_built_in()),
    lambda name: _built_in()[name],
    lambda held: effects_in(held, _built_in().values()),
)
_by_version: dict[int, tuple[dict[str, Effect], dict[str, Origin]]] = {}


def catalogue() -> dict[str, Effect]:
    """List the effects by name, in the order in which they act in the measuring chain."""
    return _catalogue()[0]


def origin_of(name: str) -> Origin:
    """Return the origin of an effect: this package, another distribution, a file, or the present session."""
    return _catalogue()[1][name]


def that_show(check: FurtherCheck) -> tuple[str, ...]:
    """Names of the effects that are visible in a given check of the set-up, in the order of the catalogue."""
    return tuple(name for name, effect in catalogue().items() if effect.checks.get(check) is True)


def register(effect: Effect) -> Effect:
    """Add an effect to the catalogue of this process, and return the effect.

    A registered effect is replaced if another effect of the same name is registered, because a notebook cell may run
    twice.

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
    """Remove a registered effect; nothing happens if no effect of that name is registered."""
    REGISTRY.remove(name)


def added_effects(paths: tuple[Path, ...]) -> AbstractContextManager[None]:
    """Add the effects defined in files for the duration of a `with` block."""
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
    """Sort key of an effect in the measuring chain: section, then `order`, built-in effects first, then the name."""
    return list(Stage).index(effect.stage), effect.order, not built_in, effect.name


# The package `fingervision.effects` can itself be iterated and indexed by name.
sys.modules[__name__].__class__ = EffectList
