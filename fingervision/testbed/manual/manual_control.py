"""Single motions on request, watched until they end and stopped at a limit."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import copysign, inf, isfinite
from types import FrameType

from fingervision.domain.errors import FingervisionError
from fingervision.testbed.bed import Bed

LOOK_EVERY_S = 0.02
# A jog of blocks is stopped so long before the bed's limit.
WARNING_S = 0.1


class Interrupted(BaseException):
    """Ctrl-C, or a request to end; the motor was stopped before it was raised."""


@contextmanager
def motor_stops_first(stop: Callable[[], None]) -> Iterator[None]:
    """Let Ctrl-C and SIGTERM stop the motor before anything else."""

    def note(number: int, frame: FrameType | None) -> None:
        stop()
        raise Interrupted

    before = {each: signal.signal(each, note) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


def home(bed: Bed) -> float:
    """Go to the reference; give the position then."""
    return _watched(bed, bed.actuator.home)


def move(bed: Bed, to_mm: float, speed_mm_s: float) -> float:
    """Move within the bed's limits; give the position then.

    Raises
    ------
    FingervisionError
        The target or the speed is beyond a limit (nothing was moved), or the motion was broken off.
    """
    limits = bed.limits
    if not isfinite(to_mm):
        raise FingervisionError(f"The target must be a finite number of mm, but is {to_mm:g}: nothing was moved.")
    if not limits.lower_mm <= to_mm <= limits.upper_mm:
        beyond_mm = max(limits.lower_mm - to_mm, to_mm - limits.upper_mm)
        raise FingervisionError(
            f"The target must lie within the bed's limits of {limits.lower_mm:g} to {limits.upper_mm:g} mm, but "
            f"{to_mm:g} mm is {beyond_mm:.4g} mm beyond: nothing was moved."
        )
    _check_speed(bed, speed_mm_s)
    return _watched(bed, lambda: bed.actuator.move(to_mm, speed_mm_s))


def jog(bed: Bed, speed_mm_s: float, for_s: float = inf) -> float:
    """Move at a signed speed until stopped, for a time, or to the bed's limit; give the position then."""
    _check_speed(bed, abs(speed_mm_s))
    end_mm = bed.limits.upper_mm if speed_mm_s > 0.0 else bed.limits.lower_mm
    # A block that has begun goes to its end unless it is stopped in time.
    last_mm = end_mm - (WARNING_S * speed_mm_s if bed.actuator.has_steps else 0.0)

    def enough(at_mm: float) -> bool:
        return copysign(1.0, speed_mm_s) * (at_mm - last_mm) >= 0.0

    return _watched(bed, lambda: bed.actuator.jog(speed_mm_s), for_s, enough)


def run_step(bed: Bed, number: int) -> float:
    """Run a step data block; give the position then."""
    return _watched(bed, lambda: bed.actuator.run_step(number))


def _check_speed(bed: Bed, speed_mm_s: float) -> None:
    if not 0.0 < speed_mm_s <= bed.limits.speed_mm_s:
        raise FingervisionError(
            f"The speed must be positive and at most {bed.limits.speed_mm_s:g} mm/s, but is {speed_mm_s:g}: nothing "
            "was moved."
        )


def _watched(
    bed: Bed, begin: Callable[[], None], for_s: float = inf, enough: Callable[[float], bool] = lambda at_mm: False
) -> float:
    began_s = bed.clock.now_s()
    try:
        with motor_stops_first(bed.actuator.stop):
            begin()
            while bed.actuator.busy:
                _check(bed)
                if bed.clock.now_s() - began_s >= for_s or enough(bed.actuator.readings()[-1].value):
                    bed.actuator.stop()
                bed.clock.wait_until(bed.clock.now_s() + LOOK_EVERY_S)
            _check(bed)
    except Interrupted:
        at_mm = bed.actuator.readings()[-1].value
        raise FingervisionError(f"Stopped: the motor stands near {at_mm:.3f} mm.") from None
    except FingervisionError:
        bed.actuator.stop()
        raise
    return bed.actuator.readings()[-1].value


def _check(bed: Bed) -> None:
    alarm = bed.actuator.alarm
    if alarm is not None:
        raise FingervisionError(f"The actuator has an alarm ({alarm.code}: {alarm.words}): the motor was stopped.")
    if bed.force_sensor is None:
        return
    force_n = bed.force_sensor.readings()[-1].value
    if abs(force_n) > bed.limits.force_n:
        raise FingervisionError(
            f"The force must stay below {bed.limits.force_n:g} N, but is {force_n:.3g} N: the motor was stopped."
        )
