"""Step 6 for fingers with chamfered corners: the end of a finger as a chain of straight sides and corners.

The outline's points are divided into straight runs. Blur rounds the half-level contour at a corner: points near a
corner determine only its radius, and sides are fitted to points farther away. Tip and inner edge are those of the
polygon of the fitted sides, with its corners rounded by the fitted radii.

Division of a chain of points into straight runs: the best piecewise line with a penalty for every run.

Dynamic programming over all divisions of the chain (Bellman & Roth, JASA 64, 1969, doi:10.1080/01621459.1969.10501038),
with total least squares as the cost of a run, computed from the chain's cumulative moments. A point may be left out of
all runs at the cost of a penalty.
"""

from math import atan2, cos, hypot, pi, sin, sqrt, tan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.measuring_point import MeasuringPoint
from fingervision.vision.median import median
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.polygon import Corner, Polygon, Side, corner_half_level
from fingervision.vision.profile_lines import INNER_SIDE, OUTER_SIDE, TIP_SIDE
from fingervision.vision.residuals import is_on_outline

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Least number of points of a run; the noise is estimated from lines through the same number of neighbouring points.
FEWEST_OF_RUN = 5
# Least reduction of chi-square by a further run: odds of e^12 to one, plus the three parameters of the run.
PRICE_OF_RUN = 27.0
# Penalty (chi-square) for a point that is left out; points beyond about 2.5 standard deviations are left out.
PRICE_OF_POINT = 6.0
# Ratio of the median to the mean of chi-square with three degrees of freedom, for the windows from which the noise is
# estimated.
MEDIAN_OF_CHI_SQUARE = 0.79


_squares, _windows = loop("polygonal_outline_squares"), loop("polygonal_outline_windows")
_cheapest = loop("polygonal_outline_cheapest")


def straight_runs(x: Floats, y: Floats, u: Floats) -> list[Ints]:
    """Divide a chain of points into straight runs.

    Parameters
    ----------
    x, y : ndarray of float, shape (n,)
        Positions of the points in the order of the chain (pixels).
    u : ndarray of float, shape (n,)
        Standard uncertainty of each point across its run, in any common unit.

    Returns
    -------
    list of ndarray of int
        Indices of each run's points, in order; points that belong to no run are left out.
    """
    n = x.size
    if n < FEWEST_OF_RUN:
        return []
    w, x0, y0 = u**-2.0, x - x.mean(), y - y.mean()
    terms = np.column_stack((w, w * x0, w * y0, w * x0 * x0, w * x0 * y0, w * y0 * y0))
    sums = np.vstack((np.zeros(6), np.cumsum(terms, axis=0)))
    squares = np.empty(n - FEWEST_OF_RUN + 1)
    _windows(sums, squares)
    chi_square = squares / (FEWEST_OF_RUN - 2)
    noise = max(median(chi_square) / MEDIAN_OF_CHI_SQUARE, 1e-12)
    starts = np.empty(n + 1, dtype=np.int64)
    _cheapest(sums, noise, starts)
    last_run = starts.tolist()
    runs, k = [], n
    while k > 0:
        if last_run[k] < 0:
            k -= 1
        else:
            runs.append(np.arange(last_run[k], k))
            k = last_run[k]
    return _joined(runs[::-1], terms, noise)


def _joined(runs: list[Ints], terms: Floats, noise: float) -> list[Ints]:
    """Join runs that lie on one straight line: the omitted points between them were dust."""
    joined: list[Ints] = []
    for run in runs:
        if joined:
            both = np.concatenate((joined[-1], run))
            whole, first, second = (_squares(terms[points].sum(axis=0)) for points in (both, joined[-1], run))
            if whole - (first + second) < PRICE_OF_RUN * noise:
                joined[-1] = both
                continue
        joined.append(run)
    return joined


# Distance below the measuring height down to which sides are searched (pixels).
BELOW_PX = 40.0
# Distance from the outermost point (pixels) within which points belong to the top, share of the top's middle that is
# tested, and largest mean squared residual of a straight top in units of the points' variances (a curve of 150 px
# radius has more).
TOP_PX, MIDDLE_SHARE, TOP_STRAIGHTEST = 2.0, 0.6, 4.0
# Least and largest number of sides: two flanks, a top and at most two chamfers on either side; a curve would need more.
FEWEST_SIDES, MOST_SIDES = 3, 7
# Length along the sides of a right-angled corner (in sigma) over which blur displaces the half-level by more than 0.01
# sigma, and decrease of this length if the corner turns by a quarter of this angle.
BENT_IN_BLURS, LESS_IN_BLURS = 2.4, 0.5
# Number of passes, each of which fits the sides without the corners' points, and then the radii of the corners.
PASSES = 3
# Largest radius of a corner (pixels), above which the three-sided shape with fillets is used; standard uncertainty due
# to the difference between a fillet and a short chamfer, as a share of the radius.
ROUNDEST_PX, U_FILLET = 15.0, 0.3
# Largest distance of a corner's points from its vertex (pixels).
FARTHEST_PX = 15.0
# Standard uncertainty (in sigma) of a corner's half-level position that is found by the fit of a straight step.
U_HALF_LEVEL_IN_BLURS = 0.05
# Standard deviation (pixels) of the prior of a corner's radius about zero.
USUAL_PX = 3.0
# Sine of the angle between a line of pixels and a side, and distance between them (in sigma), below which the side
# affects the line more than the edge that the line crosses.
GRAZING, GRAZING_IN_BLURS = 0.64, 2.0
# Radii that are tried, and their spacing (pixels).
RADII_STEP_PX = 0.125
RADII_PX = np.arange(0.0, 20.0, RADII_STEP_PX)
# Least number of points of a side without its corners, and largest mean squared residual in units of the points'
# variances.
FEWEST_POINTS, STRAIGHTEST = 4, 3.0
# A top is level if its inclination is below this number of standard uncertainties, and its ends differ in height by
# less than this distance (pixels).
LEVEL_IN_SIGMAS, LEVEL_LIMIT_PX = 2.0, 0.5
# Largest slope (across / along) of a side whose crossing with a height is used.
FLATTEST = 3.0


