"""Vibration: a shaking camera or stand, detected by registration of the background against the first frame."""

import numpy as np

from fingervision.inspection.finding import Finding, weighed, without
from fingervision.inspection.sample import Sample

REMEDY = "Fix camera and gripper to one plate, away from fans and motors; tighten the camera's mount and cable."
FORMULA = (
    "sqrt(s^2 - (3 u)^2); s is the standard deviation of the background's shift across or along the fingers, "
    "whichever is larger; u is the registration's standard uncertainty; vibration changes left_mm and right_mm, and "
    "blurs the gap's edges"
)
# Second differences of independent random positions have six times their variance; those of a smooth motion are zero.
SECOND_DIFFERENCE = 6.0**0.5
# Smallest number of consecutive frames from which vibration is judged.
FEWEST = 6
# A second difference of the gap above this value (pixels) shows that the fingers are driven in steps, in which their
# midline jumps too.
STEADY_PX = 1.0
# A jitter within this number of standard uncertainties of the measurement is not significant.
SIGMAS = 3.0


def find(sample: Sample) -> Finding | None:
    """Estimate the vibration from the background or, if it has no texture, from the motion that both fingers share."""
    if not sample.looks:
        return None
    ground = sample.ground
    if ground.u_px is not None and len(ground.across_px) >= FEWEST:
        spread = [float(np.std(shift)) for shift in (ground.across_px, ground.along_px)]
        worst = max(spread)
        cost_px = without(worst, SIGMAS * ground.u_px) if worst > SIGMAS * ground.u_px else 0.0
        figure = f"The background shifts by {spread[0]:.3f} px across and {spread[1]:.3f} px along the fingers (RMS)."
        return weighed(sample, "vibration", cost_px, figure, REMEDY, FORMULA)
    found = _common_jitter(sample)
    if found is None:
        return weighed(
            sample,
            "vibration",
            0.0,
            "There are too few consecutive frames to detect vibration of the camera.",
            "",
            FORMULA,
        )
    jitter, u_px = found
    cost_px = without(jitter, SIGMAS * u_px) if jitter > SIGMAS * u_px else 0.0
    figure = (
        f"The background has too little texture to be tracked; both fingers jitter together by {jitter:.3f} px (RMS)."
    )
    return weighed(sample, "vibration", cost_px, figure, REMEDY, FORMULA)


def _common_jitter(sample: Sample) -> tuple[float, float] | None:
    """Jitter that both fingers share, from second differences of their midline, and the noise of the midline."""
    track = sample.track
    if len(track) < FEWEST:
        return None
    in_a_row = (np.diff(track[:, 0])[1:] == 1.0) & (np.diff(track[:, 0])[:-1] == 1.0)
    in_a_row &= np.abs(np.diff(track[:, 2] - track[:, 1], n=2)) < STEADY_PX
    if np.count_nonzero(in_a_row) < FEWEST - 2:
        return None
    jitter, u_px = 0.0, 0.0
    for first, second, u in ((1, 2, 5), (3, 4, 6)):
        middle = 0.5 * (track[:, first] + track[:, second])
        bends = np.diff(middle, n=2)[in_a_row]
        # The median is robust: a reversal of the drive causes one large second difference, a shaking camera causes
        # many.
        own = float(1.4826 * np.median(np.abs(bends))) / SECOND_DIFFERENCE
        if own > jitter:
            jitter, u_px = own, float(np.median(track[:, u]))
    return jitter, u_px
