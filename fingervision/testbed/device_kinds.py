"""Kinds of devices: modules of three packages, plug-ins of other distributions and files, whose devices are guarded."""

import importlib
import pkgutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Generic, Protocol, cast

from fingervision.domain.errors import FingervisionError, error_words
from fingervision.plugins.faults import MisfitError, PluginShapeError
from fingervision.plugins.origin import Entry, Origin, of_file
from fingervision.plugins.registry import Registry
from fingervision.storage.toml_section import Section
from fingervision.testbed import actuators, cameras, force_sensors
from fingervision.testbed.actuator import Actuator, StageLimits
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.camera import BedCamera
from fingervision.testbed.force_sensor import ForceSensor, Reading


def guarded(build: Callable[[], Any], protocol: type, who: str, origin: Origin) -> Any:
    """Build a device and check that it follows its protocol.

    Parameters
    ----------
    build : callable
        Returns the device.
    protocol : type
        Protocol whose methods and properties the device must have.
    who : str
        Beginning of sentences about the device.
    origin : Origin
        Origin of the device.

    Returns
    -------
    The device; every exception that it raises from now on is a FingervisionError that names the device.

    Raises
    ------
    PluginShapeError
        The device could not be built, or does not meet its protocol; it is closed in that case.
    """
    with _faults(who, "be built", origin):
        device = build()
    kept = _Guarded(device, who, origin)
    try:
        _look_at(kept, device, protocol, who, origin)
    except BaseException:
        with suppress(Exception):
            device.close()
        raise
    return kept


def _look_at(kept: "_Guarded", device: Any, protocol: type, who: str, origin: Origin) -> None:
    bases = [base for base in protocol.__mro__ if base not in (object, Protocol, Generic)]
    wanted = [name for base in bases for name in vars(base) if not name.startswith("_")]
    lacks = [name for name in wanted if not (hasattr(type(device), name) or hasattr(device, name))]
    if lacks:
        raise PluginShapeError(
            f"{who} must have {', '.join(wanted)}, but has no {' and no '.join(lacks)}: {origin.remedy}."
        )
    if "limits" in wanted and not isinstance(kept.limits, StageLimits):
        given = type(kept.limits).__name__
        raise PluginShapeError(f"{who} must state its limits as StageLimits, but states a {given}: {origin.remedy}.")
    if "readings" in wanted:
        _check_readings(kept.readings(), who, origin)


def _check_readings(readings: Any, who: str, origin: Origin) -> None:
    if not isinstance(readings, tuple) or not readings or not all(isinstance(one, Reading) for one in readings):
        given = f"{len(readings)} of them" if isinstance(readings, tuple) else f"a {type(readings).__name__}"
        raise PluginShapeError(
            f"{who} must return a tuple of at least one Reading at each call of `readings`, but returned {given}: "
            f"{origin.remedy}."
        )


class _Guarded:
    """A proxy of a device that turns exceptions of the device into errors that name the device."""

    def __init__(self, device: Any, who: str, origin: Origin) -> None:
        self._device, self._who, self._origin = device, who, origin

    def __getattr__(self, name: str) -> Any:
        if not (hasattr(type(self._device), name) or name in getattr(self._device, "__dict__", {})):
            return getattr(self._device, name)
        with _faults(self._who, f"return its {name}", self._origin):
            found = getattr(self._device, name)
        if not callable(found) or isinstance(found, type):
            return found

        def called(*arguments: Any, **named: Any) -> Any:
            with _faults(self._who, f"return a result from {name}", self._origin):
                answer = found(*arguments, **named)
            if name == "readings":
                _check_readings(answer, self._who, self._origin)
            return answer

        return called


@contextmanager
def _faults(who: str, what: str, origin: Origin) -> Iterator[None]:
    """Turn exceptions of a device into errors that name it."""
    try:
        yield
    except FingervisionError:
        raise
    except Exception as error:
        raise PluginShapeError(f"{who} must {what}, but raised {error_words(error)}: {origin.remedy}.") from error


PACKAGES = {"actuator": actuators, "force_sensor": force_sensors, "camera": cameras}
PROTOCOLS: dict[str, type] = {"actuator": Actuator, "force_sensor": ForceSensor, "camera": BedCamera}
FILE = ".py"
"""Suffix of a kind that is given as a file; its path is relative to the test bed's file."""


