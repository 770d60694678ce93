"""A recipe as a sequence of motion segments, and whether the actuator can make each of them."""

from collections.abc import Iterator, Sequence
from math import ceil

from fingervision.domain.errors import FingervisionError, LimitError
from fingervision.domain.model import Model
from fingervision.domain.recipe import Recipe
from fingervision.storage.recipe_toml import BELOW_FORCE_N
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import MoveCheck
from fingervision.testbed.motion.move_limits import SLACK_MM, SoftLimits
from fingervision.testbed.recipe_kinds import Act, Close, Go, Leg, Rezero, Shift, Slot, Stand, Swing, Turn, step_of
from fingervision.testbed.recipe_kinds.sine import fastest_mm_s

# Time for settling before the frames at a point.
SETTLE_S = 0.3
REZERO_S = 2.0
# A recorded run begins at rest, if its first segment is recorded continuously.
REST_FRAMES = 5
# A run that takes longer than a month is assumed to be a mistake in the recipe.
LONGEST_S = 30.0 * 86400.0


Plan = tuple[Leg, ...]
"""The segments that the test bed will execute, in order."""


def plan(
    recipe: Recipe[Section], limits: SoftLimits, model: Model | None, start_mm: float, rate_hz: float, view_mm: float
) -> Plan:
    """Read all steps and check them against the limits.

    Parameters
    ----------
    recipe : Recipe
        The recipe as read from its file.
    limits : SoftLimits
        Soft limits of the test bed.
    model : Model or None
        Model of the gripper, which predicts gap and force at each position.
    start_mm : float
        Present position of the stage.
    rate_hz : float
        Frame rate of the camera.
    view_mm : float
        Width of the camera's view.

    Raises
    ------
    DataError
        A step is beyond a limit, or not valid; the message names the line and the excess.
    """
    # The default demands nothing: the lower limit acts.
    if recipe.below_force_n > limits.force_n and recipe.below_force_n != BELOW_FORCE_N:
        top = Section(recipe.steps[0].path, recipe.text, "", {})
        _beyond(top, "below_force_n", recipe.below_force_n, limits.force_n, "N", "force")
    legs: list[Leg] = []
    for number, section in enumerate(recipe.steps, start=1):
        for leg in legs_of(number, section, legs[-1].end_mm if legs else start_mm, limits, rate_hz):
            if isinstance(leg.act, Slot) and leg.act.size_mm >= view_mm:
                words = f"must be less than the {view_mm:.3g} mm that the camera sees, but is {leg.act.size_mm:g}."
                section.refuse(leg.key, words)
            _check(leg, limits, model, recipe.below_force_n)
            legs.append(leg)
    return tuple(legs)


def legs_of(number: int, section: Section, at_mm: float, limits: SoftLimits, rate_hz: float) -> Iterator[Leg]:
    """Read one step: yield its segments, without checking limits.

    Parameters
    ----------
    number : int
        Number of the step, from 1.
    section : Section
        The step.
    at_mm : float
        Position of the stage before the step.
    limits : SoftLimits
        Soft limits; closing until contact ends there at the latest.
    rate_hz : float
        Frame rate of the camera.

    Raises
    ------
    DataError
        The settings of the step are not valid.
    """
    for act, key in step_of(section).acts(section, at_mm):
        leg = Leg(act, number, section, key, *_foreseen(act, at_mm, limits, rate_hz))
        if leg.seconds > LONGEST_S:
            section.refuse(key, f"must end within {LONGEST_S / 86400.0:g} days, but takes {leg.seconds:.3g} s.")
        at_mm = leg.end_mm
        yield leg


def frames_of(legs: Sequence[Leg], rate_hz: float, settling_s: float) -> tuple[int, int]:
    """Least and largest number of frames that the segments record.

    Each motion may take longer by the settling time of the stage, closing until contact may end at once, and one frame
    more may fall into a segment.
    """
    least = most = 0
    starts = True
    for leg in legs:
        act = leg.act
        if leg.is_continuous:
            moves = isinstance(act, Go)
            # One more frame is recorded where a motion ends.
            whole = ceil(leg.seconds * rate_hz - SLACK_MM) + moves
            rest = REST_FRAMES if starts else 0
            least += rest + (0 if isinstance(act, Close) else whole)
            most += rest + whole + 1 + (ceil(settling_s * rate_hz) if moves else 0)
        elif isinstance(act, Go | Stand):
            least, most = least + (act.frames or 0), most + (act.frames or 0)
        starts = isinstance(act, Rezero | Turn | Shift)
    return least, most


