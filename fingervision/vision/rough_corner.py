"""Corner of a rough finger: a fillet or a chamfer (a straight cut), which roughness may make indistinguishable.

A fillet of radius R and a straight cut whose legs are 0.655 R remove the same area from a corner, and nowhere differ by
more than 0.06 R. If roughness hides the difference between the two shapes, the measuring point is the mean over both
shapes, each weighted by its likelihood (Bayesian model averaging: Hoeting et al., Statistical Science 14, 1999, 382,
doi:10.1214/ss/1009212519); the variance between the two shapes is part of its uncertainty.
"""

from dataclasses import replace
from math import atan2, exp, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.finger_end import FingerEnd
from fingervision.vision.finger_shape import INNER_C, INNER_M, INNER_R, OUTER_C, OUTER_M, OUTER_R, TOP_C, TOP_M, seen
from fingervision.vision.measuring_point import MeasuringPoint
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.polygon import LEAST_TURN, MOST_TURN, Side

Floats = NDArray[np.float64]

# Legs of the chamfer that are tried, in radii of the fillet: values around sqrt(2 - pi / 2), which gives an equal area,
# in steps that move the edge by less than roughness does.
LEGS: Floats = np.linspace(0.5, 0.85, 15)
# Largest sum of both legs as a share of the top's length: the finger is too narrow for more.
WIDEST = 0.95
# Radius (pixels) below which a fillet or chamfer lies above the measuring height.
SMALLEST_PX = 3.0
# Distance from a corner's vertex (in radii) within which points are used to compare the shapes, and largest residual of
# a point (in sigma), to limit the effect of outliers.
NEAR_RADII, MOST_SIGMAS = 1.3, 3.0
# Largest difference in height between the ends of a level top (pixels).
LEVEL_PX = 0.5
# Factor on the variance of each finger, because both fingers have corners of the same kind and hence equal errors.
BOTH_ALIKE = 2.0


def with_corner_doubt(
    points: list[OutlinePoints],
    ends: list[FingerEnd],
    found: list[MeasuringPoint],
    below_tip_px: float,
    shared_px: float,
) -> list[MeasuringPoint]:
    """Return the measuring points of two rough fingers, averaged over fillets and cut corners.

    Parameters
    ----------
    points : list of OutlinePoints
        Points of both fingers, with uncertainties that include the roughness.
    ends : list of FingerEnd
        Shapes with fillets that were fitted to the points.
    found : list of MeasuringPoint
        Measuring points of these shapes.
    below_tip_px : float
        Distance of the measuring points below the tips.
    shared_px : float
        Length of edge that counts as one independent point.
    """
    cut_ends, log_odds = [], 0.0
    for p, end in zip(points, ends, strict=True):
        corners = _corners(p, end, shared_px)
        cuts = None if corners is None else _cuts(corners, below_tip_px)
        if corners is None or cuts is None or not cuts.read.size:  # the finger has no corner that may be a chamfer
            return found
        excess = _excess(corners, cuts)
        least = float(excess.min())
        likely = np.exp(0.5 * (least - excess))
        log_odds += float(np.log(likely.sum() / LEGS.size)) - 0.5 * least
        cut_ends.append((likely / likely.sum(), cuts.read))
    share = 1.0 / (1.0 + exp(min(max(-log_odds, -50.0), 50.0)))
    averaged = []
    for own, (likely, cut) in zip(found, cut_ends, strict=True):
        fillet, mean = np.array((own.tip, own.edge)), likely @ cut
        way = mean - fillet
        among_legs = (cut - mean).T @ (likely[:, None] * (cut - mean))
        # Variance of a rectangular distribution over the spacing of the legs.
        step = (cut[-1] - cut[0]) / max(len(cut) - 1, 1)
        among_legs += np.outer(step, step) / 12.0
        between = BOTH_ALIKE * share * (1.0 - share) * np.outer(way, way)
        tip, edge = fillet + share * way
        covariance = own.covariance + share * among_legs + between
        averaged.append(replace(own, tip=float(tip), edge=float(edge), covariance=covariance))
    return averaged


