"""Step data: whether a stage can execute a sequence before anything moves, and which blocks lead to a position."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import copysign

from fingervision.domain.errors import LimitError
from fingervision.domain.step_data import Coordinates, CycleTime, Operation, Step, StepData
from fingervision.testbed.actuator import StageLimits
from fingervision.testbed.motion.motion_profile import MotionProfile, profile, shortest_s

# Tolerance of a limit for the rounding of decimal fractions.
ROUNDING = 1e-9
MM_PER_M = 1000.0


@dataclass(frozen=True, slots=True)
class PlannedMotion:
    """One motion of a sequence of steps.

    Parameters
    ----------
    number : int
        Number of the block.
    step : Step
        The block.
    from_mm, to_mm : float
        Start and end position.
    motion : MotionProfile
        Motion profile.
    force_n : float
        Largest required motor force: load times acceleration, or the pushing force.
    """

    number: int
    step: Step
    from_mm: float
    to_mm: float
    motion: MotionProfile
    force_n: float


def planned(number: int, step: Step, from_mm: float, limits: StageLimits) -> PlannedMotion:
    """Compute one motion as the stage will execute it.

    Parameters
    ----------
    number : int
        Number of the block, for error messages.
    step : Step
        The block.
    from_mm : float
        Start position of the stage.
    limits : StageLimits
        Limits of the stage.

    Raises
    ------
    LimitError
        The motion leaves the stroke, is faster than the stage, or needs more force; the message names the limit and the
        excess and, if the positioning time is too short, the shortest possible time.
    """
    to_mm = step.end_mm(from_mm)
    lower_mm, upper_mm = limits.lower_mm - ROUNDING, limits.upper_mm + ROUNDING
    if not lower_mm <= to_mm <= upper_mm:
        beyond_mm = max(limits.lower_mm - to_mm, to_mm - limits.upper_mm)
        raise LimitError(
            f"Step {number} must end within the stroke of {limits.lower_mm:g} to {limits.upper_mm:g} mm, but from "
            f"{from_mm:g} mm it ends at {to_mm:g} mm, {beyond_mm:g} mm beyond: change its target_mm."
        )
    _check_speed(number, step, to_mm - from_mm, limits)
    motion = profile(to_mm - from_mm, step.entry, limits.speed_mm_s)
    accelerating_n = step.load_kg * max(motion.acceleration_mm_s2, motion.deceleration_mm_s2) / MM_PER_M
    if accelerating_n > limits.force_n * (1.0 + ROUNDING):
        raise LimitError(
            f"Step {number} must need at most {limits.force_n:g} N, but {step.load_kg:g} kg at "
            f"{accelerating_n / step.load_kg:.3g} m/s2 need {accelerating_n:.3g} N: accelerate and decelerate by "
            f"at most {limits.force_n / step.load_kg * MM_PER_M:.0f} mm/s2."
        )
    pushing_n = step.pushing_force_n or 0.0
    if pushing_n > limits.force_n:
        raise LimitError(
            f"Step {number} must push with at most {limits.force_n:g} N, but pushing_force_n is {pushing_n:g}."
        )
    return PlannedMotion(number, step, from_mm, to_mm, motion, max(accelerating_n, pushing_n))


def _check_speed(number: int, step: Step, way_mm: float, limits: StageLimits) -> None:
    entry = step.entry
    if isinstance(entry, CycleTime):
        least_s = shortest_s(way_mm, limits.speed_mm_s, MM_PER_M * limits.force_n / step.load_kg)
        if entry.positioning_time_s < least_s * (1.0 - ROUNDING):
            raise LimitError(
                f"positioning_time_s of step {number} must be at least {_rounded_up(least_s):g} s for its "
                f"travel of {abs(way_mm):g} mm with a load of {step.load_kg:g} kg, because the stage permits at most "
                f"{limits.speed_mm_s:g} mm/s and {limits.force_n:g} N, but is {entry.positioning_time_s:g}."
            )
    elif entry.speed_mm_s > limits.speed_mm_s:
        raise LimitError(
            f"speed_mm_s of step {number} must be at most {limits.speed_mm_s:g}, but is {entry.speed_mm_s:g}."
        )


def _rounded_up(seconds: float) -> float:
    """Round a duration up to a tenth of a millisecond."""
    return (int(seconds * 1e4) + 1) / 1e4


def planned_sequence(data: StepData, limits: StageLimits, from_mm: float | None = None) -> tuple[PlannedMotion, ...]:
    """Compute all motions of the sequence, one after another.

    A block of step data outside the sequence is checked when it is run, because its start position is unknown before
    that.

    Parameters
    ----------
    data : StepData
        Blocks and sequence.
    limits : StageLimits
        Limits of the stage.
    from_mm : float, optional
        Start position; the start stated in the data if not given.

    Raises
    ------
    LimitError
        A motion cannot be executed.
    """
    motions: list[PlannedMotion] = []
    at_mm = data.start_mm if from_mm is None else from_mm
    for number in data.sequence:
        motions.append(planned(number, data.steps[number], at_mm, limits))
        at_mm = motions[-1].to_mm
    return tuple(motions)


# Tolerance for targets with three decimals and for the rounding of sums of steps; the accuracy of the stage itself is
# 0.09 mm.
SAME_MM = 1e-3
SAME_SPEED = 0.01
MOST_BLOCKS = 200


def nominal_speed_mm_s(step: Step, way_mm: float, top_speed_mm_s: float) -> float:
    """Speed (mm/s) stated by a block of step data, or resulting from the block's positioning time."""
    if isinstance(step.entry, CycleTime):
        return profile(way_mm, step.entry, top_speed_mm_s).speed_mm_s
    return step.entry.speed_mm_s


