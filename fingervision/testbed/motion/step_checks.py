"""Check whether a stage can execute a sequence of step data, before anything moves."""

from dataclasses import dataclass

from fingervision.domain.errors import LimitError
from fingervision.domain.step_data import CycleTime, Step, StepData
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
