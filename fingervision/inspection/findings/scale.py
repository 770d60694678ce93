"""Scale: size of the fingers in the picture, and uncertainty of the conversion to millimetres."""

import numpy as np

from calib.measured_scale import Calibration
from fingervision.inspection.finding import Finding, weighed, without
from fingervision.inspection.sample import FILLED, Sample

CLOSER = "Bring the camera nearer or use a longer lens, until fingers and gap take most of the picture."
FORMULA = (
    "sqrt(p^2 + s^2); p = sqrt(u^2 - u'^2), u' what the stated u_gap_px becomes at the scale at which fingers and gap "
    "fill 60 % of the picture (as the power -3/2 of the scale: finer pixels, and more rows); s the calibration's share"
)


def find(sample: Sample) -> Finding | None:
    """Compare the scale with the best possible one, and compute the part of the uncertainty due to the calibration."""
    if not sample.looks:
        return None
    ratio = min(1.0, sample.fill / FILLED)
    # Against the edges of a good picture: what else is wrong with this one is said by its own finding.
    u_px = sample.median(min(look.u_camera_px, look.u_with(noise=min(look.noise, 0.02))) for look in sample.looks)
    fine_px = without(u_px, u_px * ratio**1.5)
    shared_px, largest = _calibration(sample)
    figure = f"Fingers and gap take {100 * sample.fill:.0f} % of the picture across them"
    if sample.scale is None:
        figure += "; the scale is not known (give --calibration or --px-per-mm), so costs are in pixels."
    else:
        figure += f", at {sample.scale.px_per_mm:.2f} px/mm"
        figure += f"; largest in the calibration's budget: {largest}." if largest else "."
    remedy = CLOSER if fine_px >= shared_px else f"Better the calibration; largest in its budget: {largest}."
    return weighed(sample, "scale", float(np.hypot(fine_px, shared_px)), figure, remedy, FORMULA)


def _calibration(sample: Sample) -> tuple[float, str]:
    """Standard uncertainty of the gap (px) that all frames share, and its largest source."""
    scale = sample.scale
    if not isinstance(scale, Calibration):
        return 0.0, ""
    m = sample.looks[len(sample.looks) // 2].outcome
    points = np.array([[[m.left.x_px, m.left.y_px], [m.right.x_px, m.right.y_px]]])
    budget = scale.budget(points, np.array([m.u_gap_px]), np.array([m.light_gap]))
    u_mm, random_mm = float(budget.u_mm[0]), float(budget.u_random_mm[0])
    shared = [line for line in budget.lines if line.shared]
    worst = max(shared, key=lambda line: float(line.u_mm[0]), default=None)
    largest = "" if worst is None else f"{worst.source}, {1e3 * float(worst.u_mm[0]):.2f} um ({worst.supplied})"
    return without(u_mm, random_mm) * scale.px_per_mm, largest
