"""Scale: size of the fingers in the picture, and uncertainty of the conversion to millimetres."""

from dataclasses import replace

import numpy as np

from calib.measured_scale import Calibration
from fingervision.domain.status import Status
from fingervision.inspection.finding import Finding, refusing, weighed, without
from fingervision.inspection.sample import FILLED, Sample
from fingervision.measuring.gap_budget import bias_shares

CLOSER = (
    "Bring the camera nearer, or use a lens of longer focal length, until fingers and gap fill most of the picture."
)
FORMULA = (
    "sqrt(p^2 + s^2); p = sqrt(u^2 - u'^2), u the random uncertainty, u' the random uncertainty at the scale at which "
    "fingers and gap fill 60 % of the picture (proportional to the power -3/2 of the scale: smaller pixels, and more "
    "rows); s is the calibration's contribution"
)


def find(sample: Sample) -> Finding | None:
    """Compare the scale with the best possible scale, and compute the uncertainty's part due to the calibration."""
    # Below a certain size in the picture, the outlines have too few pixels to determine the tip and the edge.
    refused = refusing(sample, "scale", (Status.NO_FINGERS,), CLOSER) if sample.is_lost_in_smallness else None
    if refused is not None:
        filled = f"fingers and gap fill only {100 * sample.fill:.0f} % of the picture across the fingers"
        return replace(refused, figure=f"{refused.figure.rstrip('.')}; {filled}.")
    if not sample.looks:
        return None
    ratio = min(1.0, sample.fill / FILLED)
    # The uncertainty is limited to that of a picture with little noise, because noise has a finding of its own.
    u_px = sample.median(min(look.u_camera_px, look.u_with(noise=min(look.noise, 0.02))) for look in sample.looks)
    fine_px = without(u_px, u_px * ratio**1.5)
    shared_px, largest = _calibration(sample)
    figure = f"Across the fingers, fingers and gap fill {100 * sample.fill:.0f} % of the picture"
    if sample.scale is None:
        figure += "; the scale is not known (give --calibration or --px-per-mm), so costs are in pixels."
    else:
        figure += f", at {sample.scale.px_per_mm:.2f} px/mm"
        figure += f"; largest contribution to the calibration's uncertainty: {largest}." if largest else "."
    remedy = (
        CLOSER
        if fine_px >= shared_px
        else f"Improve the calibration; largest contribution to its uncertainty: {largest}."
    )
    return weighed(sample, "scale", float(np.hypot(fine_px, shared_px)), figure, remedy, FORMULA)


def _calibration(sample: Sample) -> tuple[float, str]:
    """Standard uncertainty of the gap (px) that all frames share, and its largest source."""
    scale = sample.scale
    if not isinstance(scale, Calibration):
        return 0.0, ""
    m = sample.looks[len(sample.looks) // 2].outcome
    points = np.array([[[m.left.x_px, m.left.y_px], [m.right.x_px, m.right.y_px]]])
    budget = scale.budget(points, np.array([m.u_gap_px]), np.array([m.light_gap]), bias_shares([m]))
    u_mm, random_mm = float(budget.u_mm[0]), float(budget.u_random_mm[0])
    shared = [line for line in budget.lines if line.shared]
    worst = max(shared, key=lambda line: float(line.u_mm[0]), default=None)
    largest = "" if worst is None else f"{worst.source}, {1e3 * float(worst.u_mm[0]):.2f} um ({worst.supplied})"
    return without(u_mm, random_mm) * scale.px_per_mm, largest
