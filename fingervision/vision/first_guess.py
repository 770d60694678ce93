"""A first guess of a finger's end from its points: a line through each side, and the corners' radii."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.vision.finger_shape import (
    INNER_C,
    INNER_M,
    INNER_R,
    OUTER_C,
    OUTER_M,
    OUTER_R,
    PARAMETERS,
    SHARP_IN_BLURS,
    TOP_C,
    TOP_M,
)
from fingervision.vision.median import middle
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.profile_lines import INNER_SIDE, OUTER_SIDE, TIP_SIDE

Floats = NDArray[np.float64]

# A line needs so many points.
FEWEST_POINTS = 4
# Flanks that differ more in slope are not both flanks; one that is not in view is parallel to the other within this.
MOST_TAPER, TAPER_PRIOR = 0.15, 0.03
# Where only one corner is in view, its sides are square to each other within this.
SQUARE_PRIOR = 0.01
# A side's slope is not far from what its points say at first sight.
SLOPE_PRIOR = 0.3
# A flank that no point speaks of lies so far beyond the outermost column, give or take a pixel.
BEYOND_BORDER_PX = 3.0
# A fillet that is blurred into its corner has its radius from the corner alone, to so many sigma.
SHARP_PRIOR_IN_BLURS = 1.0
# A sharp corner's half-level stays away by so many sigma; points that lie so far inside both sides are on a fillet.
SHARP_CORNER, INSIDE_CORNER_PX = 0.7706, 0.5
# Distance of a fillet of radius one from its corner.
CORNER_RETREAT = 2.0**0.5 - 1.0


def first_guess(points: OutlinePoints, below_tip_px: float) -> tuple[Floats, Floats, Floats]:
    """Start of the fit of a finger's end.

    Parameters
    ----------
    points : OutlinePoints
        Sub-pixel outline.
    below_tip_px : float
        Height of measuring below the tip.

    Returns
    -------
    start, origin, u_prior : ndarray of float, shape (8,), (2,), (8,)
        As `fit_finger_end` takes them.
    """
    return _guess(points.x, points.y, points.side, points.blur[0], below_tip_px)


@compiled
def _guess(
    x: Floats, below_top: Floats, side: NDArray[np.int_], blur: float, below_tip: float
) -> tuple[Floats, Floats, Floats]:
    start, u_prior = np.zeros(PARAMETERS), np.full(PARAMETERS, 1e3)
    u_prior[INNER_M] = u_prior[TOP_M] = u_prior[OUTER_M] = SLOPE_PRIOR
    y = below_top - below_tip
    x0, top_c, top_m = _top(x, below_top, side == TIP_SIDE)
    is_inner_seen, inner_c, inner_m = _lower_flank(x, y, side == INNER_SIDE)
    is_outer_seen, outer_c, outer_m = _lower_flank(x, y, side == OUTER_SIDE)
    if not is_inner_seen:
        inner_c = x.max()
    if not is_outer_seen:  # cut off by the border: nothing speaks of the far corner
        outer_c = x.min() - BEYOND_BORDER_PX
        u_prior[OUTER_C], u_prior[OUTER_M], u_prior[OUTER_R] = 1.0, 0.05, 1.0
        # What is in view may be the inner fillet alone, which leaves the top's slope open: it is square to the flank.
        top_m, u_prior[TOP_M] = -inner_m, SQUARE_PRIOR
    elif abs(inner_m - outer_m) > MOST_TAPER:
        # Nothing of the inner flank is in view below the round corner: it runs parallel to the outer one.
        inner_c, inner_m = x.max() + 1.0, outer_m
        u_prior[INNER_M] = TAPER_PRIOR
    start[INNER_C], start[INNER_M], start[TOP_C] = inner_c, inner_m, top_c
    start[TOP_M], start[OUTER_C], start[OUTER_M] = top_m, outer_c, outer_m
    largest = 0.49 * max(inner_c - outer_c, 2.0)
    for number, sense, c, m in ((INNER_R, 1.0, inner_c, inner_m), (OUTER_R, -1.0, outer_c, outer_m)):
        radius = _radius(sense * (x - x0), sense * (c - x0), sense * m, y, below_top - top_c, sense * top_m, blur)
        start[number] = min(radius, largest)
        if radius < SHARP_IN_BLURS * blur and u_prior[number] > 1.0:
            u_prior[number] = SHARP_PRIOR_IN_BLURS * blur
    return start, np.array([x0, below_tip]), u_prior


@compiled
def line(t: Floats, v: Floats) -> tuple[float, float]:
    """Least-squares line v = c + m t; level where the points do not spread."""
    if t.size == 0:
        return 0.0, 0.0
    mean_t, mean_v = t.sum() / t.size, v.sum() / t.size
    spread, shared = 0.0, 0.0
    for i in range(t.size):
        spread += (t[i] - mean_t) ** 2
        shared += (t[i] - mean_t) * v[i]
    slope = shared / spread if spread > 1.0 else 0.0
    return mean_v - slope * mean_t, slope


@compiled
def _top(x: Floats, y: Floats, is_tip: NDArray[np.bool_]) -> tuple[float, float, float]:
    """The tip's middle, and a line through its middle part; through all points where few belong to the tip."""
    if is_tip.sum() >= FEWEST_POINTS:
        x, y = x[is_tip], y[is_tip]
    x0, half_width = 0.5 * (x.min() + x.max()), 0.5 * (x.max() - x.min())
    is_middle = np.abs(x - x0) <= 0.6 * half_width + 1.0
    c, m = line(x[is_middle] - x0, y[is_middle])
    return x0, c, m


