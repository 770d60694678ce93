"""Individual motions on request, monitored to their end; stopping a bed, also from another process."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import copysign, inf, isfinite
from time import monotonic, sleep
from types import FrameType

from fingervision.domain.errors import DeviceError, FingervisionError, LimitError, StateError
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import SIMULATED, open_bed, read_configuration
from fingervision.testbed.device_kinds import kind_of
from fingervision.testbed.terminal import handled

LOOK_EVERY_S = 0.02
# A jog made of stored steps is stopped this long before it would reach the test bed's limit.
WARNING_S = 0.1


class Interrupted(BaseException):
    """Ctrl-C or a request to end; the motor was stopped before this exception was raised."""


@dataclass(frozen=True, slots=True)
class Looking:
    """How a motion is monitored: by the test bed's instruments alone or, in the browser, by every frame as well.

    Parameters
    ----------
    wait : callable
        Waits for a short time of the test bed.
    position_mm, force_n : callable
        Return the latest readings; the force is None without a force sensor.
    """

    wait: Callable[[], None]
    position_mm: Callable[[], float]
    force_n: Callable[[], float | None]


def by_instruments(bed: Bed) -> Looking:
    """Monitor a motion by the test bed's own readings."""
    return Looking(
        lambda: bed.clock.wait_until(bed.clock.now_s() + LOOK_EVERY_S),
        lambda: bed.actuator.readings()[-1].value,
        lambda: None if bed.force_sensor is None else bed.force_sensor.readings()[-1].value,
    )


@contextmanager
def motor_stops_first(stop: Callable[[], None]) -> Iterator[None]:
    """Within the `with` block, Ctrl-C and SIGTERM stop the motor first; signals reach the main thread only."""

    def note(number: int, frame: FrameType | None) -> None:
        stop()
        raise Interrupted

    with handled(note):
        yield


def home(bed: Bed, looking: Looking | None = None) -> float:
    """Move to the reference; return the position afterwards (mm)."""
    return _watched(bed, bed.actuator.home, looking=looking)


def move(bed: Bed, to_mm: float, speed_mm_s: float, looking: Looking | None = None) -> float:
    """Move within the test bed's limits; return the position afterwards (mm).

    Raises
    ------
    DeviceError, LimitError, StateError
        The target or the speed is beyond a limit (nothing was moved), or the motion was interrupted.
    """
    limits = bed.limits
    if not isfinite(to_mm):
        raise LimitError(f"The target must be a finite number of mm, but is {to_mm:g}: nothing was moved.")
    if not limits.lower_mm <= to_mm <= limits.upper_mm:
        beyond_mm = max(limits.lower_mm - to_mm, to_mm - limits.upper_mm)
        raise LimitError(
            f"The target must lie within the test bed's limits of {limits.lower_mm:g} to {limits.upper_mm:g} mm, but "
            f"{to_mm:g} mm is {beyond_mm:.4g} mm beyond: nothing was moved."
        )
    _check_speed(bed, speed_mm_s)
    return _watched(bed, lambda: bed.actuator.move(to_mm, speed_mm_s), looking=looking)


def jog(bed: Bed, speed_mm_s: float, for_s: float = inf, looking: Looking | None = None) -> float:
    """Move at a signed speed until stopped, for a time, or to a limit; return the position afterwards (mm)."""
    _check_speed(bed, abs(speed_mm_s))
    end_mm = bed.limits.upper_mm if speed_mm_s > 0.0 else bed.limits.lower_mm
    # A stored step that has begun runs to its end unless it is stopped in time.
    last_mm = end_mm - (WARNING_S * speed_mm_s if bed.actuator.has_steps else 0.0)

    def enough(at_mm: float) -> bool:
        return copysign(1.0, speed_mm_s) * (at_mm - last_mm) >= 0.0

    return _watched(bed, lambda: bed.actuator.jog(speed_mm_s), for_s, enough, looking)


def run_step(bed: Bed, number: int) -> float:
    """Run a step data block; return the position afterwards (mm)."""
    return _watched(bed, lambda: bed.actuator.run_step(number))


def _check_speed(bed: Bed, speed_mm_s: float) -> None:
    if not 0.0 < speed_mm_s <= bed.limits.speed_mm_s:
        raise LimitError(
            f"The speed must be positive and at most {bed.limits.speed_mm_s:g} mm/s, but is {speed_mm_s:g}: nothing "
            "was moved."
        )


def _watched(
    bed: Bed,
    begin: Callable[[], None],
    for_s: float = inf,
    enough: Callable[[float], bool] = lambda at_mm: False,
    looking: Looking | None = None,
) -> float:
    looking = looking or by_instruments(bed)
    began_s = bed.clock.now_s()
    try:
        with motor_stops_first(bed.actuator.stop):
            begin()
            while bed.actuator.busy:
                bed.check(looking.force_n(), bed.limits.force_n)
                if bed.clock.now_s() - began_s >= for_s or enough(looking.position_mm()):
                    bed.actuator.stop()
                looking.wait()
            bed.check(looking.force_n(), bed.limits.force_n)
    except Interrupted:
        at_mm = looking.position_mm()
        raise StateError(f"Stopped: the motor has stopped near {at_mm:z.3f} mm.") from None
    except FingervisionError:
        bed.actuator.stop()
        raise
    return looking.position_mm()


# Stop a test bed, also if another process operates it.

LETS_GO_WITHIN_S, STOPS_WITHIN_S = 5.0, 2.0


def stop_bed(name: str) -> str:
    """Stop a test bed's motor, and return a sentence that says what was done.

    Parameters
    ----------
    name : str
        `simulated`, or the path of a configuration file.

    Raises
    ------
    DataError, DeviceError, InputFileError, UsageError
        The test bed cannot be opened, or the other process does not release it.
    """
    if name == SIMULATED:
        return "The simulated test bed is at rest: its motor moves only while a command runs."
    top = read_configuration(name)
    section = top.table("actuator")
    find_holder = getattr(kind_of("actuator", section), "holder", None)
    process = None if find_holder is None else find_holder(section, top.path.parent)
    words = ""
    if process is not None:
        os.kill(process, signal.SIGTERM)
        until_s = monotonic() + LETS_GO_WITHIN_S
        while find_holder is not None and find_holder(section, top.path.parent) is not None:
            if monotonic() > until_s:
                raise DeviceError(
                    f"Process {process} must release the test bed within {LETS_GO_WITHIN_S:g} s, but does "
                    "not: switch off the motor's power supply."
                )
            sleep(LOOK_EVERY_S)
        words = f"Process {process}, which operated the test bed, was ended. "
    bed = open_bed(name)
    try:
        bed.actuator.stop()
        until_s = bed.clock.now_s() + STOPS_WITHIN_S
        while bed.actuator.busy:
            if bed.clock.now_s() > until_s:
                raise DeviceError(
                    f"{bed.actuator.name} must be at rest {STOPS_WITHIN_S:g} s after it was told to stop, but reports "
                    "motion: use the emergency stop."
                )
            bed.clock.wait_until(bed.clock.now_s() + LOOK_EVERY_S)
        return f"{words}Stopped: {bed.actuator.name} reports no motion."
    finally:
        bed.close()
