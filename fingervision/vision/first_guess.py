"""A first guess of a finger's end from its points: a line through each side, and the corners' radii."""

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.finger_end import (
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
    OutlinePoints,
)
from fingervision.vision.profile_lines import INNER, ROWS

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
# A fillet that is blurred into its corner has its radius from the corner alone, to so much (pixels).
SHARP_PRIOR_PX = 0.3
# A sharp corner's half-level stays away by so many sigma; points that lie so far inside both sides are on a fillet.
SHARP_CORNER, INSIDE_CORNER_PX = 0.7706, 0.5


def first_guess(points: OutlinePoints, below_tip_px: float) -> tuple[Floats, Floats, Floats]:
    """Start of the fit of each finger's end.

    Parameters
    ----------
    points : OutlinePoints
        Sub-pixel outlines of several fingers.
    below_tip_px : float
        Height of measuring below the tips.

    Returns
    -------
    start, origin, u_prior : ndarray of float, shape (fingers, 8), (fingers, 2), (fingers, 8)
        As `fit_finger_ends` takes them.
    """
    fingers = len(points.x)
    start, u_prior = np.zeros((fingers, PARAMETERS)), np.full((fingers, PARAMETERS), 1e3)
    u_prior[:, [INNER_M, TOP_M, OUTER_M]] = SLOPE_PRIOR
    origin = np.full((fingers, 2), below_tip_px)
    for k in range(fingers):
        _guess(points, k, start[k], origin[k], u_prior[k])
    return start, origin, u_prior


def _guess(points: OutlinePoints, k: int, start: Floats, origin: Floats, u_prior: Floats) -> None:
    real = points.weight[k] > 0
    x, y = points.x[k], points.y[k] - origin[1]
    tip = real[ROWS:]
    xt, yt = (x[ROWS:][tip], points.y[k, ROWS:][tip]) if tip.sum() >= FEWEST_POINTS else (x[real], points.y[k, real])
    left, right = xt.min(), xt.max()
    x0 = origin[0] = 0.5 * (left + right)
    middle = np.abs(xt - x0) <= 0.3 * (right - left) + 1.0
    top_c, top_m = line(xt[middle] - x0, yt[middle])
    inner = _lower_flank(x[:INNER][real[:INNER]], y[:INNER][real[:INNER]])
    outer = _lower_flank(x[INNER:ROWS][real[INNER:ROWS]], y[INNER:ROWS][real[INNER:ROWS]])
    inner_c, inner_m = inner or (float(x[real].max()), 0.0)
    if outer is None:  # cut off by the border: nothing speaks of the far corner
        outer_c, outer_m = float(x[real].min()) - BEYOND_BORDER_PX, 0.0
        u_prior[[OUTER_C, OUTER_M, OUTER_R]] = 1.0, 0.05, 1.0
        # What is in view may be the inner fillet alone, which leaves the top's slope open: it is square to the flank.
        top_m, u_prior[TOP_M] = -inner_m, SQUARE_PRIOR
    else:
        outer_c, outer_m = outer
        if abs(inner_m - outer_m) > MOST_TAPER:
            # Nothing of the inner flank is in view below the round corner: it runs parallel to the outer one.
            inner_c, inner_m = float(x[real].max()) + 1.0, outer_m
            u_prior[INNER_M] = TAPER_PRIOR
    start[[INNER_C, INNER_M, TOP_C, TOP_M, OUTER_C, OUTER_M]] = inner_c, inner_m, top_c, top_m, outer_c, outer_m
    inside_top = y + origin[1] - top_c - top_m * (x - x0)
    blur = float(points.blur[k, 0])
    largest = 0.49 * max(inner_c - outer_c, 2.0)
    inner_half = x > x0
    for number, half, inside in (
        (INNER_R, real & inner_half, inner_c + inner_m * y - x),
        (OUTER_R, real & ~inner_half, x - outer_c - outer_m * y),
    ):
        radius = _radius(inside[half], inside_top[half], blur)
        start[number] = min(radius, largest)
        if radius < SHARP_IN_BLURS * blur and u_prior[number] > 1.0:
            u_prior[number] = SHARP_PRIOR_PX


def line(t: Floats, v: Floats) -> tuple[float, float]:
    """Least-squares line v = c + m t; level where the points do not spread."""
    n = len(t)
    if n == 0:
        return 0.0, 0.0
    mean_t, mean_v = float(t.sum()) / n, float(v.sum()) / n
    away = t - mean_t
    spread = float(away @ away)
    slope = float(away @ v) / spread if spread > 1.0 else 0.0
    return mean_v - slope * mean_t, slope


def _lower_flank(x: Floats, y: Floats) -> tuple[float, float] | None:
    """Line through the half of a flank that is farther from the tip, which dust does not turn.

    Slopes from a quarter of the flank to the next, point by point, and their median (Theil and Sen, with fewer pairs).
    """
    if len(y) < FEWEST_POINTS:
        return None
    low = y >= 0.5 * (y.min() + y.max())
    x, y = x[low], y[low]
    half = len(y) // 2
    if half == 0:
        return float(x.mean()), 0.0
    slope = float(np.sort((x[-half:] - x[:half]) / (y[-half:] - y[:half]))[half // 2])
    return float(np.sort(x - slope * y)[len(y) // 2]), slope


def _radius(inside_flank: Floats, inside_top: Floats, blur: float) -> float:
    """Fillet radius from the points that lie inside both sides of a corner.

    A fillet of radius r in a right angle passes through every point whose distances a and b from the two sides
    satisfy (r - a)^2 + (r - b)^2 = r^2; the median over the points does not mind dust. Blur moves the half-level
    further in: on the bisector by sigma^2 / 2r on a large fillet, by 0.77 sigma in a sharp corner (where the product of
    two error functions is one half); in between, the two are joined smoothly.
    """
    on_fillet = np.minimum(inside_flank, inside_top) > INSIDE_CORNER_PX
    a, b = inside_flank[on_fillet], inside_top[on_fillet]
    if not len(a):
        return 0.0
    through = np.sort(a + b + np.sqrt(2.0 * a * b))
    # Points outside the fillet's own reach belong to the other corner.
    within = int(np.searchsorted(through, 3.0 * through[0] + 3.0))
    rough = float(through[within // 2])
    retreat = rough * CORNER_RETREAT
    radius = rough
    for _step in range(10):
        shift = blur / ((2.0 * radius / blur) ** 2 + SHARP_CORNER**-2) ** 0.5
        radius = 0.5 * (radius + max(retreat - shift, 0.0) / CORNER_RETREAT)
    return radius


# Distance of a fillet of radius one from its corner.
CORNER_RETREAT = 2.0**0.5 - 1.0
