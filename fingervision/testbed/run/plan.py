"""A recipe as a sequence of motion segments, and whether the actuator can make each of them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil, tau

import numpy as np

from fingervision.domain.errors import FingervisionError, LimitError
from fingervision.domain.model import Model
from fingervision.domain.recipe import Recipe
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import MoveCheck
from fingervision.testbed.motion.move_limits import SoftLimits
from fingervision.testbed.recipe_kinds import step_of
from fingervision.testbed.recipe_kinds.sine import fastest_mm_s
from fingervision.testbed.run.motion_segments import Close, Go, Leg, Rezero, Shift, Slot, Stand, Swing, Turn

# Tolerance of the limits for the rounding of positions.
SLACK_MM = 1e-9
# Time for settling before the frames at a point.
SETTLE_S = 0.3
REZERO_S = 2.0
# A recorded run begins at rest, if its first segment is recorded continuously.
REST_FRAMES = 5
# A run that takes longer than a month is assumed to be a mistake in the recipe.
LONGEST_S = 30.0 * 86400.0


@dataclass(frozen=True, slots=True)
class Plan:
    """The segments that the test bed will execute.

    Parameters
    ----------
    legs : tuple of Leg
        Segments in order.
    seconds : tuple of float
        Expected duration of each segment.
    """

    legs: tuple[Leg, ...]
    seconds: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Timed:
    """One segment with its expected duration, and the position of the stage after it."""

    leg: Leg
    seconds: float
    end_mm: float


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
    if recipe.below_force_n > limits.force_n:
        top = Section(recipe.steps[0].path, recipe.text, "", {})
        _beyond(top, "below_force_n", recipe.below_force_n, limits.force_n, "N", "force")
    done: list[Timed] = []
    for number, section in enumerate(recipe.steps, start=1):
        at_mm = done[-1].end_mm if done else start_mm
        for timed in timed_segments(number, section, at_mm, limits, rate_hz):
            if isinstance(timed.leg.act, Slot) and timed.leg.act.size_mm >= view_mm:
                words = (
                    f"must be less than the {view_mm:.3g} mm that the camera sees, but is {timed.leg.act.size_mm:g}."
                )
                section.refuse(timed.leg.key, words)
            _check(timed.leg, limits, model, recipe.below_force_n)
            done.append(timed)
    return Plan(tuple(one.leg for one in done), tuple(one.seconds for one in done))


def timed_segments(
    number: int, section: Section, at_mm: float, limits: SoftLimits, rate_hz: float
) -> Iterator["Timed"]:
    """Read one step: yield its segments, each with its duration and end position, without checking limits.

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
        leg = Leg(act, number, section, key)
        lasts_s, at_mm = _lasts(leg, at_mm, limits, rate_hz)
        if lasts_s > LONGEST_S:
            section.refuse(key, f"must end within {LONGEST_S / 86400.0:g} days, but takes {lasts_s:.3g} s.")
        yield Timed(leg, lasts_s, at_mm)


def frames_of(segments: Sequence[Timed], rate_hz: float, settling_s: float) -> tuple[int, int]:
    """Least and largest number of frames that the segments record.

    Each motion may take longer by the settling time of the stage, closing until contact may end at once, and one frame
    more may fall into a segment.
    """
    least = most = 0
    starts = True
    for leg, seconds in ((each.leg, each.seconds) for each in segments):
        act = leg.act
        if leg.is_continuous:
            moves = isinstance(act, Go)
            # One more frame is recorded where a motion ends.
            whole = ceil(seconds * rate_hz - SLACK_MM) + moves
            rest = REST_FRAMES if starts else 0
            least += rest + (0 if isinstance(act, Close) else whole)
            most += rest + whole + 1 + (ceil(settling_s * rate_hz) if moves else 0)
        elif isinstance(act, Go | Stand):
            least, most = least + (act.frames or 0), most + (act.frames or 0)
        starts = isinstance(act, Rezero | Turn | Shift)
    return least, most


def _lasts(leg: Leg, at_mm: float, limits: SoftLimits, rate_hz: float) -> tuple[float, float]:
    """Duration of a segment (s), and position of the stage after it (mm)."""
    match leg.act:
        case Go(to_mm, speed, frames):
            return abs(to_mm - at_mm) / speed + _points_s(frames, rate_hz), to_mm
        case Stand(stands_s, frames):
            return stands_s + _points_s(frames, rate_hz), at_mm
        case Swing(mean_mm, _, frequency_hz, cycles):
            return cycles / frequency_hz, mean_mm
        case Close(speed, _):
            # The position of contact is unknown, so that every following step begins with a motion of its own.
            return abs(at_mm - limits.lower_mm) / speed, limits.lower_mm - SLACK_MM
        case Rezero():
            return REZERO_S, 0.0
    return 1.0, at_mm