class _Near(NamedTuple):
    """Points near the vertex of a corner, from which its shape is determined.

    Parameters
    ----------
    x, y, normal_u : ndarray of float, shape (n,)
        Positions, and standard uncertainties along the normal (pixels).
    beyond_sides : ndarray of float, shape (n,)
        Distance of each point outwards from the nearest of the flanks and the top.
    fillet_squares : ndarray of float, shape (n,)
        Squared residuals from the fillet, in units of the variance, limited to reduce the effect of outliers.
    alike : float
        Number of neighbouring points that share an error and count as one.
    """

    x: Floats
    y: Floats
    normal_u: Floats
    beyond_sides: Floats
    fillet_squares: Floats
    alike: float


class _Corners(NamedTuple):
    """The outer and the inner corner of a finger.

    Parameters
    ----------
    vertices : ((float, float), (float, float))
        Vertex of each corner.
    radii, slopes : (float, float)
        Radius of each fillet, and slope of each flank.
    near : list of _Near
        Points near each vertex that has any.
    outer, top, inner : Side
        The sides.
    top_slope : float
        Slope of the top.
    """

    vertices: tuple[tuple[float, float], tuple[float, float]]
    radii: tuple[float, float]
    slopes: tuple[float, float]
    near: list[_Near]
    outer: Side
    top: Side
    inner: Side
    top_slope: float


class _Cuts(NamedTuple):
    """A finger with chamfers whose legs are different multiples of its fillets' radii.

    Parameters
    ----------
    sides : (ndarray of float, ndarray of float)
        The outer and the inner chamfers, each as `_places`.
    read : ndarray of float, shape (cuts, 2)
        Tip and inner edge.
    """

    sides: tuple[Floats, Floats]
    read: Floats


def _corners(points: OutlinePoints, end: FingerEnd, shared_px: float) -> _Corners | None:
    """Geometry of a finger's two corners before a chamfer; None if the inner corner is too small for a chamfer."""
    p, (x0, y0) = end.parameters.tolist(), end.origin.tolist()
    if p[INNER_R] < SMALLEST_PX:
        return None
    outer, inner = (
        (x, p[TOP_C] + p[TOP_M] * (x - x0))
        for c, m in ((p[OUTER_C], p[OUTER_M]), (p[INNER_C], p[INNER_M]))
        for x in ((c + m * (p[TOP_C] - p[TOP_M] * x0 - y0)) / (1.0 - m * p[TOP_M]),)
    )
    sides = (
        Side(p[OUTER_C], y0, atan2(-1.0, -p[OUTER_M])),
        Side(x0, p[TOP_C], atan2(p[TOP_M], 1.0)),
        Side(p[INNER_C], y0, atan2(1.0, p[INNER_M])),
    )
    beyond = _beyond(_places(*np.array(sides).T), points.x, points.y).max(axis=0)
    _, slant = seen(end.parameters, end.origin, points.x, points.y, points.is_row)
    normal_u, radii, found = points.u * slant, (p[OUTER_R], p[INNER_R]), []
    for (x, y), radius in zip((outer, inner), radii, strict=True):
        near = np.hypot(points.x - x, points.y - y) < NEAR_RADII * max(radius, SMALLEST_PX)
        if not near.any():
            continue
        # Number of points in this stretch of outline that have an error in common.
        stretch = (2.0 * NEAR_RADII - 0.43) * radius
        alike = max(shared_px * float(np.count_nonzero(near)) / max(stretch, 1.0), 1.0)
        squares = np.minimum(np.abs(end.residual[near]), MOST_SIGMAS) ** 2
        found.append(_Near(points.x[near], points.y[near], normal_u[near], beyond[near], squares, alike))
    return _Corners((outer, inner), radii, (p[OUTER_M], p[INNER_M]), found, *sides, p[TOP_M])