@compiled
def _lower_flank(x: Floats, y: Floats, is_flank: NDArray[np.bool_]) -> tuple[bool, float, float]:
    """Line through the half of a flank that is farther from the tip, which dust does not turn; whether there is one.

    Slopes from a quarter of the flank to the next, point by point, and their median (Theil and Sen, with fewer pairs).
    """
    if is_flank.sum() < FEWEST_POINTS:
        return False, 0.0, 0.0
    x, y = x[is_flank], y[is_flank]
    is_low = y >= 0.5 * (y.min() + y.max())
    x, y = x[is_low], y[is_low]
    half = y.size // 2
    if half == 0:
        return True, x[0], 0.0
    slope = middle((x[-half:] - x[:half]) / (y[-half:] - y[:half]))
    return True, middle(x - slope * y), slope


@compiled
def _radius(
    x: Floats, flank_c: float, flank_m: float, y: Floats, below_top: Floats, top_m: float, blur: float
) -> float:
    """Fillet radius from the points with positive `x` that lie inside both sides of a corner.

    A fillet of radius r in a right angle passes through every point whose distances a and b from the two sides
    satisfy (r - a)^2 + (r - b)^2 = r^2; the median over the points does not mind dust. Blur moves the half-level
    further in: on the bisector by sigma^2 / 2r on a large fillet, by 0.77 sigma in a sharp corner (where the product of
    two error functions is one half); in between, the two are joined smoothly.
    """
    through = np.empty(x.size)
    count = 0
    for i in range(x.size):
        a, b = flank_c + flank_m * y[i] - x[i], below_top[i] - top_m * x[i]
        if x[i] > 0.0 and min(a, b) > INSIDE_CORNER_PX:
            through[count] = a + b + np.sqrt(2.0 * a * b)
            count += 1
    if count == 0:
        return 0.0
    through = through[:count]
    # Points outside the fillet's own reach belong to the other corner.
    radius = middle(through[through < 3.0 * through.min() + 3.0])
    retreat = radius * CORNER_RETREAT
    for _step in range(10):
        shift = blur / np.sqrt((2.0 * radius / blur) ** 2 + SHARP_CORNER**-2)
        radius = 0.5 * (radius + max(retreat - shift, 0.0) / CORNER_RETREAT)
    return float(radius)
