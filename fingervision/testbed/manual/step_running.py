"""Sequences of step data: their limits, their table and plot, and their execution on a test bed."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingervision.domain.errors import DataError, OutputError
from fingervision.domain.step_data import CycleTime, Operation, StepData
from fingervision.storage.durable import replaced
from fingervision.storage.recipe_toml import read_steps
from fingervision.testbed.actuator import StageLimits
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import SIMULATED, open_bed, read_configuration
from fingervision.testbed.manual import manual_control
from fingervision.testbed.motion.move_limits import PUBLISHED, stage_limits
from fingervision.testbed.motion.step_checks import PlannedMotion, planned_sequence


def step_limits(bed_name: str) -> StageLimits:
    """Limits of a test bed's stage, without opening it; if its file states no limits, the published values."""
    if bed_name == SIMULATED:
        return PUBLISHED
    return stage_limits(read_configuration(bed_name).table("actuator"), PUBLISHED)


def run_sequence(data: StepData, bed_name: str, say: Callable[[str], Any]) -> None:
    """Move to the reference, then run a sequence of step data, after the whole sequence was checked against the limits.

    If the actuator stores no step data, it moves to the target of each step at the step's peak speed.

    Raises
    ------
    FingervisionError
        The test bed cannot execute the sequence, or its motor controller stores different steps.
    """
    if bed_name != SIMULATED:
        _check_kept(data, bed_name)
    bed = open_bed(bed_name)
    try:
        motions = planned_sequence(data, _within(bed), from_mm=0.0)
        say(f"homed: {manual_control.home(bed):z.3f} mm")
        for motion in motions:
            at_mm = _run(bed, motion)
            say(f"step {motion.number}: {motion.from_mm:z.3f} to {motion.to_mm:z.3f} mm, at rest at {at_mm:z.3f} mm")
    finally:
        bed.close()


def _run(bed: Bed, motion: PlannedMotion) -> float:
    if bed.actuator.has_steps:
        return manual_control.run_step(bed, motion.number)
    if motion.motion.speed_mm_s == 0.0:
        return bed.actuator.readings()[-1].value
    return manual_control.move(bed, motion.to_mm, motion.motion.speed_mm_s)


def _within(bed: Bed) -> StageLimits:
    limits = bed.limits
    return replace(
        bed.actuator.limits,
        lower_mm=limits.lower_mm,
        upper_mm=limits.upper_mm,
        speed_mm_s=limits.speed_mm_s,
        force_n=limits.force_n,
    )


def _check_kept(data: StepData, bed_name: str) -> None:
    """Refuse to run steps by number if other steps are stored in the motor controller under these numbers."""
    top = read_configuration(bed_name)
    section = top.table("actuator")
    if "steps" not in section.values:
        return
    path = top.path.parent / section.word("steps")
    kept = read_steps(path)
    for number, step in data.steps.items():
        if kept.steps.get(number) != step:
            raise DataError(
                f"Step {number} must be the same as in the motor controller, but {path} states another: store these "
                "steps in the controller with its maker's tool, and name them in the test bed's configuration."
            )


HEADER = (
    "step", "from mm", "to mm", "way mm", "operation", "load kg", "entry", "time s", "peak mm/s", "speeding mm/s2",
    "slowing mm/s2", "force N",
)  # fmt: skip