class Kind(Protocol):
    """A module, or another object, that builds one kind of device.

    `KEYS` are the settings that a device's section may have in addition to `kind`. `SIMULATED` states that the device
    needs no hardware; a test bed with simulated devices only runs in virtual time.
    """

    KEYS: tuple[str, ...]
    SIMULATED: bool

    def build(self, section: Section, context: BuildContext) -> Any:
        """Build the device from its section of the configuration."""
        ...


class PluggedKind:
    """A kind of device from outside the package: its device is checked, and exceptions become errors of one sentence.

    Parameters
    ----------
    part : str
        `actuator`, `force_sensor` or `camera`.
    entry : Entry
        The kind, and its origin.
    """

    def __init__(self, part: str, entry: Entry[Kind]) -> None:
        self._part, self._entry = part, entry
        self.KEYS, self.SIMULATED = tuple(entry.value.KEYS), bool(entry.value.SIMULATED)
        for name in ("holder", "without_hardware"):
            if hasattr(entry.value, name):
                setattr(self, name, getattr(entry.value, name))

    def build(self, section: Section, context: BuildContext) -> Any:
        """Build the device.

        Raises
        ------
        PluginShapeError
            The device could not be built, or lacks a member of its protocol.
        """
        name = "" if str(self._entry.origin) == self._entry.name else f"{self._entry.name} of "
        who = f"The {NOUNS[self._part]} {name}{self._entry.origin}"
        return guarded(
            lambda: self._entry.value.build(section, context), PROTOCOLS[self._part], who, self._entry.origin
        )


NOUNS = {"actuator": "actuator", "force_sensor": "force sensor", "camera": "camera"}


def kinds(part: str) -> tuple[str, ...]:
    """Names of the kinds of a device (`actuator`, `force_sensor`, `camera`): first built-in, then installed ones."""
    return REGISTRIES[part].names()


def kind_of(part: str, section: Section) -> Kind:
    """Find the kind that a section names, and refuse settings that this kind does not have.

    Raises
    ------
    FingervisionError
        The kind of device is unknown, its module cannot be imported, or the section has an unknown key.
    """
    registry = REGISTRIES[part]
    name = section.word("kind")
    if name.endswith(FILE):
        path = section.path.parent / name
        (value,) = registry.in_file(path).values()
        kind: Kind = PluggedKind(part, Entry(str(path), value, of_file(str(path))))
    else:
        section.word("kind", of=kinds(part))
        entry = registry.get(name)
        kind = entry.value if entry.origin.built_in else PluggedKind(part, entry)
    section.only(("kind", *kind.KEYS))
    return kind


def _registry(part: str) -> Registry[Kind]:
    package = PACKAGES[part]

    def names() -> tuple[str, ...]:
        listed = pkgutil.iter_modules(package.__path__)
        return tuple(sorted(module.name for module in listed if not module.name.startswith("_")))

    def load(name: str) -> Kind:
        return cast("Kind", importlib.import_module(f"{package.__name__}.{name}"))

    return Registry(f"fingervision.{part}s", NOUNS[part], names, load, lambda held: _held(part, held))


def _held(part: str, held: object) -> dict[str, Kind]:
    """Return the builder in a module or object: the object itself, or its ACTUATOR, CAMERA or FORCE_SENSOR."""
    held = getattr(held, part.upper(), held)
    lacks = [name for name in ("KEYS", "SIMULATED") if not hasattr(held, name)]
    lacks += [] if callable(getattr(held, "build", None)) else ["build"]
    if lacks:
        raise MisfitError(f"must have KEYS, SIMULATED and build(section, context), but has no {' and no '.join(lacks)}")
    keys = held.KEYS  # type: ignore[attr-defined]  # looked for above
    if not (isinstance(keys, tuple) and all(isinstance(key, str) for key in keys)):
        raise MisfitError(f"must have a tuple of names as KEYS, but has {keys!r}")
    return {"": cast("Kind", held)}


REGISTRIES: dict[str, Registry[Kind]] = {part: _registry(part) for part in PACKAGES}
