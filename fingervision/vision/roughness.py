"""Roughness and printed texture: deviation of an edge from its mean line, with its correlation along the edge.

Neighbouring points of a rough edge have correlated errors, so that the variance of their mean is larger than for
independent points. Deviation and correlation length are estimated from the flanks. Each flank is modelled as a
parabola, plus white noise of the points, plus a stationary process with a Matern covariance of smoothness 5/2 (whose
tails are a little longer than a Gaussian's, so that the uncertainty is rather too large than too small). The standard
deviation and the correlation length of the process are estimated by the restricted likelihood of Patterson and Thompson
(Biometrika 58, 1971, 545), which accounts for the part of a long wave that the parabola absorbs. The covariance is a
mean over all tried values, weighted by their likelihood, because a few waves do not determine the correlation length
well.

Measure rough flanks over a longer stretch, so that long-wavelength roughness averages out.

A finger's flank is straight near its tip; farther down it may bend or end. The longer flank is therefore used only if
its result agrees with that of the part near the tip and has a smaller uncertainty (Hausman test, Econometrica 46, 1978,
1251: the variance of the difference between an efficient and a less efficient estimate is the difference of their
variances).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import isnan, sqrt

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.camera import Roughness
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.domain.loops import loop
from fingervision.domain.one_thread import one_thread
from fingervision.vision.finger_end import FingerEnd
from fingervision.vision.finger_shape import INNER_R, OUTER_R, compared, on_flanks, seen
from fingervision.vision.fingers import CoarseFinger, CoarseFingers
from fingervision.vision.flanks import follow_down
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.profile_lines import INNER_SIDE, OUTER_SIDE

Floats = NDArray[np.float64]

# Standard deviations (pixels) and correlation lengths (pixels along the edge) that are tried. The standard deviations
# differ by a fifth, the precision with which about thirty waves determine them. A blur of 1 px correlates an edge over
# 2 sqrt(pi) px, the integral of the correlation for a length of 1.5; shorter lengths would be indistinguishable from
# white noise. Longer waves, tried beside them, belong to the finger's shape: a flank that is curved, but no parabola.
DEVIATIONS_PX = np.geomspace(0.03, 0.9, 18)
LENGTHS_PX = np.array([1.5, 2.3, 3.5, 5.3, 8.0, 12.0])
LENGTHS_OF_SHAPE_PX = np.array([18.0, 27.0, 40.0])
# Number of parameters of each flank (level, slope and curvature), least number of its points, and number of points
# above which only every second or third point is used.
OWN, FEWEST_POINTS, MOST_POINTS = 3, 12, 40
# Spread of the residuals (in units of the points' uncertainties) above which roughness is estimated; logarithm of the
# likelihood ratio above which roughness is significant (about four standard uncertainties), and above which it is
# possible (more than two parameters explain by chance; Akaike, doi:10.1109/TAC.1974.1100705).
SUSPECT, SIGNIFICANT, POSSIBLE = 1.5, 8.0, 2.0
# Largest distance (pixels) for which the covariance is tabulated.
FARTHEST_PX = 64

# Largest number of Gauss-Newton steps from the robust fit to the best linear estimate, squared length of a step (in
# standard uncertainties) that is the last one, and weight that is regarded as zero.
STEPS, SETTLED, LEAST_WEIGHT = 5, 1e-4, 1e-4

_likelihood = loop("roughness_likelihood")
_errors = loop("roughness_errors")
_factor, _whiten = loop("roughness_factor"), loop("roughness_whiten")


def roughness(
    points: Sequence[OutlinePoints], ends: Sequence[FingerEnd], known: Roughness | None = None
) -> Roughness | None:
    """Estimate the roughness from the flanks of the fingers; None if the flanks are smooth.

    Parameters
    ----------
    points : sequence of OutlinePoints
        Sub-pixel outlines of the fingers.
    ends : sequence of FingerEnd
        Shapes fitted to the outlines.
    known : Roughness or None
        What the recording has told, which holds where the flanks are not smooth.
    """
    if max(end.misfit for end in ends) < SUSPECT:
        return None
    if known is not None:
        return known
    lengths = np.concatenate([LENGTHS_PX, LENGTHS_OF_SHAPE_PX])
    likelihood, seen = np.zeros((DEVIATIONS_PX.size, lengths.size)), 0
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
            own = np.empty_like(likelihood)
            is_sound, none = _likelihood(along, across, variance, DEVIATIONS_PX, lengths, own)
            if not is_sound:
                msg = "the covariance of a flank's points must be positive"
                raise np.linalg.LinAlgError(msg)
            nothing += none
            likelihood += own
    rough, shape = likelihood[:, : LENGTHS_PX.size], float(likelihood[:, LENGTHS_PX.size :].max())
    if seen and rough.max() < max(nothing + POSSIBLE, shape - POSSIBLE):
        return None
    is_told = bool(rough.max() > max(nothing + SIGNIFICANT, shape))
    weight = np.exp(rough - rough.max())
    weight /= weight.sum()
    distance = np.arange(FARTHEST_PX + 1.0)
    covariance = np.zeros(distance.size)
    for j, length in enumerate(LENGTHS_PX):
        covariance += float(weight[:, j] @ DEVIATIONS_PX**2) * _correlation(distance, length)
    return Roughness(covariance, is_told)


def with_roughness(points: OutlinePoints, found: Roughness, end: FingerEnd) -> OutlinePoints:
    """Return the points with their variances increased by the variance of the edge about its mean line.

    Roughness displaces an edge along its normal, and a point is found along a line of pixels: at a slant the point
    moves by more (1.4 times as far on a corner at 45 degrees).

    Parameters
    ----------
    points, end : OutlinePoints, FingerEnd
        Points with the uncertainty of their own noise, and the shape fitted to them.
    found : Roughness
        Roughness of the edge.
    """
    _, slant = seen(end.parameters, end.origin, points.x, points.y, points.is_row)
    u = np.hypot(points.u, found.deviation_px / slant)
    return OutlinePoints(points.x, points.y, u, points.side, points.blur)


def best_linear(
    points: OutlinePoints, end: FingerEnd, start: Floats, u_prior: Floats, bare: OutlinePoints, found: Roughness
) -> FingerEnd:
    """The finger end of least variance under deviations correlated along the edge (generalised least squares).

    The best linear unbiased estimate (Aitken, Proc. R. Soc. Edinburgh 55, 1936, 42, doi:10.1017/S0370164600014346) by
    Gauss-Newton steps from the robust fit. Points that the robust fit rejected (dust) stay rejected, and the own
    variance of a point with a smaller weight is increased in proportion.

    Parameters
    ----------
    points, end : OutlinePoints, FingerEnd
        Points whose uncertainties include roughness, and the shape fitted to them.
    start, u_prior : ndarray of float, shape (8,)
        Means and standard uncertainties of the weak priors of the robust fit.
    bare : OutlinePoints
        The same points with the uncertainty of their own noise only.
    found : Roughness
        Roughness of the edge.
    """
    x, y, is_row, parameters = points.x, points.y, points.is_row, end.parameters
    is_outer, slant = seen(parameters, end.origin, x, y, is_row)
    errors = np.empty((x.size, x.size))
    _errors(x, y, points.u * slant, bare.u * slant, found.covariance, errors)
    errors[np.diag_indices(x.size)] += 1.0 / np.maximum(end.robust, LEAST_WEIGHT) - 1.0
    whitened = _whitening(errors, float(np.min((bare.u / points.u) ** 2)))
    prior = np.diag(1.0 / u_prior**2)
    for _ in range(STEPS):
        residual, jacobian, _ = compared(parameters, end.origin, x, y, points.u, is_row, is_outer, points.blur)
        white = whitened(np.column_stack([jacobian, residual]))
        covariance = np.asarray(np.linalg.inv(white[:, :-1].T @ white[:, :-1] + prior), dtype=np.float64)
        gradient = white[:, :-1].T @ white[:, -1] + prior @ (parameters - start)
        parameters = parameters - covariance @ gradient
        parameters[[INNER_R, OUTER_R]] = np.maximum(parameters[[INNER_R, OUTER_R]], 0.0)
        if gradient @ covariance @ gradient < SETTLED:
            break
    residual, _, _ = compared(parameters, end.origin, x, y, points.u, is_row, is_outer, points.blur)
    return FingerEnd(parameters, covariance, end.origin, 1.0, residual, end.robust)


def _whitening(errors: Floats, least_variance: float) -> Callable[[Floats], Floats]:
    """Transformation to white errors of unit variance, from the errors' covariance in units of the points' variances.

    The error of no point, and of no combination of them, can have a smaller variance than the points' noise
    (`least_variance`), but rounding errors of the tabulated covariance may cause smaller values. Cholesky's
    decomposition takes a tenth of the time of eigenvalues, and is used if the variance of every point given those
    before it is larger.
    """
    factor = errors.copy()
    if _factor(factor, least_variance):

        def whitened(columns: Floats) -> Floats:
            white = np.ascontiguousarray(columns)
            _whiten(factor, white)
            return white

        return whitened
    with one_thread():
        values, vectors = np.linalg.eigh(errors)
    whitening = (vectors / np.sqrt(np.maximum(values, least_variance))).T
    return lambda columns: whitening @ columns


def _correlation(distance: Floats, length: float) -> Floats:
    scaled = np.sqrt(5.0) * np.abs(distance) / length
    return np.asarray((1.0 + scaled + scaled * scaled / 3.0) * np.exp(-scaled))


# Length of the longer flank: the measuring height plus this number of pixels below the tip.
LONG_PX = 180.0
# Largest difference of two results that agree, in standard uncertainties of the difference.
AGREES = 2.5


def with_longer_flanks(fingers: CoarseFingers, below_tip_px: float) -> CoarseFingers:
    """Return the fingers with their outlines extended towards the roots; a finger that holds a part is not changed."""
    left, right = (
        finger if finger.hidden.size else _longer(finger, below_tip_px + LONG_PX)
        for finger in (fingers.left, fingers.right)
    )
    return replace(fingers, left=left, right=right, are_long=True)


def is_surer(longer: GapMeasurement | NoGap, near: GapMeasurement) -> bool:
    """Whether the result from longer flanks agrees with that from the near part and has a smaller uncertainty.

    If the near part is too short to determine its roughness, its uncertainty does not include roughness; it is then
    replaced by longer flanks whose roughness is determined.
    """
    if isinstance(longer, GapMeasurement) and isnan(near.roughness_px):
        return longer.roughness_px > 0.0
    if not isinstance(longer, GapMeasurement) or longer.u_gap_px >= near.u_gap_px:
        return False
    return abs(longer.gap_px - near.gap_px) <= AGREES * sqrt(near.u_gap_px**2 - longer.u_gap_px**2)


def _longer(finger: CoarseFinger, reach_px: float) -> CoarseFinger:
    top = finger.top
    start, stop = (follow_down(top.outline, top.index, step, top.along_px + reach_px) for step in (-1, 1))
    piece = top.outline[start : stop + 1]
    if finger.inner_sign * (piece[0, 0] - piece[-1, 0]) < 0:
        piece = piece[::-1]
    return CoarseFinger(np.ascontiguousarray(piece), finger.inner_sign, top)
