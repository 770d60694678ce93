"""Motion: fingers that move during the exposure."""

import numpy as np

from fingervision.domain.status import Status
from fingervision.inspection.finding import MOSTLY_REFUSED, Finding, refusing, weighed, without
from fingervision.inspection.look import Look
from fingervision.inspection.noise_bound import GOOD_BLUR_PX
from fingervision.inspection.sample import Sample
from fingervision.vision.frame_profiles import MOTION_RADIUS_PX

REMEDY = "Shorten the exposure (with more light, or a flash), or move more slowly while frames are taken."
FORMULA = (
    "sqrt(c^2 + n^2); c = sum over both fingers of (sigma_flank^2 - sigma_tip^2) / (2 R sqrt(3)), the possible shift "
    "of an edge on a corner of radius R = 15 px; n = sqrt(u^2 - u'^2), u the random uncertainty, u' the random "
    "uncertainty without motion"
)


def find(sample: Sample) -> Finding | None:
    """Compare the blur of the flanks with that of the tips: motion across the fingers blurs only the flanks."""
    refused = refusing(sample, "motion", (Status.BLURRED,), REMEDY) if sample.is_smeared else None
    if not sample.looks or (refused is not None and refused.share_refused > MOSTLY_REFUSED):
        return refused
    way_px = sample.median(float(np.sqrt(12.0 * look.widened_px2.max())) for look in sample.looks)
    cost_px = sample.median(_cost_px(look) for look in sample.looks)
    gap_px = sample.track[:, 2] - sample.track[:, 1]
    consecutive = np.diff(sample.track[:, 0]) == 1.0
    speed = np.abs(np.diff(gap_px))[consecutive] if len(gap_px) > 1 else np.zeros(0)
    fastest = float(np.quantile(speed, 0.95)) if speed.size else 0.0
    between = f"; the gap changes by up to {fastest:.2f} px from frame to frame" if speed.size else ""
    figure = f"The fingers move by {way_px:.1f} px while the shutter is open{between}."
    return weighed(sample, "motion", cost_px, figure, REMEDY, FORMULA)


def _cost_px(look: Look) -> float:
    more = look.widened_px2
    if not more.any():
        return 0.0
    # Motion across the fingers is corrected where the blur of the tip reveals it; the remaining uncertainty is this
    # part of u_shift_px.
    stated = float(more.sum()) / (2.0 * MOTION_RADIUS_PX * np.sqrt(3.0))
    in_focus = look.u_with(blur_px=min(look.focus_blur_px, GOOD_BLUR_PX))
    return float(np.hypot(stated, without(look.u_camera_px, in_focus)))
