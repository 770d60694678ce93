"""Settings of a camera that can be changed while it runs, with their limits and the values that the camera accepted.

A live source whose settings can be changed has the methods `controls()` and `set_control(name, value)`. Both methods
are called between two frames by the thread that reads the frames, so that a driver needs no lock. A source without
`controls` and `set_control` has no settings that can be changed.
"""

from dataclasses import dataclass
from math import isclose, isfinite
from typing import Protocol, cast

from fingervision.domain.errors import DeviceError, FingervisionError, UsageError, error_words

EXPOSURE, GAIN, FOCUS, ZOOM, FRAME_RATE = "exposure", "gain", "focus", "zoom", "frame rate"
MOVES_SCALE = frozenset({FOCUS, ZOOM})
"""Settings that change the picture's scale and so invalidate a calibration."""
# A camera chooses the nearest of its possible values; a relative difference below this limit is not reported.
SAME_SHARE = 0.01


@dataclass(frozen=True, slots=True)
class CameraControl:
    """A setting of a camera, with its present value and its limits.

    Parameters
    ----------
    name : str
        Name of the setting: `exposure`, `gain`, `focus`, `frame rate`.
    value : float
        Value that the camera reports.
    unit : str
        Unit of value and limits: `ms`, `Hz`; empty if only the camera's maker knows it.
    least, greatest : float or None
        Limits that the camera states; None if it states no limit.
    """

    name: str
    value: float
    unit: str = ""
    least: float | None = None
    greatest: float | None = None

    def words(self, value: float) -> str:
        """The value of a setting with its unit."""
        return f"{value:.4g} {self.unit}".strip()


class Adjustable(Protocol):
    """A live source whose camera settings can be changed while it runs."""

    def controls(self) -> tuple[CameraControl, ...]:
        """Settings that may be changed while the camera runs, with their present values."""
        ...

    def set_control(self, name: str, value: float) -> None:
        """Request another value of a setting of the camera; `controls` then states the accepted value.

        Raises
        ------
        DeviceError
            The driver refuses the value.
        """
        ...


def controls_of(source: object) -> tuple[CameraControl, ...]:
    """Settings that may be changed now; none if the source has no settings or fails to state them.

    Parameters
    ----------
    source : LiveSource
        Called in the thread that reads it.
    """
    if not (callable(getattr(source, "controls", None)) and callable(getattr(source, "set_control", None))):
        return ()
    try:
        found: tuple[object, ...] = tuple(cast("Adjustable", source).controls())
        return tuple(each for each in found if isinstance(each, CameraControl) and isfinite(each.value))
    except Exception:  # an error in a driver removes the settings, but does not end the picture
        return ()


def check_value(controls: tuple[CameraControl, ...], name: str, value: float) -> CameraControl:
    """Find a setting by its name, and refuse a value beyond its limits.

    Raises
    ------
    UsageError
        There is no setting of this name, or the setting does not accept the value.
    """
    control = next((each for each in controls if each.name == name), None)
    if control is None:
        there = ", ".join(each.name for each in controls) or "nothing"
        raise UsageError(
            f"The setting must be one of those that can be changed while this camera runs ({there}), but is "
            f"{name[:40]!r}."
        )
    least, greatest = control.least, control.greatest
    is_known = name in (EXPOSURE, FRAME_RATE)
    if not isfinite(value) or (is_known and value <= 0.0):
        raise UsageError(f"The camera's {name} must be a {'positive ' * is_known}number, but is {value:g}.")
    if (least is not None and value < least) or (greatest is not None and value > greatest):
        limits = (
            f"at least {control.words(cast('float', least))}"
            if greatest is None
            else f"at most {control.words(greatest)}"
            if least is None
            else f"{least:.6g} to {control.words(greatest)}"
        )
        raise UsageError(f"The camera's {name} must be {limits}, but is {value:g}.")
    return control


def adjust(source: object, name: str, value: float) -> tuple[CameraControl, CameraControl]:
    """Request another value of a camera's setting, and read back the value that the camera accepted.

    Parameters
    ----------
    source : LiveSource
        Called in the thread that reads it.
    name : str
        Name of the setting.
    value : float
        Requested value, in the setting's unit.

    Returns
    -------
    (CameraControl, CameraControl)
        The setting before and after the change.

    Raises
    ------
    DeviceError
        The camera keeps its value, or its driver fails.
    UsageError
        The camera has no setting of this name, or the setting does not accept the value.
    """
    before = check_value(controls_of(source), name, value)
    try:
        cast("Adjustable", source).set_control(name, value)
    except FingervisionError:
        raise
    except Exception as error:  # an error in a driver must not end the live view
        raise DeviceError(f"The camera refused to set {name} {before.words(value)} ({error_words(error)}).") from error
    after = next((each for each in controls_of(source) if each.name == name), None)
    if after is None:
        raise DeviceError(f"The camera was set to {name} {before.words(value)}, but no longer reports its {name}.")
    if after.value == before.value and not _same(after.value, value):
        raise DeviceError(
            f"The camera was set to {name} {before.words(value)}, but stays at {after.words(after.value)}: the camera "
            "does not offer this value, or another of its settings prevents the change."
        )
    return before, after


def about_change(before: CameraControl, after: CameraControl, asked: float) -> str:
    """Sentence that reports a change of a setting to the user."""
    words = f"The camera's {after.name} was {before.words(before.value)} and is {after.words(after.value)} from now on"
    return f"{words}." if _same(after.value, asked) else f"{words} ({after.words(asked)} was requested)."


def _same(one: float, other: float) -> bool:
    return isclose(one, other, rel_tol=SAME_SHARE)
