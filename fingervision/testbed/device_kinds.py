"""The kinds of actuators, force sensors and cameras, found by listing three packages."""

import importlib
import pkgutil
from types import ModuleType
from typing import Any, Protocol

from fingervision.storage.toml_section import Section
from fingervision.testbed import actuators, cameras, force_sensors
from fingervision.testbed.build_context import BuildContext

PACKAGES = {"actuator": actuators, "force_sensor": force_sensors, "camera": cameras}


class Kind(Protocol):
    """A module that builds one kind of part.

    `KEYS` are the keys that its section may have besides `kind`; `SIMULATED` says whether it needs no hardware, so that
    a bed made of such parts alone runs in virtual time.
    """

    KEYS: tuple[str, ...]
    SIMULATED: bool

    def build(self, section: Section, context: BuildContext) -> Any:
        """Build the part from its section of the configuration."""
        ...


def kinds(part: str) -> tuple[str, ...]:
    """Names of the kinds of a part (`actuator`, `force_sensor`, `camera`), sorted."""
    listed = pkgutil.iter_modules(PACKAGES[part].__path__)
    return tuple(sorted(module.name for module in listed if not module.name.startswith("_")))


def kind_of(part: str, section: Section) -> Kind:
    """Find the module that builds a part as its section says, and refuse keys that it does not know.

    Raises
    ------
    FingervisionError
        There is no such kind, or a key is unknown.
    """
    name = section.word("kind", of=kinds(part))
    module: Any = importlib.import_module(f"{PACKAGES[part].__name__}.{name}")
    assert isinstance(module, ModuleType)  # noqa: S101 - what import_module gives
    section.only(("kind", *module.KEYS))
    kind: Kind = module
    return kind
