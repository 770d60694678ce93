"""Rows in which the fingers' edges are visible beside a held part, and the width of the part."""

import numpy as np

from fingervision.domain.gap import HeldPart
from fingervision.vision.finger_end import FingerEnd
from fingervision.vision.finger_shape import INNER_C, INNER_M
from fingervision.vision.fingers import CoarseFinger, CoarseFingers
from fingervision.vision.outline_points import finger_origin
from fingervision.vision.profile_lines import INNER, ROWS, ProfileLines

# Distance from the inner edge (pixels) within which a part beside a tip affects columns.
BESIDE_TIP_PX = 5
# Largest standard uncertainty of a stated width (pixels).
LEAST_SURE_PX = 2.0
# Standard uncertainty of the part's position along the fingers (pixels).
U_ALONG_PX = 1.0


def visible_lines(lines: ProfileLines, fingers: CoarseFingers) -> ProfileLines:
    """Lines of pixels on which a finger's own edge is visible; lines hidden by a held part are removed."""
    pair = (fingers.left, fingers.right)
    if not any(finger.hidden.size for finger in pair):
        return lines
    fixed, coarse, slope, weight = lines.fixed.copy(), lines.coarse.copy(), lines.slope.copy(), lines.weight.copy()
    for k, finger in enumerate(pair):
        if not finger.hidden.size:
            continue
        keep = weight[k] > 0
        keep[:INNER] &= ~np.isin(fixed[k, :INNER], finger.hidden)
        if np.any(np.abs(finger.hidden - finger.top_along_px) <= BESIDE_TIP_PX):
            at = _inner_across(finger)
            keep[ROWS:] &= finger.inner_sign * (at - fixed[k, ROWS:]) > BESIDE_TIP_PX
        for first, past in ((0, INNER), (ROWS, lines.fixed.shape[1])):
            kept = first + np.flatnonzero(keep[first:past])
            places = slice(first, first + kept.size)
            fixed[k, places], coarse[k, places], slope[k, places] = fixed[k, kept], coarse[k, kept], slope[k, kept]
            weight[k, first:past] = 0.0
            weight[k, places] = 1.0
    return ProfileLines(fixed, coarse, slope, weight, lines.outward)


def _inner_across(finger: CoarseFinger) -> int:
    """Coordinate across the picture of the innermost pixel of a finger's tip."""
    near = finger.outline[finger.outline[:, 1] <= finger.top_along_px + 2 * BESIDE_TIP_PX, 0]
    return int(near.max() if finger.inner_sign > 0 else near.min())


def held_part(
    fingers: CoarseFingers, ends: tuple[FingerEnd, FingerEnd], spread: tuple[float, float], light_gap: bool
) -> HeldPart | None:
    """Width of a held part: distance between the two inner flanks where they touch the part.

    Parameters
    ----------
    fingers : CoarseFingers
        The fingers to the nearest pixel, with the position of the held part.
    ends : (FingerEnd, FingerEnd)
        Fitted end shapes of the left and of the right finger.
    spread : (float, float)
        Ratio of the residuals' variance to the stated variance for each finger, multiplied by the number of
        neighbouring points that share an error.
    light_gap : bool
        Whether the fingers are darker than the gap.

    Returns
    -------
    HeldPart or None
        None if nothing is held, or the width is too uncertain.
    """
    if fingers.held_along_px is None:
        return None
    across, variance, opening = [], 0.0, 0.0
    for finger, end, factor in zip((fingers.left, fingers.right), ends, spread, strict=True):
        across0, along0 = finger_origin(finger)
        edge, edge_variance = _flank(end, fingers.held_along_px - along0)
        across.append(across0 + finger.inner_sign * edge)
        variance += edge_variance * factor
        opening += float(end.parameters[INNER_M])
    # The position along the fingers at which the part is held has an uncertainty of one pixel.
    variance += U_ALONG_PX**2 * opening**2
    width = across[1] - across[0]
    if width <= 0.0 or not variance < LEAST_SURE_PX**2:
        return None
    left, right = (fingers.orientation.to_pixels(float(at), fingers.held_along_px) for at in across)
    return HeldPart(*left, *right, float(np.sqrt(variance)), light_gap)


def _flank(end: FingerEnd, height: float) -> tuple[float, float]:
    """Position of the straight inner flank at a height, and its variance; extrapolated if a fillet begins below."""
    arm = height - float(end.origin[1])
    edge = end.parameters[INNER_C] + end.parameters[INNER_M] * arm
    c = end.covariance
    return float(edge), float(c[INNER_C, INNER_C] + 2.0 * arm * c[INNER_C, INNER_M] + arm**2 * c[INNER_M, INNER_M])