class _Fitted(NamedTuple):
    """A fitted side, its standard uncertainties (pixels across it, radians), and its mean squared residual."""

    side: Side
    u_offset: float
    u_angle: float
    square: float


def polygonal_measuring_point(points: OutlinePoints, below_tip_px: float, shared: float) -> MeasuringPoint | None:
    """Tip and inner edge of a finger with straight sides and (nearly) sharp corners; None for another shape.

    Parameters
    ----------
    points : OutlinePoints
        Sub-pixel outline of the finger.
    below_tip_px : float
        Distance of the measuring point below the tip.
    shared : float
        Number of neighbouring points that share an error.
    """
    if not _has_straight_top(points):
        return None
    chain = _chain(points, float(points.y.min()) + below_tip_px + BELOW_PX)
    x, y, u = points.x[chain], points.y[chain], points.u[chain]
    is_row, blur = points.is_row[chain], median(points.blur)
    runs = straight_runs(x, y, u)
    if not FEWEST_SIDES <= len(runs) <= MOST_SIDES:
        return None
    found = _fitted(x, y, np.where(is_row, u, -u), runs, blur)
    if found is None:
        return None
    fits, radii, u_radii = found
    sides = [fit.side for fit in fits]
    polygon = Polygon(sides, radii, _level(fits))
    read = polygon.read_off(below_tip_px)
    if read is None or abs(read.slope) > FLATTEST or not is_on_outline(points, read.edge, read.tip + below_tip_px):
        return None
    if any(fits[k].square > STRAIGHTEST * shared for k in read.on):
        return None
    changes: list[Polygon] = []
    for k, fit in enumerate(fits):
        scale = sqrt(shared * max(fit.square, 1.0)) if fit.square < np.inf else 1.0
        others = (fit.side.shifted(scale * fit.u_offset), fit.side.turned(scale * fit.u_angle))
        changes.extend(polygon._replace(sides=[*sides[:k], moved, *sides[k + 1 :]]) for moved in others)
    for k, u_radius in enumerate(u_radii):
        changes.append(polygon._replace(radii=[*radii[:k], radii[k] + u_radius, *radii[k + 1 :]]))
    covariance = np.zeros((2, 2))
    for changed in changes:
        other = changed.read_off(below_tip_px)
        if other is None:
            return None
        change = np.array((other.tip - read.tip, other.edge - read.edge))
        covariance += np.outer(change, change)
    return MeasuringPoint(read.tip, read.apex, read.edge, read.slope, covariance)


def _has_straight_top(points: OutlinePoints) -> bool:
    """Whether the middle of the highest part is straight, by a quick test that excludes drop-shaped ends."""
    is_top = ~points.is_row & (points.y < points.y.min() + TOP_PX)
    x, y, u = points.x[is_top], points.y[is_top], points.u[is_top]
    if x.size < 2 * FEWEST_POINTS:
        return True
    near = np.abs(x - median(x)) <= 0.5 * MIDDLE_SHARE * np.ptp(x)
    x, y, u = x[near], y[near], u[near]
    x = x - x.mean()
    away = y - y.mean() - x * (x @ y) / max(float(x @ x), 1e-12)
    return bool(np.mean((away / u) ** 2) < TOP_STRAIGHTEST)


def _chain(points: OutlinePoints, lowest: float) -> Ints:
    """Indices of the points in order: up the outer flank, across the top, down the inner flank."""
    parts = []
    for side, key in ((OUTER_SIDE, -points.y), (TIP_SIDE, points.x), (INNER_SIDE, points.y)):
        these = np.flatnonzero((points.side == side) & (points.y < lowest))
        parts.append(these[np.argsort(key[these], kind="stable")])
    return np.concatenate(parts)


