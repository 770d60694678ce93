"""Corner of a rough finger: a fillet or a chamfer (a straight cut), which roughness may make indistinguishable.

A fillet of radius R and a straight cut whose legs are 0.655 R remove the same area from a corner, and nowhere differ by
more than 0.06 R. If roughness hides the difference between the two shapes, the measuring point is the mean over both
shapes, each weighted by its likelihood (Bayesian model averaging: Hoeting et al., Statistical Science 14, 1999, 382,
doi:10.1214/ss/1009212519); the variance between the two shapes is part of its uncertainty.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from math import atan2, cos, exp, hypot, pi, sin
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
LEGS = tuple(np.linspace(0.5, 0.85, 15).tolist())
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
        tried = [] if corners is None else [_cut(corners, leg, below_tip_px) for leg in LEGS]
        cuts = [each for each in tried if each is not None]
        if corners is None or not cuts:  # the finger has no corner that may be a chamfer
            return found
        excess = _excess(corners, cuts)
        least = float(excess.min())
        likely = np.exp(0.5 * (least - excess))
        log_odds += float(np.log(likely.sum() / len(LEGS))) - 0.5 * least
        cut_ends.append((likely / likely.sum(), np.array([(cut.tip, cut.edge) for cut in cuts])))
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


class _Cut(NamedTuple):
    """A finger with chamfers: its two chamfers, tip and inner edge."""

    outer: Side
    inner: Side
    tip: float
    edge: float


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
    beyond = _beyond(sides, points.x, points.y).max(axis=0)
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


def _cut(corners: _Corners, leg: float, below_tip_px: float) -> _Cut | None:
    """The finger with chamfers, whose legs are a multiple of the fillets' radii; None if the finger is too narrow."""
    vertices, top_slope = corners.vertices, corners.top_slope
    along_top, length = hypot(1.0, top_slope), vertices[1][0] - vertices[0][0]
    legs = [leg * max(radius, SMALLEST_PX) for radius in corners.radii]
    if sum(legs) > 0.95 * length:
        return None
    chain: list[tuple[float, float]] = []
    for (x, y), m, way, sense in zip(vertices, corners.slopes, legs, (1.0, -1.0), strict=True):
        down = hypot(1.0, m)
        on_flank = x + way * m / down, y + way / down
        on_top = x + sense * way / along_top, y + sense * way * top_slope / along_top
        chain += (on_flank, on_top) if sense > 0.0 else (on_top, on_flank)
    outer, inner = (Side(x0, y0, atan2(y1 - y0, x1 - x0)) for (x0, y0), (x1, y1) in (chain[:2], chain[2:]))
    angles = [side.angle for side in (corners.outer, outer, corners.top, inner, corners.inner)]
    turns = [(two - one + pi) % (2.0 * pi) - pi for one, two in pairwise(angles)]
    if min(turns) <= LEAST_TURN or max(turns) >= MOST_TURN:
        return None
    is_level = abs(top_slope) * length < LEVEL_PX
    tip = 0.5 * (chain[1][1] + chain[2][1]) if is_level else min(y for _, y in chain)
    edge = _inner_edge(chain, corners.slopes[1], tip + below_tip_px)
    return None if edge is None else _Cut(outer, inner, tip, edge)


def _inner_edge(chain: list[tuple[float, float]], slope: float, height: float) -> float | None:
    """Position of the inner side at a height, from a finger's corners and the slope of its inner flank.

    This takes a tenth of the time of `Polygon.read_off`, which allows for rounded corners.
    """
    for (x0, y0), (x1, y1) in pairwise(chain):
        if y0 < y1 and y0 <= height <= y1:
            return x0 + (height - y0) * (x1 - x0) / (y1 - y0)
    x, y = chain[-1]
    return x + slope * (height - y) if height >= y else None


def _excess(corners: _Corners, cuts: list[_Cut]) -> Floats:
    """Chi-square of the points near the corners for every chamfer, minus that for fillets; shape (cuts,)."""
    excess = np.zeros(len(cuts))
    for near in corners.near:
        away = near.beyond_sides
        for sides in ([cut.outer for cut in cuts], [cut.inner for cut in cuts]):
            away = np.maximum(away, _beyond(sides, near.x, near.y))
        cut_squares = np.minimum(np.abs(away / near.normal_u), MOST_SIGMAS) ** 2
        excess += np.sum(cut_squares - near.fillet_squares, axis=1) / near.alike
    return excess


def _beyond(sides: Sequence[Side], x: Floats, y: Floats) -> Floats:
    """Outward distance of points from each side, shape (sides, n)."""
    places = np.array([(side.x, side.y, sin(side.angle), cos(side.angle)) for side in sides])
    side_x, side_y, sine, cosine = places.T[:, :, None]
    return np.asarray((x - side_x) * sine - (y - side_y) * cosine)
