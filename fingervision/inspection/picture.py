"""Picture of an inspection: a measured frame, and a bar chart of the cost of each limit."""

from pathlib import Path

import cv2
import numpy as np
from matplotlib.figure import Figure

from fingervision.domain.errors import OutputError
from fingervision.domain.frame import Frame
from fingervision.inspection.catalogue import to_mend
from fingervision.inspection.finding import Finding, Severity
from fingervision.inspection.report import NOTHING
from fingervision.inspection.sample import Sample
from fingervision.vision.grey import to_grey
from fingervision.vision.overlay import draw_overlay, in_eight_bits

COLOURS = {Severity.GOOD: "#3a9d5d", Severity.FAIR: "#e0a100", Severity.POOR: "#c8372d"}
# Cost (pixels) at which a finding without a cost is drawn if no finding has one; else it is drawn as long as the
# longest bar.
NO_NUMBER_PX = 1.0


def draw_inspection(path: Path, sample: Sample, findings: list[Finding]) -> None:
    """Draw a measured frame, and next to it a bar for every finding.

    Parameters
    ----------
    path : Path
        Path of the picture.
    sample : Sample
        The inspected frames.
    findings : list of Finding
        Findings, the most severe first.

    Raises
    ------
    OutputError
        If the picture cannot be written.
    """
    figure = Figure(figsize=(12.0, 5.2), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.1, 1.0))
    canvas = _canvas(sample)
    if canvas is not None:
        left.imshow(canvas)
    left.set_axis_off()
    mend = to_mend(findings)
    left.set_title(f"Correct first: {mend[0].name}" if mend else NOTHING.split(":")[0], loc="left")
    in_um = sample.scale is not None
    costs = [(each.cost_um if in_um else each.cost_px) for each in findings]
    longest = max([cost for cost in costs if cost is not None] or [0.0]) or NO_NUMBER_PX
    places = np.arange(len(findings))[::-1]
    right.barh(
        places,
        [longest if cost is None else cost for cost in costs],
        color=[COLOURS[each.severity] for each in findings],
    )
    for place, cost, each in zip(places, costs, findings, strict=True):
        words = "no number" if cost is None else f"{cost:.2f}" if in_um else f"{cost:.3f}"
        right.text(
            (longest if cost is None else cost) + 0.01 * longest, place, f"{words}  {each.severity}", va="center"
        )
    right.set_yticks(places, [each.name for each in findings])
    right.set_xlim(0.0, 1.35 * longest)
    right.set_xlabel("cost: standard uncertainty or error of the gap, " + ("µm" if in_um else "px"))
    right.spines[["top", "right"]].set_visible(False)
    try:
        figure.savefig(path, dpi=110)
    except OSError as error:
        raise OutputError(f"The picture {path} could not be written ({error.strerror}).") from error


def _canvas(sample: Sample) -> np.ndarray | None:
    if sample.looks:
        look = sample.looks[len(sample.looks) // 2]
        plain = Frame(in_eight_bits(to_grey(look.frame.pixels)), look.frame.index)
        return draw_overlay(plain, look.outcome, f"gap {look.outcome.gap_px:.2f} px")
    if sample.refused_frame is None:
        return None
    grey = in_eight_bits(to_grey(sample.refused_frame.pixels))
    return np.asarray(cv2.cvtColor(grey, cv2.COLOR_GRAY2RGB))
