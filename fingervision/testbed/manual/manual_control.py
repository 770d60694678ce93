"""Individual motions on request, monitored to their end; stopping a bed, also from another process."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from math import copysign, inf
from time import monotonic, sleep
from types import FrameType

from fingervision.domain.errors import DeviceError, FingervisionError, LimitError, StateError
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import SIMULATED, open_bed, read_configuration
from fingervision.testbed.device_kinds import kind_of
from fingervision.testbed.motion.move_limits import check_move
from fingervision.testbed.serial_port import holder
from fingervision.testbed.terminal import handled

LOOK_EVERY_S = 0.02
# A jog made of stored steps is stopped this long before it would reach the test bed's limit.
WARNING_S = 0.1


class Interrupted(BaseException):
    """Ctrl-C or a request to end; the motor was stopped before this exception was raised, or its cause says why not."""


Looking = Callable[[], tuple[float, float | None]]
"""How a motion is monitored: a call waits for a short time of the test bed, or in the browser for a frame, and returns
the latest position (mm) and force (N; None without a force sensor)."""


def by_instruments(bed: Bed) -> tuple[float, float | None]:
    """Monitor a motion by the test bed's own readings."""
    bed.clock.wait_until(bed.clock.now_s() + LOOK_EVERY_S)
    force = bed.force_sensor
    return bed.actuator.readings()[-1].value, None if force is None else force.readings()[-1].value


@contextmanager
def motor_stops_first(stop: Callable[[], None]) -> Iterator[None]:
    """Within the `with` block, Ctrl-C and SIGTERM stop the motor first; signals reach the main thread only."""

    def note(number: int, frame: FrameType | None) -> None:
        # Not the error of a stop itself: a question that is being asked would be asked again after it.
        try:
            stop()
        except FingervisionError as error:
            raise Interrupted from error
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
    check_move(bed.limits, to_mm, speed_mm_s)
    for value, limit, unit, what in bed.limits.broken_at(to_mm, bed.model):
        raise LimitError(
            f"The target must keep the test bed's limit of {what}, {limit:g} {unit}, but leads to {value:.3g} {unit} "
            "by its [gripper]: nothing was moved."
        )
    return _watched(bed, lambda: bed.actuator.move(to_mm, speed_mm_s), looking=looking)


def jog(bed: Bed, speed_mm_s: float, for_s: float = inf, looking: Looking | None = None) -> float:
    """Move at a signed speed until stopped, for a time, or to a limit; return the position afterwards (mm)."""
    end_mm = bed.limits.upper_mm if speed_mm_s > 0.0 else bed.limits.lower_mm
    # A stored step that has begun runs to its end unless it is stopped in time.
    check_move(bed.limits, end_mm, abs(speed_mm_s))
    last_mm = end_mm - (WARNING_S * speed_mm_s if bed.actuator.has_steps else 0.0)
    looking = looking or partial(by_instruments, bed)
    # From beyond a limit of the gripper's, a jog may lead back.
    keeps = not any(bed.limits.broken_at(looking()[0], bed.model))

    def enough(at_mm: float) -> bool:
        is_beyond = copysign(1.0, speed_mm_s) * (at_mm - last_mm) >= 0.0
        return is_beyond or (keeps and any(bed.limits.broken_at(at_mm, bed.model)))

    return _watched(bed, lambda: bed.actuator.jog(speed_mm_s), for_s, enough, looking)


def run_step(bed: Bed, number: int) -> float:
    """Run a step data block; return the position afterwards (mm)."""
    return _watched(bed, lambda: bed.actuator.run_step(number))


def _watched(
    bed: Bed,
    begin: Callable[[], None],
    for_s: float = inf,
    enough: Callable[[float], bool] = lambda at_mm: False,
    looking: Looking | None = None,
) -> float:
    looking = looking or partial(by_instruments, bed)
    began_s = bed.clock.now_s()
    try:
        with motor_stops_first(bed.actuator.stop):
            begin()
            while bed.actuator.busy:
                at_mm, force_n = looking()
                bed.check(force_n, bed.limits.force_n)
                if bed.clock.now_s() - began_s >= for_s or enough(at_mm):
                    bed.actuator.stop()
            at_mm, force_n = looking()
            bed.check(force_n, bed.limits.force_n)
    except Interrupted as end:
        if end.__cause__ is not None:
            raise end.__cause__ from None
        at_mm, _ = looking()
        raise StateError(f"Stopped: the motor has stopped near {at_mm:z.3f} mm.") from None
    except FingervisionError:
        bed.actuator.stop()
        raise
    return at_mm


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
    find_holder = getattr(kind_of("actuator", section), "holder", holder)
    words = ""
    if (process := find_holder(section, top.path.parent)) is not None:
        os.kill(process, signal.SIGTERM)
        until_s = monotonic() + LETS_GO_WITHIN_S
        while find_holder(section, top.path.parent) is not None:
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
