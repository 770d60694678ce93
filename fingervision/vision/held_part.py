"""What a held part leaves of the lines along which edges are looked for, and how wide it is."""

import numpy as np

from fingervision.domain.compiled import compiled
from fingervision.domain.gap import HeldPart
from fingervision.vision.finger_end import FingerEnd
from fingervision.vision.finger_shape import PARAMETERS, inner_edge
from fingervision.vision.fingers import CoarseFinger, CoarseFingers
from fingervision.vision.outline_points import finger_origin
from fingervision.vision.profile_lines import INNER, ROWS, Floats, ProfileLines

# A part that stands beside a tip spoils the columns within so many pixels of the inner edge.
BESIDE_TIP_PX = 5
# Derivatives are taken over so much of each parameter to either side; a width that is less sure is not given (pixels).
STEP, LEAST_SURE_PX = 1e-3, 2.0


def visible_lines(lines: ProfileLines, fingers: CoarseFingers) -> ProfileLines:
    """The lines on which a finger's own edge is seen; those of each side move together."""
    pair = (fingers.left, fingers.right)
    if not any(finger.hidden.size for finger in pair):
        return lines
    fixed, coarse, slope, weight, outward = (
        a.copy() for a in (lines.fixed, lines.coarse, lines.slope, lines.weight, lines.outward)
    )
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
            for values in (fixed, coarse, slope):
                moved = values[k, kept]
                values[k, first:past] = 0
                values[k, first : first + kept.size] = moved
            weight[k, first:past] = 0.0
            weight[k, first : first + kept.size] = 1.0
    return ProfileLines(fixed, coarse, slope, weight, outward)


def _inner_across(finger: CoarseFinger) -> int:
    """The innermost pixel of the finger's top."""
    near = finger.outline[finger.outline[:, 1] <= finger.top_along_px + 2 * BESIDE_TIP_PX, 0]
    return int(near.max() if finger.inner_sign > 0 else near.min())


def is_hidden(finger: CoarseFinger, along: float) -> bool:
    """Whether a part hides a finger's inner edge at a place along the fingers."""
    return bool(np.isin(round(along), finger.hidden))


def held_part(
    fingers: CoarseFingers, ends: tuple[FingerEnd, FingerEnd], spread: tuple[float, float]
) -> HeldPart | None:
    """Width of a held part: how far the two inner flanks are apart where they hold it.

    Parameters
    ----------
    fingers : CoarseFingers
        To a pixel, with where the part is held.
    ends : (FingerEnd, FingerEnd)
        The shapes of both.
    spread : (float, float)
        Variance of each finger's residuals, shared ones counted once, in units of their stated one.

    Returns
    -------
    HeldPart or None
        None where nothing is held, or its width is not known.
    """
    if fingers.held_along_px is None:
        return None
    across, variance = [], 0.0
    for finger, end, factor in zip((fingers.left, fingers.right), ends, spread, strict=True):
        across0, along0 = finger_origin(finger)
        edge, edge_variance = _edge(end.parameters, end.covariance, end.origin, fingers.held_along_px - along0)
        across.append(across0 + finger.inner_sign * edge)
        variance += edge_variance * factor
    width = across[1] - across[0]
    if width <= 0.0 or not variance < LEAST_SURE_PX**2:
        return None
    return HeldPart(float(width), float(np.sqrt(variance)))


@compiled
def _edge(p: Floats, covariance: Floats, origin: Floats, height: float) -> tuple[float, float]:
    """Inner edge at a height, and its variance."""
    edge, _ = inner_edge(p, origin, height)
    gradient = np.empty(PARAMETERS)
    for a in range(PARAMETERS):
        more, less = p.copy(), p.copy()
        more[a] += STEP
        less[a] -= STEP
        gradient[a] = (inner_edge(more, origin, height)[0] - inner_edge(less, origin, height)[0]) / (2.0 * STEP)
    variance = 0.0
    for a in range(PARAMETERS):
        for b in range(PARAMETERS):
            variance += gradient[a] * covariance[a, b] * gradient[b]
    return edge, variance