def _foreseen(
    act: Act, at_mm: float, limits: SoftLimits, rate_hz: float
) -> tuple[float, float, float, tuple[float, ...]]:
    """Duration of a segment (s), position of the stage after it (mm), highest speed (mm/s), positions stated (mm)."""
    match act:
        case Go(to_mm, speed, frames):
            return abs(to_mm - at_mm) / speed + _points_s(frames, rate_hz), to_mm, speed, (to_mm,)
        case Stand(stands_s, frames):
            return stands_s + _points_s(frames, rate_hz), at_mm, 0.0, ()
        case Swing(mean_mm, amplitude_mm, frequency_hz, cycles):
            ends_mm = (mean_mm - amplitude_mm, mean_mm + amplitude_mm)
            return cycles / frequency_hz, mean_mm, fastest_mm_s(act), ends_mm
        case Close(speed, _):
            # The position of contact is unknown, so that every following step begins with a motion of its own.
            return abs(at_mm - limits.lower_mm) / speed, limits.lower_mm - SLACK_MM, speed, ()
        case Rezero():
            return REZERO_S, 0.0, 0.0, ()
    return 1.0, at_mm, 0.0, ()


def _points_s(frames: int | None, rate_hz: float) -> float:
    return frames / rate_hz + SETTLE_S if frames else 0.0


def _check(leg: Leg, limits: SoftLimits, model: Model | None, below_force_n: float) -> None:
    section, act, most_n = leg.section, leg.act, min(limits.force_n, below_force_n)
    if leg.speed_mm_s > limits.speed_mm_s:
        key, what = ("frequency_hz", "speed of the sine") if isinstance(act, Swing) else ("speed_mm_s", "speed")
        _beyond(section, key, leg.speed_mm_s, limits.speed_mm_s, "mm/s", what)
    if isinstance(act, Close) and act.below_force_n > most_n:
        _beyond(section, "below_force_n", act.below_force_n, most_n, "N", "force")
    for at_mm in leg.reached_mm:
        if not limits.lower_mm - SLACK_MM <= at_mm <= limits.upper_mm + SLACK_MM:
            limit_mm = limits.upper_mm if at_mm > limits.upper_mm else limits.lower_mm
            _beyond(section, leg.key, at_mm, limit_mm, "mm", "position")
        for value, limit, unit, what in limits.broken_at(at_mm, model, most_n):
            _beyond(section, leg.key, value, limit, unit, f"{what} at {at_mm:g} mm")


def _beyond(section: Section, key: str, value: float, limit: float, unit: str, what: str) -> None:
    way, much = ("beyond", "much") if value > limit else ("below", "little")
    section.refuse(
        key,
        f"leads {way} the test bed's limit of {what}, {limit:g} {unit}: it needs {value:g}, which is "
        f"{abs(value - limit):.3g} {unit} too {much}. Nothing was moved.",
    )


def check_moves(plan: Plan, actuator: MoveCheck, limits: SoftLimits, at_mm: float) -> None:
    """Refuse a plan that the actuator cannot execute: a motor controller can only move to the targets of its step data.

    Raises
    ------
    LimitError
        With the line of the recipe, and the actuator's reason.
    """
    for leg in plan:
        if isinstance(leg.act, Swing) and actuator.has_steps:
            raise LimitError(
                f"kind in {leg.section.at('kind')} cannot be executed: a sine consists of many short moves to "
                "intermediate positions, but this actuator can only move to the target positions of its step data. "
                "Use a triangle or a staircase between two target positions of the step data. Nothing was moved."
            )
        to_mm = leg.reached_mm[-1] if leg.reached_mm else max(leg.end_mm, limits.lower_mm)
        if leg.speed_mm_s and to_mm != at_mm:
            try:
                actuator.check(at_mm, to_mm, leg.speed_mm_s)
            except FingervisionError as error:
                raise LimitError(f"{leg.key} in {leg.section.at(leg.key)} cannot be executed: {error}") from error
        at_mm = leg.end_mm
