"""A sequence of steps as a table."""

from collections.abc import Sequence

from fingervision.domain.step_data import CycleTime, Operation
from fingervision.testbed.motion.step_checks import PlannedMotion

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
