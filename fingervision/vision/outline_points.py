"""The sub-pixel outline of one finger, in that finger's own axes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.edge_filters import PIXEL_VARIANCE
from fingervision.vision.edges import EdgePoints
from fingervision.vision.fingers import CoarseFinger, CoarseFingers
from fingervision.vision.mean_profile import SIGMAS_IN_MEDIAN
from fingervision.vision.median import middle
from fingervision.vision.profile_lines import INNER_SIDE, IS_ROW, OUTER_SIDE, PLACES, SIDE, TIP_SIDE

Floats = NDArray[np.float64]

# Slope above which rows and columns cross the same part of an outline, and factor by which the uncertainty of these
# points is increased.
SHARED_SLOPE, SHARED_FACTOR = 0.75, 1.25
# Least contrast of a line as a share of the typical contrast; a line with less contrast crosses the border of the
# picture instead of a finger's edge.
LEAST_CONTRAST = 0.3
# Lines beside a corner: INSIDE the edge (distances in sigma) they are less than SHALLOW away from another side. The
# finger's light on them is compared with that on the lines between NEAR and FAR_FROM_END of the end of the side, of
# which there must be FEWEST; a difference of CERTAINLY standard deviations is as likely a shortfall as chance.
INSIDE, SHALLOW, NEAR, FAR_FROM_END, FEWEST, CERTAINLY = 4.0, 3.0, 6.0, 20.0, 4, 5.0
# Distance from the half-level, in sigma, at which a step is found if the finger's light falls short by a share s of the
# full contrast: BESIDE s / sqrt(1 - s), within U_BESIDE of itself. It fits rendered fillets, square corners and
# chamfers at blurs of 0.8 to 2.2 px, turned by 0 to 18 degrees.
BESIDE, U_BESIDE, MOST_SHORT = 1.19, 0.15, 0.7
# Share of the contrast, and number of standard deviations, by which a finger's least light falls short of its usual
# light where corners are looked for.
LEAST_SHORT, LEAST_IN_SIGMAS = 0.03, 4.0

_seen_from = loop("outline_points_seen_from")


@dataclass(frozen=True, slots=True, eq=False)
class OutlinePoints:
    """Points of one finger's half-level outline, with the inner side at larger `x`; arrays of shape (n,).

    Parameters
    ----------
    x, y : ndarray of float
        Coordinates across (positive inwards) and along the finger (positive towards the root), relative to the finger's
        own origin.
    u : ndarray of float
        Standard uncertainty along the line of pixels on which the point was found.
    side : ndarray of int
        Side of the coarse outline to which that line belongs: 0 inner flank, 1 tip, 2 outer flank.
    blur : ndarray of float
        Gaussian sigma of the optics at the point, the pixel's width included.
    """

    x: Floats
    y: Floats
    u: Floats
    side: NDArray[np.int_]
    blur: Floats

    @property
    def is_row(self) -> NDArray[np.bool_]:
        """Whether the point was found on a row across the flank (otherwise on a column across the tip)."""
        return np.asarray(self.side != TIP_SIDE)


def finger_origin(finger: CoarseFinger) -> tuple[int, int]:
    """Origin of a finger's own axes, (across, along) in the picture."""
    return int(finger.outline[0, 0]), finger.top_along_px


def outline_points(fingers: CoarseFingers, edges: EdgePoints) -> tuple[OutlinePoints, OutlinePoints]:
    """Points of the left and of the right finger, each in that finger's own axes."""
    lines = edges.lines
    least = LEAST_CONTRAST * middle(np.abs(edges.contrast[lines.weight > 0]))
    shift, u_shift = _beside_corners(edges, least)
    position, u_position = edges.position - lines.outward * shift, np.hypot(edges.u_position, u_shift)
    seen = (SIDE, lines.weight, edges.contrast, lines.fixed, position, u_position, lines.slope)
    found = []
    for k, finger in enumerate((fingers.left, fingers.right)):
        x, y, u, blur = np.empty((4, PLACES))
        side = np.empty(PLACES, dtype=np.int64)
        axes = (finger.inner_sign, *finger_origin(finger))
        n = _seen_from(*seen, edges.curvature_gain, edges.blur_px, k, least, *axes, x, y, u, blur, side)
        found.append(OutlinePoints(x[:n], y[:n], u[:n], side[:n], blur[:n]))
    return found[0], found[1]


