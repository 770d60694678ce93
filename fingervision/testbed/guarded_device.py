"""Wrapper for a device from outside the package: the device is checked when it is built, and errors name it."""

from collections.abc import Callable
from contextlib import suppress
from typing import Any, Generic, NoReturn, Protocol

from fingervision.domain.errors import FingervisionError
from fingervision.plugins.faults import PluginShapeError
from fingervision.plugins.origin import Origin
from fingervision.testbed.actuator import StageLimits
from fingervision.testbed.reading import Reading


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
    try:
        device = build()
    except FingervisionError:
        raise
    except Exception as error:
        _say(who, "be built", error, origin)
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
        try:
            found = getattr(self._device, name)
        except FingervisionError:
            raise
        except Exception as error:
            if not hasattr(type(self._device), name):
                raise
            _say(self._who, f"return its {name}", error, self._origin)
        if not callable(found) or isinstance(found, type):
            return found

        def called(*arguments: Any, **named: Any) -> Any:
            try:
                answer = found(*arguments, **named)
            except FingervisionError:
                raise
            except Exception as error:
                _say(self._who, f"return a result from {name}", error, self._origin)
            if name == "readings":
                _check_readings(answer, self._who, self._origin)
            return answer

        return called


def _say(who: str, what: str, error: Exception, origin: Origin) -> NoReturn:
    said = f"{type(error).__name__}{f': {error}' if str(error) else ''}".replace("\n", " ")[:200].rstrip(".")
    raise PluginShapeError(f"{who} must {what}, but raised {said}: {origin.remedy}.") from error
