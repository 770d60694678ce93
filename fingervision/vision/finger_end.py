"""Step 6, the finger's end: fit of three straight sides and two round corners to its outline.

A printed or cut finger ends in an inner flank, a top and an outer flank, each straight, with a fillet of any radius
(from sharp to fully round) between them. The shape of three sides and two fillets is fitted to all edge points of a
finger, and gives the tip and the inner edge with their joint covariance.

Blur moves the half-level of a curved edge towards the centre of curvature by sigma^2 kappa / 2 (kappa the curvature),
and by less near the end of a fillet. The points are compared with the model's outline displaced by the blur, so that
the fitted outline is that before blurring.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.finger_shape import INNER_C, INNER_R, OUTER_C, OUTER_R, PARAMETERS
from fingervision.vision.outline_points import OutlinePoints

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Tukey's biweight at 95 % efficiency (Holland & Welsch, Commun. Stat. A6, 1977), and the robust standard deviation.
BIWEIGHT_REACH, SIGMAS_IN_MEDIAN = 4.685, 1.4826
# Rounds of the fit, each with one or two steps: factor on the reach of the biweight in each step (0: no step). The
# first rounds tolerate errors of the initial estimate; only the last rounds reject dust.
LOOKS = ((100.0, 0.0), (10.0, 10.0), (1.5, 1.0), (1.0, 1.0))
# Largest spread of the residuals, in units of the points' uncertainties.
WORST_MISFIT = 1e3
# Other starting values are tried if this number of points is left unexplained; the new fit is used if the sum of its
# weights is larger by this factor, and its misfit at most this multiple.
FEWEST_ASIDE, LEAST_GAIN, MORE_MISFIT = 3, 1.5, 1.3
# Further starting radii (shares of the finger's width).
OTHER_RADII = (0.1, 0.2, 0.35)
# Misfit above which the outline has another shape for any radii.
NO_SHAPE = 4.0
# Least relative pivot of the linear solution; a smaller pivot is rounding.
SMALLEST_PIVOT = 1e-15

_fit = loop("finger_end_fit")


@dataclass(frozen=True, slots=True, eq=False)
class FingerEnd:
    """The fitted end of a finger.

    Parameters
    ----------
    parameters : ndarray of float, shape (8,)
        Offsets, slopes and fillet radii of the inner and outer flank, offset and slope of the top.
    covariance : ndarray of float, shape (8, 8)
        Covariance of the parameters, from the points' own uncertainties.
    origin : ndarray of float, shape (2,)
        Reference coordinates: x0 of the top line and y0 of the flanks.
    misfit : float
        Robust ratio of the residuals' spread to the points' uncertainties; 1 for an exact shape.
    residual : ndarray of float, shape (n,)
        Normal distance of every point in units of its uncertainty.
    robust : ndarray of float, shape (n,)
        Robust weight of every point, between 0 and 1.
    """

    parameters: Floats
    covariance: Floats
    origin: Floats
    misfit: float
    residual: Floats
    robust: Floats


def fit_finger_end(points: OutlinePoints, start: Floats, origin: Floats, u_prior: Floats) -> FingerEnd:
    """Fit the finger's end to the points by least squares with Tukey's biweight.

    Parameters
    ----------
    points : OutlinePoints
        Sub-pixel outline of the finger.
    start : ndarray of float, shape (8,)
        Initial estimate of the parameters.
    origin : ndarray of float, shape (2,)
        Reference coordinates x0 and y0 of the lines.
    u_prior : ndarray of float, shape (8,)
        Standard uncertainties of weak priors, which fix parameters that no point determines.
    """
    p, covariance = np.empty(PARAMETERS), np.empty((PARAMETERS, PARAMETERS))
    residual, robust = np.empty(points.x.size), np.empty(points.x.size)
    seen = (points.x, points.y, points.u, points.is_row, points.blur)
    misfit = _fit(*seen, start, origin, u_prior, p, covariance, residual, robust)
    return FingerEnd(p, covariance, origin, misfit, residual, robust)


def fit_from_any_radius(points: OutlinePoints, start: Floats, origin: Floats, u_prior: Floats) -> FingerEnd:
    """Repeat the fit from other starting radii of the corners if it leaves points unexplained.

    With a wrong fillet radius, the points of the corner look like outliers (dust). Points beside a corner without a
    fillet do not count in the fit, but are explained if the fitted shape passes through them.

    The initial estimate of a radius assumes a right-angled corner, which a tapered finger does not have.
    """
    best = fit_finger_end(points, start, origin, u_prior)
    inner, outer = best.parameters[[INNER_R, OUTER_R]]
    aside = best.robust <= 0.0
    if inner == outer == 0.0:
        aside &= np.abs(best.residual) >= BIWEIGHT_REACH * best.misfit
    if np.count_nonzero(aside) < FEWEST_ASIDE or best.misfit > NO_SHAPE:
        return best
    width = abs(best.parameters[INNER_C] - best.parameters[OUTER_C])
    for radius in (0.0, *(share * width for share in OTHER_RADII), min(inner, outer), max(inner, outer)):
        again = start.copy()
        again[[INNER_R, OUTER_R]] = radius
        other = fit_finger_end(points, again, origin, u_prior)
        if not _has_settled(other):
            continue
        is_better = other.misfit <= MORE_MISFIT * best.misfit and other.robust.sum() > best.robust.sum() + LEAST_GAIN
        if is_better or not _has_settled(best):
            best = other
    return best


def _has_settled(end: FingerEnd) -> bool:
    """Whether the points used in the last step of the fit are still near the fitted shape after this step.

    The fit's last weights are those computed before the last step. After a step to another shape, the points that
    counted before are far from the new shape.
    """
    return float(end.robust @ end.residual**2) < (BIWEIGHT_REACH * end.misfit) ** 2 * float(end.robust.sum())