def steps_table(motions: Sequence[PlannedMotion]) -> str:
    """Format one line per motion, with columns aligned to the right."""
    rows = [HEADER, *(_row(motion) for motion in motions)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(HEADER))]
    return "\n".join(
        "  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )


def _row(planned: PlannedMotion) -> tuple[str, ...]:
    step, motion = planned.step, planned.motion
    pushing = f"pushing {step.pushing_force_n:g} N" if step.operation is Operation.PUSHING else "moving"
    return (
        str(planned.number), f"{planned.from_mm:z.3f}", f"{planned.to_mm:z.3f}",
        f"{planned.to_mm - planned.from_mm:+.3f}", pushing, f"{step.load_kg:g}",
        "cycle time" if isinstance(step.entry, CycleTime) else "speed", f"{motion.seconds:.4f}",
        f"{motion.speed_mm_s:.1f}", f"{motion.acceleration_mm_s2:.0f}", f"{motion.deceleration_mm_s2:.0f}",
        f"{planned.force_n:.2f}",
    )  # fmt: skip


# Plot of a sequence of steps: position and speed over time.

SIZE_INCHES, DOTS_PER_INCH = (9.0, 6.0), 130
LINE_COLOUR, LIMIT_COLOUR, PUSHING_COLOUR = "#11507a", "#c0392b", "#e8c170"
POINTS_PER_MOTION = 200
# Pause that is drawn between two motions, as a share of the whole time, so that each motion can be seen.
STANDING_SHARE = 0.02
TITLE_PAD_POINTS = 30.0


def draw_steps(path: Path, name: str, motions: Sequence[PlannedMotion], limits: StageLimits) -> None:
    """Plot position and speed of a sequence over time, with motions numbered and pushing motions shaded.

    Raises
    ------
    OutputError
        The picture cannot be written.
    """
    figure = Figure(figsize=SIZE_INCHES, layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True)
    standing_s = STANDING_SHARE * max(sum(each.motion.seconds for each in motions), 1e-3)
    begin_s = 0.0
    for planned in motions:
        begin_s = _draw_motion(upper, lower, planned, begin_s, standing_s)
    upper.set_title(name, pad=TITLE_PAD_POINTS)
    upper.set_ylabel("position (mm)")
    lower.set_ylabel("speed (mm/s)")
    lower.set_xlabel("time (s), with a short pause after each motion; shaded: pushing; dashed: limits of the stage")
    for level_mm in (limits.lower_mm, limits.upper_mm):
        upper.axhline(level_mm, color=LIMIT_COLOUR, linewidth=0.8, linestyle="--")
    fastest_mm_s = max((each.motion.speed_mm_s for each in motions), default=0.0)
    if fastest_mm_s > 0.5 * limits.speed_mm_s:
        for level_mm_s in (-limits.speed_mm_s, limits.speed_mm_s):
            lower.axhline(level_mm_s, color=LIMIT_COLOUR, linewidth=0.8, linestyle="--")
    for axes in (upper, lower):
        axes.grid(visible=True, alpha=0.3)
    try:
        with replaced(path) as part:
            figure.savefig(part, dpi=DOTS_PER_INCH, format="png")
    except OSError as error:
        raise OutputError(f"The plot {path} could not be written ({error.strerror}).") from error


def _draw_motion(upper: Axes, lower: Axes, planned: PlannedMotion, begin_s: float, standing_s: float) -> float:
    """Plot one motion and the pause after it; return the time of its end (s)."""
    motion = planned.motion
    end_s = begin_s + motion.seconds
    since_s = np.append(np.linspace(0.0, motion.seconds, POINTS_PER_MOTION), motion.seconds + standing_s)
    upper.plot(begin_s + since_s, planned.from_mm + motion.travelled_mm(since_s), color=LINE_COLOUR)
    lower.plot(begin_s + since_s, motion.speeds_mm_s(since_s), color=LINE_COLOUR)
    if planned.step.operation is Operation.PUSHING:
        upper.axvspan(begin_s, end_s, color=PUSHING_COLOUR, alpha=0.5, linewidth=0)
        lower.axvspan(begin_s, end_s, color=PUSHING_COLOUR, alpha=0.5, linewidth=0)
    words = (
        f"{planned.number}\n{planned.step.pushing_force_n:g} N" if planned.step.pushing_force_n else str(planned.number)
    )
    upper.annotate(
        words, (0.5 * (begin_s + end_s), 1.0), (0, 3), xycoords=("data", "axes fraction"),
        textcoords="offset points", ha="center", va="bottom", fontsize="small",
    )  # fmt: skip
    return end_s + standing_s
