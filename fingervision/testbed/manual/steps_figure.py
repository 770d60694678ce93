"""Plot of a sequence of steps: position and speed over time."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingervision.domain.errors import OutputError
from fingervision.domain.step_data import Operation
from fingervision.storage.durable import replaced
from fingervision.testbed.actuator import StageLimits
from fingervision.testbed.motion.step_checks import PlannedMotion

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