def _cuts(corners: _Corners, below_tip_px: float) -> _Cuts:
    """The finger with chamfers; legs for which it is too narrow, or which determine no edge, are left out."""
    vertices, slopes, top_slope = np.array(corners.vertices), np.array(corners.slopes), corners.top_slope
    length = vertices[1, 0] - vertices[0, 0]
    legs = LEGS[:, None] * np.maximum(corners.radii, SMALLEST_PX)
    down = np.column_stack((slopes, np.ones(2))) / np.hypot(1.0, slopes)[:, None]
    along = np.outer((1.0, -1.0), (1.0, top_slope)) / np.hypot(1.0, top_slope)
    on_flank, on_top = (vertices + legs[..., None] * way for way in (down, along))
    # The corners of the chain from the outer to the inner flank.
    x, y = np.stack((on_flank[:, 0], on_top[:, 0], on_top[:, 1], on_flank[:, 1]), axis=-1).transpose(1, 0, 2)
    outer, inner = (np.arctan2(y[:, k + 1] - y[:, k], x[:, k + 1] - x[:, k]) for k in (0, 2))
    angles = np.broadcast_arrays(corners.outer.angle, outer, corners.top.angle, inner, corners.inner.angle)
    turns = (np.diff(angles, axis=0) + pi) % (2.0 * pi) - pi
    is_level = abs(top_slope) * length < LEVEL_PX
    tip = 0.5 * (y[:, 1] + y[:, 2]) if is_level else y.min(axis=1)
    edge = _inner_edge(x, y, slopes[1], tip + below_tip_px)
    is_sound = (legs.sum(axis=1) <= WIDEST * length) & np.isfinite(edge)
    is_sound &= (turns.min(axis=0) > LEAST_TURN) & (turns.max(axis=0) < MOST_TURN)
    sides = _places(x[:, 0], y[:, 0], outer)[is_sound], _places(x[:, 2], y[:, 2], inner)[is_sound]
    return _Cuts(sides, np.column_stack((tip, edge))[is_sound])


def _inner_edge(x: Floats, y: Floats, slope: float, height: Floats) -> Floats:
    """Position of the inner side of each chain at a height; NaN where this lies above the chain.

    The chains are given by their corners, shape (cuts, 4), and the slope of their inner flank.
    """
    edge = np.where(height >= y[:, 3], x[:, 3] + slope * (height - y[:, 3]), np.nan)
    for k in (2, 1):
        share = (height - y[:, k]) / np.maximum(y[:, k + 1] - y[:, k], 1e-12)
        edge = np.where((share >= 0.0) & (share <= 1.0), x[:, k] + share * (x[:, k + 1] - x[:, k]), edge)
    return np.asarray(edge)


def _excess(corners: _Corners, cuts: _Cuts) -> Floats:
    """Chi-square of the points near the corners for every chamfer, minus that for fillets; shape (cuts,)."""
    excess = np.zeros(len(cuts.read))
    for near in corners.near:
        away = near.beyond_sides
        for sides in cuts.sides:
            away = np.maximum(away, _beyond(sides, near.x, near.y))
        cut_squares = np.minimum(np.abs(away / near.normal_u), MOST_SIGMAS) ** 2
        excess += np.sum(cut_squares - near.fillet_squares, axis=1) / near.alike
    return excess


def _places(x: Floats, y: Floats, angle: Floats) -> Floats:
    """A point on each side, and sine and cosine of its direction; shape (sides, 4)."""
    return np.column_stack((x, y, np.sin(angle), np.cos(angle)))


def _beyond(places: Floats, x: Floats, y: Floats) -> Floats:
    """Outward distance of points from each side, shape (sides, n)."""
    side_x, side_y, sine, cosine = places.T[:, :, None]
    return np.asarray((x - side_x) * sine - (y - side_y) * cosine)
