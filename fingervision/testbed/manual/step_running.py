"""Sequences of step data: their limits, their table, and their execution on a test bed."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from fingervision.domain.errors import DataError
from fingervision.domain.step_data import CycleTime, Operation, StepData
from fingervision.storage.steps_toml import read_steps
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
        say(f"homed: {manual_control.home(bed):.3f} mm")
        for motion in motions:
            at_mm = _run(bed, motion)
            say(f"step {motion.number}: {motion.from_mm:.3f} to {motion.to_mm:.3f} mm, at rest at {at_mm:.3f} mm")
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
        str(planned.number), f"{planned.from_mm:.3f}", f"{planned.to_mm:.3f}",
        f"{planned.to_mm - planned.from_mm:+.3f}", pushing, f"{step.load_kg:g}",
        "cycle time" if isinstance(step.entry, CycleTime) else "speed", f"{motion.seconds:.4f}",
        f"{motion.speed_mm_s:.1f}", f"{motion.acceleration_mm_s2:.0f}", f"{motion.deceleration_mm_s2:.0f}",
        f"{planned.force_n:.2f}",
    )  # fmt: skip
