"""Step 6 for any other shape: the outline near one point as a polynomial in the distance along its tangent.

Drops, ellipses and worn tips do not consist of three straight sides. Near the tip and near the measuring point any
smooth outline is approximated by a polynomial of low degree; the window of the fit is as long as the residuals allow
(Lepski's principle: the longest window with the same scatter as the shortest). Weights fall off smoothly towards the
window's ends (Cleveland, JASA 74, 1979), so that the result does not jump when the outline shifts by a fraction of a
pixel.
"""

from dataclasses import dataclass
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.first_guess import line
from fingervision.vision.measuring_point import MeasuringPoint
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.residuals import SHAPE_REACH_PX, is_on_outline

Floats = NDArray[np.float64]

DEGREE = 4
# Half-lengths of the window that are tried (pixels), and least half-length in units of the blur.
REACHES_PX = (18.0, 27.0, 40.0)
SHORTEST_IN_BLURS = 6.0
# Largest ratio of the residuals' spread in a longer window to that in the shortest window.
SPREAD_LIMIT = 1.5
FEWEST_POINTS = 12
# Scatter of the points about the polynomial of the shortest window, in units of their uncertainties, above which the
# outline has a corner or a step.
ROUGHEST = 6.0
# Spread (in units of the points' uncertainties) below which a residual is never an outlier.
LEAST_SPREAD = 0.7
# Largest standard uncertainty of a smooth outline (pixels), and largest slope of an inner edge (across / along).
LEAST_SURE_PX, FLATTEST = 1.0, 3.0
# Positions about the last estimate (pixels across) at which the tip is searched.
TIP_GRID = np.linspace(-6.0, 6.0, 241)

_fit = loop("local_outline_polynomial")


@dataclass(frozen=True, slots=True)
class LocalOutline:
    """Polynomial that describes the outline near one point.

    Parameters
    ----------
    x, y : float
        Point of the outline before blurring.
    u_normal : float
        Standard uncertainty along the normal.
    nx, ny : float
        Outward normal.
    """

    x: float
    y: float
    u_normal: float
    nx: float
    ny: float


def outline_near(
    points: OutlinePoints, centre: tuple[float, float], normal: tuple[float, float], blur_px: float
) -> tuple[list[float], float] | None:
    """Fit a polynomial (normal over tangential distance) to the outline near a point, corrected for blur.

    Returns
    -------
    (coefficients, u_normal) or None
        Coefficients and the standard uncertainty along the normal at the point; None if there are too few points.
    """
    best: tuple[list[float], float] | None = None
    first_spread = 0.0
    seen = (points.x, points.y, points.u, points.is_row, *centre, *normal)
    for reach in REACHES_PX:
        if reach < SHORTEST_IN_BLURS * blur_px and reach != REACHES_PX[-1]:
            continue
        found = np.empty(DEGREE + 1)
        is_found, variance, spread = _fit(*seen, reach, found)
        if not is_found:
            continue
        if best is not None and spread > SPREAD_LIMIT * first_spread:
            break
        if best is None and spread > ROUGHEST:
            return None
        first_spread = first_spread or max(spread, 0.2)
        c: list[float] = found.tolist()
        curvature = 2.0 * c[2] / (1.0 + c[1] ** 2) ** 1.5
        c[0] -= 0.5 * blur_px**2 * curvature
        best = c, sqrt(variance) * max(spread, 0.5)
    return best


def local_tip(points: OutlinePoints, x: float, y: float, blur_px: float) -> LocalOutline | None:
    """The outermost point of a smooth outline, iterated from an initial estimate."""
    for _step in range(3):
        fit = outline_near(points, (x, y), (0.0, -1.0), blur_px)
        if fit is None:
            return None
        c, u = fit
        # For the normal (0, -1), s increases with x; the tip is the point with the largest normal distance.
        height = np.full(TIP_GRID.size, c[-1])
        for coefficient in c[-2::-1]:
            height = coefficient + height * TIP_GRID
        best = int(height.argmax())
        x += float(TIP_GRID[best])
        y -= float(height[best])
        if abs(TIP_GRID[best]) < 0.1:
            break
    return LocalOutline(x, y, u, 0.0, -1.0)


def local_edge(
    points: OutlinePoints, x: float, y: float, slope: float, blur_px: float
) -> tuple[LocalOutline, float] | None:
    """Position and slope of a smooth inner edge at the height `y`, iterated from an initial estimate."""
    for _step in range(3):
        length = hypot(1.0, slope)
        nx, ny = 1.0 / length, -slope / length
        fit = outline_near(points, (x, y), (nx, ny), blur_px)
        if fit is None:
            return None
        c, u = fit
        # Crossing of the curve n(s) with the horizontal line through the centre, by Newton's method.
        s = 0.0
        for _newton in range(4):
            n, dn = _value_and_slope(c, s)
            # y offset of the curve's point: s * nx + n * ny (tangent is (-ny, nx))
            s -= (s * nx + n * ny) / (nx + dn * ny)
        n, dn = _value_and_slope(c, s)
        x += -s * ny + n * nx
        slope = (-ny + dn * nx) / (nx + dn * ny)
    return LocalOutline(x, y, u, nx, ny), slope


def _value_and_slope(c: list[float], s: float) -> tuple[float, float]:
    """Value of a polynomial and of its derivative (Horner's scheme)."""
    value, slope = c[-1], 0.0
    for coefficient in c[-2::-1]:
        slope = value + slope * s
        value = coefficient + value * s
    return value, slope


def local_measuring_point(points: OutlinePoints, below_tip_px: float, shared: float) -> MeasuringPoint | None:
    """Tip and inner edge of a finger of any smooth shape; None if the outline is not smooth.

    Parameters
    ----------
    points : OutlinePoints
        Sub-pixel outline of the finger.
    below_tip_px : float
        Distance of the measuring point below the tip.
    shared : float
        Number of neighbouring points that share an error.
    """
    blur = float(np.median(points.blur))
    top = int(np.argmin(points.y))
    tip = local_tip(points, float(points.x[top]), float(points.y[top]), blur)
    if tip is None:
        return None
    height = tip.y + below_tip_px
    inner = np.flatnonzero(points.x > tip.x)
    if not len(inner):
        return None
    nearest = inner[np.argmin(np.abs(points.y[inner] - height))]
    near = inner[np.abs(points.y[inner] - height) < SHAPE_REACH_PX]
    slope = line(points.y[near] - height, points.x[near])[1] if len(near) >= 3 else 0.0
    found = local_edge(points, float(points.x[nearest]), height, min(max(slope, -FLATTEST), FLATTEST), blur)
    if found is None or not is_on_outline(points, found[0].x, height):
        return None
    edge, slope = found
    var_tip = shared * tip.u_normal**2
    var_edge = shared * (edge.u_normal / edge.nx) ** 2 + slope**2 * var_tip
    if var_edge > LEAST_SURE_PX**2:
        return None
    covariance = np.array([[var_tip, slope * var_tip], [slope * var_tip, var_edge]])
    return MeasuringPoint(tip.y, tip.x, edge.x, slope, covariance)
