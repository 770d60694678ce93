"""Step 6, the finger's end: the outline as three straight sides joined by two round corners.

A printed or cut finger ends in an inner flank, a top and an outer flank, each straight, with a fillet of any radius
(sharp to fully round) between them. Fitting this shape to the edge points of a finger as one thing uses every
point, needs no window, and gives the tip and the inner edge together with their joint covariance.

Blur moves the half-level of a curved edge towards the inside of the curve by sigma^2 kappa / 2 (kappa the
curvature); near the end of a fillet it feels part of the curvature only. The points are compared with the
outline moved in that way, so what is found is the outline before the blur.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.vision.finger_shape import INNER_R, OUTER_R, compared, corner
from fingervision.vision.median import middle
from fingervision.vision.outline_points import OutlinePoints

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Tukey's biweight at 95 % efficiency (Holland & Welsch, Commun. Stat. A6, 1977), and the robust standard deviation.
BIWEIGHT_REACH, SIGMAS_IN_MEDIAN = 4.685, 1.4826
# How often the outline is looked at anew, and how many times the biweight's own reach a residual may have in the one or
# two steps of each look: the first forgive what the first guess got wrong, only the last tell dust from shape.
LOOKS = ((100.0, 0.0), (10.0, 10.0), (1.5, 1.0), (1.0, 1.0))
# A shape whose residuals spread over more than so many sigma is no shape.
WORST_MISFIT = 1e3
# Rounding leaves no less of a pivot than this.
SMALLEST_PIVOT = 1e-15


@dataclass(frozen=True, slots=True, eq=False)
class FingerEnd:
    """The fitted end of a finger.

    Parameters
    ----------
    parameters : ndarray of float, shape (8,)
        Offsets, slopes and fillet radii of the inner and outer flank, offset and slope of the top.
    covariance : ndarray of float, shape (8, 8)
        From the points' own uncertainties.
    origin : ndarray of float, shape (2,)
        x0 of the top line and y0 of the flanks.
    misfit : float
        Robust ratio of the residuals' spread to the points' uncertainties; 1 for a perfect shape.
    residual : ndarray of float, shape (n,)
        Normal distance of every point in units of its uncertainty.
    robust : ndarray of float, shape (n,)
        Weight of every point, between 0 and 1.
    """

    parameters: Floats
    covariance: Floats
    origin: Floats
    misfit: float
    residual: Floats
    robust: Floats


def fit_finger_end(points: OutlinePoints, start: Floats, origin: Floats, u_prior: Floats) -> FingerEnd:
    """Least squares with Tukey's biweight over the points of a finger.

    Parameters
    ----------
    points : OutlinePoints
        Sub-pixel outline.
    start : ndarray of float, shape (8,)
        First guess.
    origin : ndarray of float, shape (2,)
        x0 and y0 of the lines.
    u_prior : ndarray of float, shape (8,)
        Weak knowledge that keeps a parameter in place where no point speaks of it.
    """
    fitted = _fit(points.x, points.y, points.u, points.is_row, points.blur, start, origin, u_prior)
    p, covariance, misfit, residual, robust = fitted
    return FingerEnd(p, covariance, origin, misfit, residual, robust)


@compiled
def _fit(
    x: Floats, y: Floats, u: Floats, is_row: Flags, blur: Floats, start: Floats, origin: Floats, u_prior: Floats
) -> tuple[Floats, Floats, float, Floats, Floats]:
    n, parameters = x.size, start.size
    p, move, right = start.copy(), np.zeros(parameters), np.empty(parameters)
    normal, covariance = np.empty((parameters, parameters)), np.empty((parameters, parameters))
    misfit, robust, residual, magnitude = 1.0, np.zeros(n), np.zeros(n), np.empty(n)
    is_outer = x <= 0.5 * (corner(p, origin, 0).centre_x + corner(p, origin, 1).centre_x)
    seen = compared(p, origin, x, y, u, is_row, is_outer, blur)
    for first_patience, second_patience in LOOKS:
        distance, jacobian, counts = seen
        # While the weights settle, the outline follows its parameters in a straight line.
        move[:] = 0.0
        for patience in (first_patience, second_patience):
            if patience == 0.0:
                continue
            counted = 0
            for i in range(n):
                residual[i] = distance[i]
                for a in range(parameters):
                    residual[i] += jacobian[i, a] * move[a]
                if counts[i]:
                    magnitude[counted] = abs(residual[i])
                    counted += 1
            misfit = min(max(SIGMAS_IN_MEDIAN * middle(magnitude[:counted]), 1.0), WORST_MISFIT)
            cut = BIWEIGHT_REACH * patience * misfit
            normal[:] = 0.0
            for a in range(parameters):
                normal[a, a] = u_prior[a] ** -2
                right[a] = (p[a] - start[a]) * normal[a, a]
            for i in range(n):
                robust[i] = 0.0
                if not counts[i] or abs(residual[i]) >= cut:
                    continue
                robust[i] = (1.0 - (residual[i] / cut) ** 2) ** 2
                for a in range(parameters):
                    if jacobian[i, a] == 0.0:
                        continue  # most points see two parameters alone
                    weighted = robust[i] * jacobian[i, a]
                    right[a] += weighted * distance[i]
                    for b in range(a + 1):
                        normal[a, b] += weighted * jacobian[i, b]
            covariance = _inverse(normal)
            for a in range(parameters):
                move[a] = 0.0
                for b in range(parameters):
                    move[a] -= covariance[a, b] * right[b]
        for a in range(parameters):
            p[a] += move[a]
        p[INNER_R], p[OUTER_R] = max(p[INNER_R], 0.0), max(p[OUTER_R], 0.0)
        seen = compared(p, origin, x, y, u, is_row, is_outer, blur)
    return p, covariance, misfit, seen[0], robust


@compiled
def _inverse(lower: Floats) -> Floats:
    """Inverse of a symmetric positive matrix from its lower half (Gauss and Jordan), brought to one scale first."""
    n = lower.shape[0]
    scale, a = np.empty(n), np.empty((n, n))
    for i in range(n):
        scale[i] = 1.0 / np.sqrt(lower[i, i])
    for i in range(n):
        for j in range(n):
            a[i, j] = lower[max(i, j), min(i, j)] * scale[i] * scale[j]
    for k in range(n):
        pivot = max(a[k, k], SMALLEST_PIVOT)
        a[k, k] = 1.0
        for j in range(n):
            a[k, j] /= pivot
        for i in range(n):
            if i != k:
                factor = a[i, k]
                a[i, k] = 0.0
                for j in range(n):
                    a[i, j] -= factor * a[k, j]
    for i in range(n):
        for j in range(n):
            a[i, j] *= scale[i] * scale[j]
    return a