def _line(x: Floats, y: Floats, u: Floats) -> _Fitted:
    """Line by weighted total least squares; `u` is positive for uncertainties along x, negative for those along y."""
    start = np.full(x.size, atan2(float(y[-1] - y[0]), float(x[-1] - x[0])))
    for _look in range(2):
        across = np.where(u > 0, np.abs(np.sin(start)), np.abs(np.cos(start)))
        w = (np.abs(u) * np.maximum(across, 0.1)) ** -2.0
        total = float(w.sum())
        cx, cy = float(w @ x) / total, float(w @ y) / total
        dx, dy = x - cx, y - cy
        xx, xy, yy = float(w @ dx**2), float(w @ (dx * dy)), float(w @ dy**2)
        angle = 0.5 * atan2(2.0 * xy, xx - yy)
        if cos(angle) * (x[-1] - x[0]) + sin(angle) * (y[-1] - y[0]) < 0.0:
            angle = atan2(-sin(angle), -cos(angle))
        start = np.full(x.size, angle)
    along = dx * cos(angle) + dy * sin(angle)
    away = dy * cos(angle) - dx * sin(angle)
    square = float(w @ away**2) / max(x.size - 2, 1)
    return _Fitted(Side(cx, cy, angle), total**-0.5, max(float(w @ along**2), 1e-12) ** -0.5, square)


def _fitted(
    x: Floats, y: Floats, u: Floats, runs: list[Ints], blur: float
) -> tuple[list[_Fitted], list[float], list[float]] | None:
    """Fitted sides, radii of their corners and the radii's uncertainties; None if the sides are not convex."""
    fits = [_line(x[run], y[run], u[run]) for run in runs]
    radii = u_radii = [0.0] * (len(runs) - 1)
    for _pass in range(PASSES):
        corners = Polygon([fit.side for fit in fits], radii, None).corners()
        if corners is None:
            return None
        radii, u_radii = [], []
        for corner in corners:
            radius, u_radius = _radius(x, y, u, corner, blur)
            if radius > ROUNDEST_PX:
                return None
            radii.append(radius)
            u_radii.append(u_radius)
        fits = []
        for k, run in enumerate(runs):
            keep = np.ones(run.size, dtype=bool)
            for j in (k - 1, k):
                if 0 <= j < len(corners):
                    (vx, vy), _, turn = corners[j]
                    bent = radii[j] * tan(0.5 * turn) + _bent_in_blurs(turn) * blur
                    keep &= np.hypot(x[run] - vx, y[run] - vy) > bent
            # A side too short to be distinguished from its corners determines no point.
            if np.count_nonzero(keep) < FEWEST_POINTS:
                fits.append(_line(x[run], y[run], u[run])._replace(square=np.inf))
            else:
                fits.append(_line(x[run[keep]], y[run[keep]], u[run[keep]]))
    return fits, radii, u_radii


def _radius(x: Floats, y: Floats, u: Floats, corner: Corner, blur: float) -> tuple[float, float]:
    """Most probable radius of a corner from the points of its half-level contour, and its standard uncertainty."""
    (vx, vy), (nx, ny), turn = corner
    dx, dy = x - vx, y - vy
    near = np.hypot(dx, dy) < FARTHEST_PX
    for side in (-0.5 * turn, 0.5 * turn):
        # The bisector points into the finger; the angle between a side and the bisector is 90 degrees plus half of the
        # corner's turn.
        sx, sy = ny * cos(side) + nx * sin(side), -nx * cos(side) + ny * sin(side)
        runs_along = np.where(u > 0.0, abs(sy), abs(sx)) < GRAZING
        near &= ~(runs_along & (np.abs(dx * sy - dy * sx) < GRAZING_IN_BLURS * blur))
    dx, dy = dx[near], dy[near]
    deep = corner_half_level(dy * nx - dx * ny, RADII_PX[:, None], turn, blur)
    square = (((dx * nx + dy * ny) - deep) / np.hypot(u[near], U_HALF_LEVEL_IN_BLURS * blur)) ** 2
    exponent = 0.5 * square.sum(axis=1) + 0.5 * (RADII_PX / USUAL_PX) ** 2
    likely = np.exp(exponent.min() - exponent)
    radius = float(RADII_PX[int(exponent.argmin())])
    spread = sqrt(float(likely @ (RADII_PX - radius) ** 2) / float(likely.sum()) + RADII_STEP_PX**2)
    return radius, hypot(spread, U_FILLET * radius)


def _bent_in_blurs(turn: float) -> float:
    """Length along a corner's sides over which the blur matters, in units of sigma."""
    return BENT_IN_BLURS - LESS_IN_BLURS * max(0.0, 1.0 - 2.0 * turn / pi) / 0.75


def _level(fits: list[_Fitted]) -> int | None:
    """Index of a top side that is level within its uncertainty, or None.

    For a level side, noise would decide which of its ends is the higher.
    """
    for k in range(1, len(fits) - 1):
        # Infinite for a top too short to have an inclination.
        u_angle = fits[k].u_angle * sqrt(max(fits[k].square, 1.0))
        corners = Polygon([fit.side for fit in fits[k - 1 : k + 2]], [0.0, 0.0], None).corners()
        if corners is None:
            continue
        rise = abs(corners[1][0][1] - corners[0][0][1])
        if abs(fits[k].side.angle) < LEVEL_IN_SIGMAS * u_angle and rise < LEVEL_LIMIT_PX:
            return k
    return None