def _points_s(frames: int | None, rate_hz: float) -> float:
    return frames / rate_hz + SETTLE_S if frames else 0.0


def _check(leg: Leg, limits: SoftLimits, model: Model | None, below_force_n: float) -> None:
    section, act = leg.section, leg.act
    if isinstance(act, Go | Close) and act.speed_mm_s > limits.speed_mm_s:
        _beyond(section, "speed_mm_s", act.speed_mm_s, limits.speed_mm_s, "mm/s", "speed")
    if isinstance(act, Swing) and fastest_mm_s(act) > limits.speed_mm_s:
        _beyond(section, "frequency_hz", fastest_mm_s(act), limits.speed_mm_s, "mm/s", "speed of the sine")
    if isinstance(act, Close) and act.below_force_n > min(limits.force_n, below_force_n):
        _beyond(section, "below_force_n", act.below_force_n, min(limits.force_n, below_force_n), "N", "force")
    for at_mm in _reached_mm(leg):
        if at_mm > limits.upper_mm + SLACK_MM:
            _beyond(section, leg.key, at_mm, limits.upper_mm, "mm", "position")
        if at_mm < limits.lower_mm - SLACK_MM:
            _below(section, leg.key, at_mm, limits.lower_mm, "position")
        if model is None:
            continue
        answer = model.respond(np.array([at_mm]))
        if answer.force_n is not None and abs(float(answer.force_n[0])) > min(limits.force_n, below_force_n):
            needed_n = abs(float(answer.force_n[0]))
            _beyond(section, leg.key, needed_n, min(limits.force_n, below_force_n), "N", f"force at {at_mm:g} mm")
        if float(answer.gap_mm[0]) < limits.gap_mm - SLACK_MM:
            _below(section, leg.key, float(answer.gap_mm[0]), limits.gap_mm, f"gap at {at_mm:g} mm")


def _reached_mm(leg: Leg) -> Iterator[float]:
    match leg.act:
        case Go(to_mm, _, _):
            yield to_mm
        case Swing(mean_mm, amplitude_mm, _, _):
            yield mean_mm - amplitude_mm
            yield mean_mm + amplitude_mm


def _beyond(section: Section, key: str, value: float, limit: float, unit: str, what: str) -> None:
    section.refuse(
        key,
        f"leads beyond the test bed's limit of {what}, {limit:g} {unit}: it needs {value:g}, which is "
        f"{value - limit:.3g} {unit} too much. Nothing was moved.",
    )


def _below(section: Section, key: str, value: float, limit: float, what: str) -> None:
    section.refuse(
        key,
        f"leads below the test bed's limit of {what}, {limit:g} mm: it needs {value:g}, which is "
        f"{limit - value:.3g} mm too little. Nothing was moved.",
    )


def check_moves(plan: Plan, actuator: MoveCheck, limits: SoftLimits, at_mm: float) -> None:
    """Refuse a plan that the actuator cannot execute: a motor controller can only move to the targets of its step data.

    Raises
    ------
    LimitError
        With the line of the recipe, and the actuator's reason.
    """
    for leg in plan.legs:
        to_mm, speed_mm_s = at_mm, 0.0
        match leg.act:
            case Go(to, speed):
                to_mm, speed_mm_s = to, speed
            case Swing(mean, amplitude, frequency_hz):
                if actuator.has_steps:
                    raise LimitError(
                        f"kind in {leg.section.at('kind')} cannot be executed: a sine consists of many short moves to "
                        "intermediate positions, but this actuator can only move to the target positions of its step "
                        "data. Use a triangle or a staircase between two target positions of the step data. Nothing "
                        "was moved."
                    )
                to_mm, speed_mm_s = mean + amplitude, tau * frequency_hz * abs(amplitude)
            case Close(speed):
                to_mm, speed_mm_s = limits.lower_mm, speed
            case Rezero():
                at_mm = 0.0
                continue
        if to_mm == at_mm:
            continue
        try:
            actuator.check(at_mm, to_mm, speed_mm_s)
        except FingervisionError as error:
            raise LimitError(f"{leg.key} in {leg.section.at(leg.key)} cannot be executed: {error}") from error
        at_mm = to_mm
