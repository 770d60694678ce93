"""Corner of a rough finger: a fillet or a chamfer (a straight cut), which roughness may make indistinguishable.

A fillet of radius R and a straight cut whose legs are 0.655 R remove the same area from a corner, and nowhere differ by
more than 0.06 R. If roughness hides this difference, the measuring point is the mean over both shapes, each weighted by
its likelihood (Bayesian model averaging: Hoeting et al., Statistical Science 14, 1999, 382, doi:10.1214/ss/1009212519);
the variance between the two shapes is part of its uncertainty.
"""

from dataclasses import replace
from math import atan2, exp, hypot

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.finger_end import FingerEnd
from fingervision.vision.finger_shape import INNER_C, INNER_M, INNER_R, OUTER_C, OUTER_M, OUTER_R, TOP_C, TOP_M, seen
from fingervision.vision.measuring_point import MeasuringPoint
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.polygon import Polygon, Side

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
LEVEL_TOP = 2


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
        tried = [_cut(p, end, leg, below_tip_px, shared_px) for leg in LEGS]
        cuts = np.array([each for each in tried if each is not None])
        if not len(cuts):  # no corner that could be chamfered
            return found
        least = float(cuts[:, 0].min())
        likely = np.exp(0.5 * (least - cuts[:, 0]))
        log_odds += float(np.log(likely.sum() / len(LEGS))) - 0.5 * least
        cut_ends.append((likely / likely.sum(), cuts[:, 1:]))
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


def _cut(
    points: OutlinePoints, end: FingerEnd, leg: float, below_tip_px: float, shared_px: float
) -> tuple[float, float, float] | None:
    """Chi-square of chamfers minus that of fillets, and tip and edge of the chamfered finger; None without chamfer."""
    p, (x0, y0) = end.parameters, end.origin
    if p[INNER_R] < SMALLEST_PX:
        return None
    vertices = []
    for c, m in ((p[OUTER_C], p[OUTER_M]), (p[INNER_C], p[INNER_M])):
        x = (c + m * (p[TOP_C] - p[TOP_M] * x0 - y0)) / (1.0 - m * p[TOP_M])
        vertices.append((x, p[TOP_C] + p[TOP_M] * (x - x0)))
    along_top, length = hypot(1.0, p[TOP_M]), vertices[1][0] - vertices[0][0]
    sides, radii = [Side(p[OUTER_C], y0, atan2(-1.0, -p[OUTER_M]))], (p[OUTER_R], p[INNER_R])
    legs = [leg * max(radius, SMALLEST_PX) for radius in radii]
    if sum(legs) > 0.95 * length:
        return None
    for (x, y), m, way, sense in zip(vertices, (p[OUTER_M], p[INNER_M]), legs, (1.0, -1.0), strict=True):
        down = hypot(1.0, m)
        on_flank = x + way * m / down, y + way / down
        on_top = x + sense * way / along_top, y + sense * way * p[TOP_M] / along_top
        start, stop = (on_flank, on_top) if sense > 0.0 else (on_top, on_flank)
        sides.append(Side(*start, atan2(stop[1] - start[1], stop[0] - start[0])))
        if sense > 0.0:
            sides.append(Side(x0, p[TOP_C], atan2(p[TOP_M], 1.0)))
    sides.append(Side(p[INNER_C], y0, atan2(1.0, p[INNER_M])))
    is_level = abs(p[TOP_M]) * length < LEVEL_PX
    read = Polygon(sides, [0.0] * (len(sides) - 1), LEVEL_TOP if is_level else None).read_off(below_tip_px)
    if read is None:
        return None
    away = np.max([(points.x - s.x) * np.sin(s.angle) - (points.y - s.y) * np.cos(s.angle) for s in sides], axis=0)
    _, slant = seen(p, end.origin, points.x, points.y, points.is_row)
    normal_u, excess = points.u * slant, 0.0
    for (x, y), radius in zip(vertices, radii, strict=True):
        near = np.hypot(points.x - x, points.y - y) < NEAR_RADII * max(radius, SMALLEST_PX)
        if not near.any():
            continue
        # Number of points in this stretch of outline that have an error in common.
        stretch = (2.0 * NEAR_RADII - 0.43) * radius
        alike = max(shared_px * float(np.count_nonzero(near)) / max(stretch, 1.0), 1.0)
        cut, fillet = np.abs(away[near] / normal_u[near]), np.abs(end.residual[near])
        most = MOST_SIGMAS
        excess += float(np.sum(np.minimum(cut, most) ** 2 - np.minimum(fillet, most) ** 2)) / alike
    return excess, read.tip, read.edge
