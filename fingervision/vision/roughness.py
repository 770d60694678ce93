"""Roughness and printed texture: how far an edge strays from its mean line, and over which length along itself.

Neighbouring points of a rough edge err together, so that many of them know less than they seem to. The flanks say how
far and over which length: about a parabola of its own, each flank is white noise of the points plus a stationary
process (Matern, smoothness 5/2: its tails are a little longer than a Gaussian's, so rather too wide than too narrow),
whose standard deviation and length have the restricted likelihood of Patterson and Thompson (Biometrika 58, 1971, 545):
what the parabola takes up of a long wave is accounted for. The covariance is the mean over that likelihood and not its
maximum: a few waves do not tell their length.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.vision.finger_end import FingerEnd
from fingervision.vision.finger_shape import compared, on_flanks
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.profile_lines import INNER_SIDE, OUTER_SIDE

Floats = NDArray[np.float64]

# Standard deviations (pixels) and lengths (pixels along the edge) that are tried. The shortest length is white: points
# that are less sure than their own noise says, each by itself. Longer waves than the longest are the finger's shape.
DEVIATIONS_PX = np.geomspace(0.03, 0.9, 12)
LENGTHS_PX = np.array([0.3, 1.0, 1.5, 2.3, 3.5, 5.3, 8.0, 12.0])
# Each flank has its own level, slope and curvature. It needs so many points, and of more than so many every second one
# is looked at, or every third.
OWN, FEWEST_POINTS, MOST_POINTS = 3, 12, 40
# Points whose residuals about a shape spread by more than this (in units of their own uncertainty) are looked at, and
# roughness that is not this much likelier than none (logarithm; about four standard uncertainties) is none.
SUSPECT, SIGNIFICANT = 1.5, 8.0
# The covariance is tabulated for whole pixels of distance up to so many.
FARTHEST_PX = 64


@dataclass(frozen=True, slots=True, eq=False)
class Roughness:
    """How an edge strays from its mean line.

    Parameters
    ----------
    covariance : ndarray of float, shape (FARTHEST_PX + 1,)
        Of the normal distances of two points of the edge that are so many pixels apart (pixels squared).
    """

    covariance: Floats

    @property
    def deviation_px(self) -> float:
        """Standard deviation about the mean line."""
        return float(np.sqrt(self.covariance[0]))

    @property
    def shared_px(self) -> float:
        """Length of edge that counts as one independent point: the integral of the correlation."""
        return float((2.0 * self.covariance.sum() - self.covariance[0]) / self.covariance[0])


def roughness(points: tuple[OutlinePoints, OutlinePoints], ends: tuple[FingerEnd, FingerEnd]) -> Roughness | None:
    """What the flanks of both fingers show of it; None where they show nothing.

    Parameters
    ----------
    points : (OutlinePoints, OutlinePoints)
        Sub-pixel outlines of the left and of the right finger.
    ends : (FingerEnd, FingerEnd)
        The shapes that were fitted to them.
    """
    if max(end.misfit for end in ends) < SUSPECT:
        return None
    likelihood, seen = np.zeros((DEVIATIONS_PX.size, LENGTHS_PX.size)), 0
    nothing = 0.0
    for p, end in zip(points, ends, strict=True):
        is_flank = on_flanks(end.parameters, end.origin, p.x, p.y) & (end.robust > 0.0)
        for side in (INNER_SIDE, OUTER_SIDE):
            chosen = np.flatnonzero(is_flank & (p.side == side))
            chosen = chosen[:: -(-chosen.size // MOST_POINTS) or 1]
            if chosen.size < FEWEST_POINTS:
                continue
            seen += 1
            along, across, variance = p.y[chosen], p.x[chosen], p.u[chosen] ** 2
            nothing += _none(along, across, variance)
            likelihood += _likelihood(along, across, variance, DEVIATIONS_PX, LENGTHS_PX)
    if not seen or likelihood.max() < nothing + SIGNIFICANT:
        return None
    weight = np.exp(likelihood - likelihood.max())
    weight /= weight.sum()
    distance = np.arange(FARTHEST_PX + 1.0)
    covariance = np.zeros(distance.size)
    for j, length in enumerate(LENGTHS_PX):
        covariance += float(weight[:, j] @ DEVIATIONS_PX**2) * _correlation(distance, length)
    return Roughness(covariance)


def with_roughness(points: OutlinePoints, found: Roughness) -> OutlinePoints:
    """The same points, each as unsure of the mean line as the edge strays from it."""
    u = np.hypot(points.u, found.deviation_px)
    return OutlinePoints(points.x, points.y, u, points.side, points.blur)


def shared_along(
    points: OutlinePoints, end: FingerEnd, u_prior: Floats, bare: OutlinePoints, found: Roughness
) -> FingerEnd:
    """The fitted end with the covariance that points have which stray together.

    Parameters
    ----------
    points, end : OutlinePoints, FingerEnd
        Points with their roughness, and the shape that was fitted to them.
    u_prior : ndarray of float, shape (8,)
        The weak knowledge that it was fitted with.
    bare : OutlinePoints
        The same points with their own noise alone.
    found : Roughness
        What they share.
    """
    _, jacobian, _ = compared(
        end.parameters, end.origin, points.x, points.y, points.u, points.is_row, points.side == OUTER_SIDE, points.blur
    )
    influence = np.ascontiguousarray(end.covariance @ (jacobian * end.robust[:, None]).T)
    covariance = _propagated(influence, points.x, points.y, points.u, bare.u, found.covariance)
    silent = (end.covariance / u_prior**2) @ end.covariance
    return FingerEnd(end.parameters, covariance + silent, end.origin, 1.0, end.residual, end.robust)


@compiled
def _correlation(distance: Floats, length: float) -> Floats:
    scaled = np.sqrt(5.0) * np.abs(distance) / length
    return np.asarray((1.0 + scaled + scaled * scaled / 3.0) * np.exp(-scaled))


@compiled
def _basis(along: Floats) -> Floats:
    t = along - along.mean()
    t = t / max(np.abs(t).max(), 1.0)
    basis = np.ones((along.size, OWN))
    for k in range(1, OWN):
        basis[:, k] = basis[:, k - 1] * t
    return basis


@compiled
def _restricted(basis: Floats, across: Floats, covariance: Floats) -> float:
    """Logarithm of the restricted likelihood, but for a constant."""
    lower = np.linalg.cholesky(covariance)
    whitened = np.linalg.solve(lower, np.column_stack((basis, across)))
    x, y = np.ascontiguousarray(whitened[:, :OWN]), np.ascontiguousarray(whitened[:, OWN])
    normal = x.T @ x
    left = y - x @ np.linalg.solve(normal, x.T @ y)
    log_determinant = 2.0 * np.log(np.diag(lower)).sum() + np.log(np.linalg.det(normal))
    return float(-0.5 * (log_determinant + left @ left))


@compiled
def _none(along: Floats, across: Floats, variance: Floats) -> float:
    return _restricted(_basis(along), across, np.diag(variance))


@compiled
def _likelihood(along: Floats, across: Floats, variance: Floats, deviations: Floats, lengths: Floats) -> Floats:
    """Logarithm of the restricted likelihood of every deviation and length."""
    basis = _basis(along)
    found = np.empty((deviations.size, lengths.size))
    noise = np.diag(variance)
    for j in range(lengths.size):
        correlation = np.empty((along.size, along.size))
        for i in range(along.size):
            correlation[i] = _correlation(along - along[i], lengths[j])
        for i in range(deviations.size):
            found[i, j] = _restricted(basis, across, noise + deviations[i] ** 2 * correlation)
    return found


@compiled
def _propagated(influence: Floats, x: Floats, y: Floats, u: Floats, u_own: Floats, covariance: Floats) -> Floats:
    """Covariance of the parameters for points that share what they stray by."""
    n = x.size
    errors = np.empty((n, n))
    last = covariance.size - 1
    for i in range(n):
        for j in range(n):
            distance = np.sqrt((x[i] - x[j]) ** 2 + (y[i] - y[j]) ** 2)
            whole = int(distance)
            if whole >= last:
                errors[i, j] = 0.0
                continue
            part = distance - whole
            errors[i, j] = ((1.0 - part) * covariance[whole] + part * covariance[whole + 1]) / (u[i] * u[j])
        errors[i, i] += (u_own[i] / u[i]) ** 2
    return influence @ errors @ influence.T