def _beside_corners(edges: EdgePoints, least: float) -> tuple[Floats, Floats]:
    """How far outside the half-level the steps beside corners were found, along their lines, and its uncertainty (px).

    A line of pixels that crosses one side beside a corner runs along the other side. What it sees inside is not the
    full brightness of the finger, so that the middle of a step fitted to it is not the half-level.
    """
    lines, shift, u_shift = edges.lines, np.zeros((2, SIDE.size)), np.zeros((2, SIDE.size))
    contrast = np.abs(edges.contrast)
    # The light of the finger itself: a corner does not change the ground, which shadows do.
    own_light = contrast - np.sign(edges.contrast) * edges.ground
    for k, blur_px in enumerate(edges.blur_px.tolist()):
        kept = (lines.weight[k] > 0) & (contrast[k] > least)
        rows = kept & IS_ROW
        full = float(middle(contrast[k][rows]))
        usual = level, u_level = _usual(own_light[k][rows])
        if own_light[k][kept].min(initial=level) > level - max(LEAST_SHORT * full, LEAST_IN_SIGMAS * u_level):
            continue
        depth = _depth(edges, k, kept)
        for side in (INNER_SIDE, TIP_SIDE, OUTER_SIDE):
            own = np.flatnonzero(kept & (side == SIDE))
            if not own.size:
                continue
            at, variance = lines.fixed[k][own], blur_px[int(side == TIP_SIDE)] ** 2 + PIXEL_VARIANCE
            from_end = at - at.min() if side != TIP_SIDE else np.minimum(at - at.min(), at.max() - at)
            away = from_end / np.sqrt(variance)
            there = own[(away > NEAR) & (away < FAR_FROM_END)]
            level, u_level = _usual(own_light[k][there]) if there.size >= FEWEST else usual
            lost, whole = level - own_light[k][own], contrast[k][own]
            short = np.clip(lost / np.maximum(lost + whole, 1e-9), 0.0, MOST_SHORT)
            chance = np.exp(np.minimum(0.5 * (CERTAINLY**2 - (lost / max(u_level, 1e-9)) ** 2), 50.0))
            likely = np.clip(SHALLOW - depth[own], 0.0, 1.0) / (1.0 + chance)
            stretch = BESIDE * np.sqrt(variance * (1.0 + lines.slope[k][own] ** 2))
            away_px = stretch * short / np.sqrt(1.0 - short)
            shift[k][own] = likely * away_px
            doubt = (U_BESIDE**2 * likely + likely * (1.0 - likely)) * away_px**2
            u_shift[k][own] = np.sqrt(doubt + likely * (stretch * u_level / np.maximum(lost + whole, 1e-9)) ** 2)
    return shift, u_shift


def _depth(edges: EdgePoints, k: int, kept: NDArray[np.bool_]) -> Floats:
    """Distance of every line, inside a finger's edge, from the other side that it runs along (sigma)."""
    lines, (across_px, along_px) = edges.lines, edges.blur_px[k]
    fixed, place = lines.fixed[k].astype(np.float64), edges.position[k]
    sigma = np.sqrt(np.where(IS_ROW, across_px, along_px) ** 2 + PIXEL_VARIANCE)
    inside = place - INSIDE * sigma * lines.outward[k]
    depth = np.full(SIDE.size, np.inf)
    for side, others in ((INNER_SIDE, [TIP_SIDE]), (OUTER_SIDE, [TIP_SIDE]), (TIP_SIDE, [INNER_SIDE, OUTER_SIDE])):
        own = np.flatnonzero(kept & (side == SIDE))
        for other in others:
            there = np.flatnonzero(kept & (other == SIDE))
            there = there[np.argsort(fixed[there])]
            if there.size:
                beside = np.interp(inside[own], fixed[there], place[there])
                depth[own] = np.minimum(depth[own], np.abs(fixed[own] - beside) / sigma[own])
    return depth


def _usual(light: Floats) -> tuple[float, float]:
    """Median of the light on several lines, and the standard deviation of one of them."""
    level = middle(light)
    return level, SIGMAS_IN_MEDIAN * middle(np.abs(light - level))