def route(
    steps: Mapping[int, Step], at_mm: float | None, to_mm: float, speed_mm_s: float, top_speed_mm_s: float
) -> tuple[int, ...]:
    """Numbers of the blocks that lead to a position without exceeding the requested speed.

    A single absolute block is preferred to a repeated relative block, and a repeated relative block to an absolute
    block followed by relative blocks. Among several possibilities, the fastest is chosen, and among equally fast ones
    that with the fewest blocks.

    Parameters
    ----------
    steps : mapping of int to Step
        Step data stored in the motor controller.
    at_mm : float or None
        Present position of the stage; None if it is not known, so that only absolute blocks can be used.
    to_mm : float
        Target position.
    speed_mm_s : float
        Highest speed.
    top_speed_mm_s : float
        Top speed of the stage.

    Raises
    ------
    LimitError
        No blocks lead to the position, or only blocks that are faster than requested.
    """
    if at_mm is not None and abs(to_mm - at_mm) <= SAME_MM:
        return ()
    found = list(_routes(steps, at_mm, to_mm, top_speed_mm_s))
    slow_enough = [each for each in found if each[1] <= speed_mm_s * (1.0 + SAME_SPEED)]
    if slow_enough:
        return max(slow_enough, key=lambda each: (-each[2], each[1], -len(each[0])))[0]
    if found:
        slowest = min(speed for _, speed, _ in found)
        raise LimitError(
            f"The move to {to_mm:g} mm must not be faster than {speed_mm_s:g} mm/s, but the slowest step that leads "
            f"there has {slowest:.4g} mm/s: allow this speed, or store a slower step in the controller."
        )
    targets = ", ".join(
        f"{each.target_mm:g}" for each in _moving(steps).values() if each.coordinates is Coordinates.ABSOLUTE
    )
    raise LimitError(
        f"A stored step must end at {to_mm:g} mm, but none does: the absolute steps in the controller end at "
        f"{targets or 'no position'} mm, and no relative step leads to {to_mm:g} mm. Store an absolute "
        f"step to {to_mm:g} mm in the controller, or let the recipe move to one of the stored positions."
    )


def _moving(steps: Mapping[int, Step]) -> dict[int, Step]:
    return {number: step for number, step in steps.items() if step.operation is Operation.MOVING}


def _routes(
    steps: Mapping[int, Step], at_mm: float | None, to_mm: float, top_speed_mm_s: float
) -> Iterator[tuple[tuple[int, ...], float, int]]:
    """Possible sequences of blocks, each with its highest speed and its order of preference."""
    moving = _moving(steps)
    absolute = {n: step for n, step in moving.items() if step.coordinates is Coordinates.ABSOLUTE}
    starts: list[tuple[tuple[int, ...], float, float, int]] = []
    if at_mm is not None:
        starts.append(((), at_mm, 0.0, 1))
    for number, step in absolute.items():
        way_mm = step.target_mm - (at_mm if at_mm is not None else to_mm)
        speed = nominal_speed_mm_s(step, way_mm, top_speed_mm_s)
        if abs(step.target_mm - to_mm) <= SAME_MM:
            yield (number,), speed, 0
        starts.append(((number,), step.target_mm, speed, 2))
    for before, from_mm, speed, kind in starts:
        for number, step in moving.items():
            if step.coordinates is Coordinates.RELATIVE and step.target_mm != 0.0:
                count = round((to_mm - from_mm) / step.target_mm)
                if 1 <= count <= MOST_BLOCKS and abs(from_mm + count * step.target_mm - to_mm) <= SAME_MM:
                    own = nominal_speed_mm_s(step, step.target_mm, top_speed_mm_s)
                    yield before + count * (number,), max(speed, own), kind


def jog_step(steps: Mapping[int, Step], speed_mm_s: float, top_speed_mm_s: float) -> int:
    """Number of the relative block to repeat for a jog: the fastest in that direction within the requested speed.

    Raises
    ------
    LimitError
        The controller has no such step.
    """
    speeds = {
        number: nominal_speed_mm_s(step, step.target_mm, top_speed_mm_s)
        for number, step in _moving(steps).items()
        if step.coordinates is Coordinates.RELATIVE and step.target_mm * copysign(1.0, speed_mm_s) > 0.0
    }
    fine = [number for number, speed in speeds.items() if speed <= abs(speed_mm_s) * (1.0 + SAME_SPEED)]
    if not fine:
        sign = "positive" if speed_mm_s > 0.0 else "negative"
        raise LimitError(
            f"A jog at {speed_mm_s:g} mm/s must have a stored relative step with a {sign} target and at most this "
            "speed, but the controller has none: store such a step."
        )
    return max(fine, key=lambda number: speeds[number])
