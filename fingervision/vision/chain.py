"""A finger's end as a convex chain of straight sides with rounded corners: its fit to the outline, and its evidence.

All corners have a radius, from sharp to a fillet as wide as the finger, so that rounded, square, slanted and chamfered
ends are one family, which differs in the number of sides. The points are compared with the half-level contour of the
blurred chain, which is exact for any number of sides; only fillets of more than a few sigma are approximated. A point
is either on the outline or dust, with prior odds that do not depend on the shape; the weights of the fit are the
posterior probabilities that points are on the outline (expectation and maximisation: Dempster, Laird and Rubin, J. R.
Stat. Soc. B 39, 1977, doi:10.1111/j.2517-6161.1977.tb01600.x).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan2, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.finger_end import FingerEnd
from fingervision.vision.finger_shape import INNER_C, INNER_M, INNER_R, OUTER_C, OUTER_M, OUTER_R, TOP_C, TOP_M
from fingervision.vision.measuring_point import MeasuringPoint
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.polygon import Polygon, Side

Floats = NDArray[np.float64]

# Largest number of sides: two flanks, a top, and a chamfer on either side.
MOST_SIDES = 5
# Radii (in sigma) below which a corner's contour is that of a sharp corner, and above which it is that of a fillet.
SHARP_BELOW, ROUND_ABOVE = 1.0, 3.0
# Straight pieces that stand for a fillet of such a radius, and pieces of the longest chain.
FACETS, MOST_PIECES = 3, 17
# Distance (in sigma) from a corner beyond which its blur is not felt, and from the outline where points are dust.
REACH, DEEPEST = 6.0, 5.0
# Standard uncertainty (in sigma) with which a straight step reads the light where it comes from two sides at right
# angles to each other. The outward normals of what a point sees have a spread of directions (1 - g^2)^(1/2), with g the
# steepness of the light as a share of that at a straight edge, and the uncertainty is proportional to it. It is so
# large because all lines at a corner share their error.
U_CORNER_IN_BLURS = 0.28
# Least steepness of the light at a point of the contour, as a share of that at a straight edge.
LEAST_RISE = 0.1
# Least and largest change of direction between neighbouring sides (radians) of a convex chain.
LEAST_TURN, MOST_TURN = 0.03, 2.6
# Step of the numerical derivatives (pixels; radians for a rotation).
STEP_PX, STEP_RAD = 1e-4, 1e-6
# Squared residual (in variances) at which a point is as likely dust as a part of the outline.
DUST = 9.0
# Steps of a fit that begins where another ended: factors on the standard uncertainties of the points. A fit from an
# initial estimate has other steps before them, the first of which tolerates errors of so many pixels.
SETTLING, STARTING, TOLERATED_PX = (1.0,) * 20, 5, 3.0
# Standard deviations of the priors: of the place of a flank or top (pixels), of a side's rotation (radians), and of the
# radius of a corner that is cut or sharp (pixels).
U_PLACE_PX, U_ANGLE, U_SHARP_PX = 30.0, 0.3, 3.0
# Largest rotation of a side in one step (radians), and squared length of a step (in standard uncertainties) that is the
# last one.
MOST_TURNED, SETTLED = 0.15, 1e-4
# Radii (in sigma) at which the likelihood of a nearly sharp corner is computed.
SMALL_RADII: Floats = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0])
# A top is level if its inclination is below this number of standard uncertainties, and its ends differ in height by
# less than this distance (pixels): noise would decide which of them is the higher.
LEVEL_IN_SIGMAS, LEVEL_LIMIT_PX = 2.0, 0.5

_fit = loop("chain_fit")


class Start(NamedTuple):
    """Beginning of a fit, and the standard deviations of its priors (pixels): of every side's place, of every radius.

    The prior of a side has its mean at the beginning, and that of a radius at 0.
    """

    sides: list[Side]
    radii: list[float]
    u_places: list[float]
    u_radii: list[float]


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """A fitted chain of sides.

    Parameters
    ----------
    polygon : Polygon
        Sides and radii.
    u_places, u_radii : list of float
        Standard deviations of the priors (pixels).
    covariance : ndarray of float, shape (3 n - 1, 3 n - 1)
        Covariance of the n sides' displacements (pixels) and rotations (radians), and of the radii (pixels).
    residual, robust : ndarray of float, shape (points,)
        Normal distance of every point in units of its uncertainty, and probability that it is on the outline.
    log_evidence : float
        Logarithm of the probability of the points under this number of sides (Laplace's approximation).
    """

    polygon: Polygon
    u_places: list[float]
    u_radii: list[float]
    covariance: Floats
    residual: Floats
    robust: Floats
    log_evidence: float

    @property
    def spread(self) -> float:
        """Mean squared residual of the points on the outline, in units of their variances."""
        free = max(float(self.robust.sum()) - len(self.covariance), 1.0)
        return float(self.robust @ self.residual**2) / free

    @property
    def misfit(self) -> float:
        """Ratio of the residuals' spread to the points' uncertainties."""
        return sqrt(self.spread)


def three_sides(end: FingerEnd) -> tuple[list[Side], list[float]]:
    """Sides of a finger end from the outer to the inner flank, and the radii of its corners."""
    p, (x0, y0) = end.parameters.tolist(), end.origin.tolist()
    sides = [
        Side(p[OUTER_C], y0, atan2(-1.0, -p[OUTER_M])),
        Side(x0, p[TOP_C], atan2(p[TOP_M], 1.0)),
        Side(p[INNER_C], y0, atan2(1.0, p[INNER_M])),
    ]
    return sides, [p[OUTER_R], p[INNER_R]]


def fit_chain(
    points: OutlinePoints, start: Start, variance: float, patience: Sequence[float] | None = None
) -> Chain | None:
    """Fit a chain to the points of an outline by Gauss-Newton steps; None if the result is no convex chain.

    Parameters
    ----------
    points : OutlinePoints
        Sub-pixel outline of the finger.
    start : Start
        Initial estimate, which is the mean of the prior of the sides.
    variance : float
        Factor on the variances of the points, for errors that neighbours share and for a misfit that no shape explains.
    patience : sequence of float, or None
        Factor on the standard uncertainties in every step; empty if the start itself is judged, None for steps from an
        initial estimate.
    """
    sides, radii = np.array(start.sides), np.array(start.radii)
    u_prior = np.concatenate([start.u_places, np.full(len(sides), U_ANGLE), start.u_radii])
    if patience is None:
        tolerant = max(TOLERATED_PX / float(np.median(points.u)), 10.0)
        patience = [*np.geomspace(tolerant, 1.0, STARTING, endpoint=False).tolist(), *SETTLING]
    unknowns = u_prior.size
    information, jacobian = np.empty((unknowns, unknowns)), np.empty((points.x.size, unknowns))
    residual, away = np.empty(points.x.size), np.empty(unknowns)
    how = (np.array(patience, dtype=np.float64), variance)
    if not _fit(sides, radii, u_prior, *_seen(points), *how, information, residual, jacobian, away):
        return None
    polygon = Polygon([Side(*side) for side in sides.tolist()], radii.tolist(), None)
    if patience and not polygon.is_chain():
        return None
    log_volume = float(np.linalg.slogdet(information * np.outer(u_prior, u_prior))[1])
    misfit = _misfit(residual, variance) + float(np.sum((away / u_prior) ** 2))
    weight = np.asarray(1.0 / (1.0 + np.exp(np.minimum(0.5 * (residual**2 / variance - DUST), 50.0))))
    covariance: Floats = np.asarray(np.linalg.inv(information), dtype=np.float64)
    log_evidence = -0.5 * (misfit + log_volume)
    return Chain(polygon, start.u_places, start.u_radii, covariance, residual, weight, log_evidence)


def _seen(points: OutlinePoints) -> tuple[NDArray[Any], ...]:
    return points.x, points.y, points.u, points.is_row, points.blur


def with_small_radii(points: OutlinePoints, chain: Chain, variance: float) -> Chain:
    """Return the chain with the uncertainty of the radii that blur nearly hides.

    The contour of a sharp corner changes with the square of its radius, so that a quadratic likelihood does not
    describe it: the likelihood is integrated over the radius.
    """
    sides, radii, count = chain.polygon.sides, chain.polygon.radii, len(chain.polygon.sides)
    blur, covariance = float(points.blur[0]), chain.covariance.copy()
    log_evidence = chain.log_evidence
    u_prior, away, nothing = np.ones(3 * count - 1), np.empty(3 * count - 1), np.empty((0, 0))
    residual, how = np.empty(points.x.size), (np.empty(0), variance)
    for k, radius in enumerate(radii):
        if radius >= ROUND_ABOVE * blur:
            continue
        tried, misfit = SMALL_RADII * blur, []
        for other in tried.tolist():
            changed = np.array([*radii[:k], other, *radii[k + 1 :]])
            is_chain = _fit(np.array(sides), changed, u_prior, *_seen(points), *how, nothing, residual, nothing, away)
            misfit.append(_misfit(residual, variance) + (other / chain.u_radii[k]) ** 2 if is_chain else np.inf)
        likely = np.exp(-0.5 * (np.array(misfit) - min(misfit)))
        square = np.trapezoid(likely * (tried - radius) ** 2, tried) / np.trapezoid(likely, tried)
        square = max(square, tried[1] ** 2 / 12.0)  # between two of the radii nothing is known
        place = 2 * count + k
        log_evidence += 0.5 * float(np.log(square / covariance[place, place]))
        covariance[place, :] = covariance[:, place] = 0.0
        covariance[place, place] = square
    return replace(chain, covariance=covariance, log_evidence=log_evidence)


def chain_point(chain: Chain, below_tip_px: float) -> MeasuringPoint | None:
    """Tip and inner edge of a chain, with their covariance; None if it does not determine them."""
    polygon = chain.polygon._replace(level=_level(chain))
    read = polygon.read_off(below_tip_px)
    if read is None:
        return None
    sides, radii, count = polygon.sides, polygon.radii, len(polygon.sides)
    moves = [(k, STEP_PX, 0.0) for k in range(count)] + [(k, 0.0, STEP_RAD) for k in range(count)]
    changes = [
        (polygon._replace(sides=[*sides[:k], sides[k].moved(px, radians), *sides[k + 1 :]]), px or radians)
        for k, px, radians in moves
    ]
    for k in range(count - 1):
        # A radius cannot be negative, but may be so much larger that the measuring point lies on the fillet, unless a
        # side is too short for that.
        u_px = float(np.sqrt(chain.covariance[2 * count + k, 2 * count + k]))
        for step in (u_px, 0.25 * u_px, STEP_PX):
            changed = polygon._replace(radii=[*radii[:k], radii[k] + step, *radii[k + 1 :]])
            if changed.is_chain():
                break
        changes.append((changed, step))
    by = []
    for changed, step in changes:
        other = changed.read_off(below_tip_px)
        by.append((0.0, 0.0) if other is None else ((other.tip - read.tip) / step, (other.edge - read.edge) / step))
    jacobian = np.array(by).T
    return MeasuringPoint(read.tip, read.apex, read.edge, read.slope, jacobian @ chain.covariance @ jacobian.T)


def _misfit(residual: Floats, variance: float) -> float:
    """Twice the negative logarithm of the points' likelihood, up to a constant."""
    return float(np.sum(-2.0 * np.log(np.exp(-0.5 * residual**2 / variance) + np.exp(-0.5 * DUST))))


def _level(chain: Chain) -> int | None:
    """Index of a top side that is level within its uncertainty, or None."""
    sides, corners = chain.polygon.sides, chain.polygon.corners()
    k = 1 + int(np.argmin([abs(side.angle) for side in sides[1:-1]]))
    if corners is None:
        return None
    rise = abs(corners[k].vertex[1] - corners[k - 1].vertex[1])
    u_angle = float(np.sqrt(chain.covariance[len(sides) + k, len(sides) + k]))
    return k if abs(sides[k].angle) < LEVEL_IN_SIGMAS * u_angle and rise < LEVEL_LIMIT_PX else None
