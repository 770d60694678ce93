"""Measure rough flanks over a longer stretch, so that long-wavelength roughness averages out.

A finger's flank is straight near its tip; farther down it may bend or end. The longer flank is therefore used only if
its result agrees with that of the part near the tip and has a smaller uncertainty (Hausman test, Econometrica 46, 1978,
1251: the variance of the difference between an efficient and a less efficient estimate is the difference of their
variances).
"""

from dataclasses import replace
from math import isnan, sqrt

import numpy as np

from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.vision.fingers import CoarseFinger, CoarseFingers
from fingervision.vision.flanks import follow_down

# Length of the longer flank: the measuring height plus this number of pixels below the tip.
LONG_PX = 180.0
# Largest difference of two results that agree, in standard uncertainties of the difference.
AGREES = 2.5


def with_longer_flanks(fingers: CoarseFingers, below_tip_px: float) -> CoarseFingers:
    """Return the fingers with their outlines extended towards the roots; a finger that holds a part is not changed."""
    left, right = (
        finger if finger.hidden.size else _longer(finger, below_tip_px + LONG_PX)
        for finger in (fingers.left, fingers.right)
    )
    return replace(fingers, left=left, right=right)


def is_surer(longer: GapMeasurement | NoGap, near: GapMeasurement) -> bool:
    """Whether the result from longer flanks agrees with that from the near part and has a smaller uncertainty.

    If the near part is too short to determine its roughness, its uncertainty does not include roughness; it is then
    replaced by longer flanks whose roughness is determined.
    """
    if isinstance(longer, GapMeasurement) and isnan(near.roughness_px):
        return longer.roughness_px > 0.0
    if not isinstance(longer, GapMeasurement) or longer.u_gap_px >= near.u_gap_px:
        return False
    return abs(longer.gap_px - near.gap_px) <= AGREES * sqrt(near.u_gap_px**2 - longer.u_gap_px**2)


def _longer(finger: CoarseFinger, reach_px: float) -> CoarseFinger:
    top = finger.top
    start, stop = (follow_down(top.outline, top.index, step, top.along_px + reach_px) for step in (-1, 1))
    piece = top.outline[start : stop + 1]
    if finger.inner_sign * (piece[0, 0] - piece[-1, 0]) < 0:
        piece = piece[::-1]
    return CoarseFinger(np.ascontiguousarray(piece), finger.inner_sign, top)
