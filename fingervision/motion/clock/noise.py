"""Noise of the gap about a fitted motion: its autocorrelation, and its increase where the input is uncertain."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array
from fingervision.effects.play_operator import play
from fingervision.motion.clock.joint_fit import Fit
from fingervision.motion.clock.motion_model import Motion, Noise
from fingervision.motion.time_stamps import frame_resolution_s, input_error_of_stamps

MOST_ORDER = 4
"""Largest order; four terms approximate an autoregression plus white noise sufficiently."""
FRAMES_AN_ORDER = 25
"""Least number of frames per term."""
LARGEST_ROOT = 0.98
"""Largest sum of the terms' absolute values; above it, the residual is practically a random walk, and the terms are
scaled down.
"""


def autoregression(residual_mm: Array) -> Array:
    """Fit an autoregression by Burg's method; the order follows from Akaike's criterion with Hurvich's correction.

    Parameters
    ----------
    residual_mm : ndarray of float, shape (n,)
        Residuals in order of time.

    Returns
    -------
    ndarray of float, shape (p,)
        Coefficients a_k of y_t = sum of a_k y_(t-k) + white noise; empty for white noise.
    """
    n = residual_mm.size
    forward = backward = residual_mm - residual_mm.mean()
    power = float(forward @ forward) / max(n, 1)
    terms = np.empty(0)
    best, lowest = terms, n * np.log(max(power, 1e-30)) + 2.0
    for order in range(1, min(MOST_ORDER, n // FRAMES_AN_ORDER) + 1):
        ahead, behind = forward[1:], backward[:-1]
        both = float(ahead @ ahead + behind @ behind)
        if both == 0.0:
            break
        reflection = 2.0 * float(ahead @ behind) / both
        terms = np.append(terms - reflection * terms[::-1], reflection)
        forward, backward = ahead - reflection * behind, behind - reflection * ahead
        power *= 1.0 - reflection**2
        criterion = n * np.log(max(power, 1e-30)) + 2.0 * (order + 1) * n / max(n - order - 2, 1)
        if criterion < lowest:
            best, lowest = terms, criterion
    total = float(np.abs(best).sum())
    return best * (LARGEST_ROOT / total) if total > 1.0 and float(best.sum()) > LARGEST_ROOT else best


MEDIAN_CHI_SQUARE = 0.4549
"""Median of chi-square with one degree of freedom."""
TRIED = 60
"""Number of variances that are tried, over five decades; neighbouring values differ by a fifth, which is about the
uncertainty of a variance from a hundred frames.
"""
CORRELATED = 0.15
"""Lower bound of the ratio of the variance in second differences to 6 times the noise variance: for noise with
correlation rho from frame to frame, second differences have 6 - 8 rho + 2 rho^2 times the noise variance, which is 1.4
of 6 for rho = 0.7 and 0.8 of 6 for rho = 0.8."""
WRONG, WIDER = 0.01, 100.0
"""Share of frames that may be wrong, and ratio of their variance to that of the others (ten standard deviations)."""


def noise_of(motion: Motion, found: Fit) -> Noise:
    """Estimate the noise from the residuals of a fit.

    The variance of a frame's residual is that of the measured gap, equal for all frames, plus the squared effect of the
    input's uncertainty between two rows of the log. The variance of the measured gap is estimated by maximum likelihood
    from the residuals.
    """
    own_mm, shared_mm, stretch = of_input(motion, found)
    input_mm2 = own_mm**2
    residual_mm, taken = _without_shared(found.residual_mm - np.median(found.residual_mm), stretch, shared_mm)
    even_mm2 = max(even_variance(residual_mm**2, input_mm2) * taken, _least_variance(residual_mm))
    shrunk = residual_mm * np.sqrt(even_mm2 / (even_mm2 + input_mm2))
    terms = autoregression(np.clip(shrunk, -4.0 * np.sqrt(even_mm2), 4.0 * np.sqrt(even_mm2)))
    order = terms.size
    white_mm2 = even_mm2 * max(1.0 - _explained(terms, shrunk), 1e-3)
    extra = input_mm2[order:].copy()
    # The autoregression carries the error of the preceding stretch into the first frames of a stretch.
    carried_mm = np.zeros(extra.size)
    for k, share in enumerate(terms, start=1):
        past = slice(order - k, input_mm2.size - k)
        extra += share**2 * input_mm2[past]
        carried_mm += abs(share) * np.where(stretch[past] != stretch[order:], shared_mm[past], 0.0)
    extra += carried_mm**2
    weights = 1.0 / np.sqrt(1.0 + extra / white_mm2)
    if not shared_mm.any():
        return Noise(terms, weights, variance_mm2=white_mm2)
    starts = np.flatnonzero(np.diff(stretch[order:], prepend=-1))
    course = weights * (1.0 - float(terms.sum()))
    lengths = np.sqrt(np.add.reduceat(course**2, starts))
    counts = np.diff(np.append(starts, course.size))
    ratio = (shared_mm[order:][starts] * lengths) ** 2 / white_mm2
    shrink = 1.0 - 1.0 / np.sqrt(1.0 + ratio)
    return Noise(terms, weights, starts, course / np.repeat(lengths, counts), shrink, white_mm2)


def of_input(motion: Motion, found: Fit) -> tuple[Array, Array, NDArray[np.intp]]:
    """Effect of the input's uncertainty on the gap of each frame.

    Returns
    -------
    own_mm, shared_mm : ndarray of float, shape (n,)
        Standard uncertainty of the predicted gap due to the path between rows and the rounding of the frame's time,
        and due to the common error of a stretch.
    stretch : ndarray of int, shape (n,)
        Stretch of the log to which each frame belongs.
    """
    log_s = motion.log_time_s(found.at)
    after = np.clip(np.searchsorted(motion.drive.time_s, log_s), 0, motion.path.u_mm.size - 1)
    slope = abs(found.scale) / max(0.5 * float(np.ptp(motion.drive.input_mm)), 1e-12)
    stretch = _stretch_of(motion, found, log_s)
    inputs_mm = np.interp(log_s, motion.drive.time_s, motion.drive.input_mm)
    rounded_mm = input_error_of_stamps(
        inputs_mm, motion.time_s, (slice(0, log_s.size),), frame_resolution_s(motion.time_s)
    )
    return slope * np.hypot(motion.path.u_mm[after], rounded_mm), slope * motion.path.shared.u_mm[stretch], stretch


SEEN_SHARED = 0.5
"""Least shared error relative to the residuals' standard deviation; smaller errors cannot be detected, and subtracting
means would whiten the noise.
"""


def _stretch_of(motion: Motion, found: Fit, log_s: Array) -> NDArray[np.intp]:
    """Index of the stretch of the log whose error applies to each frame; shape (n,), never decreasing.

    While the motion crosses the play, the gap has the error of the preceding stop.
    """
    shared, drive, at = motion.path.shared, motion.drive, found.at
    own = np.searchsorted(shared.begin_s, log_s, side="right")
    if at.play_mm == 0.0 or not shared.begin_s.size:
        return own
    states = play(drive.input_mm, at.play_mm, at.start)
    changed = np.abs(np.diff(states, prepend=states[0])) > 0.0
    last = np.maximum.accumulate(np.where(changed, np.arange(states.size), 0))
    before = np.clip(np.searchsorted(drive.time_s, log_s, side="right") - 1, 0, states.size - 1)
    inputs = np.interp(log_s, drive.time_s, drive.input_mm)
    is_held = np.abs(inputs - states[before]) <= 0.5 * at.play_mm
    since = np.searchsorted(shared.begin_s, drive.time_s[last[before]], side="right")
    following = np.minimum(since + 1, shared.u_mm.size - 1)
    since = np.where(~shared.halts[since] & shared.halts[following], following, since)
    return np.asarray(np.maximum.accumulate(np.where(is_held & (since < own), since, own)))


FEWEST_SHARED = 8
"""Least number of frames in a stretch whose mean is subtracted before the noise is estimated; with fewer frames, much
of the scatter would be subtracted too.
"""


def _without_shared(residual_mm: Array, stretch: NDArray[np.intp], shared_mm: Array) -> tuple[Array, float]:
    """Residuals minus the mean of each stretch that may have a shared error, and the variance's correction factor."""
    out = residual_mm.copy()
    means = 0
    spread_mm = 1.4826 * float(np.median(np.abs(residual_mm)))
    starts = np.flatnonzero(np.diff(stretch, prepend=-1))
    for begin, end in zip(starts, np.append(starts[1:], stretch.size), strict=True):
        if shared_mm[begin] > SEEN_SHARED * spread_mm and end - begin >= FEWEST_SHARED:
            out[begin:end] -= np.mean(out[begin:end])
            means += 1
    return out, out.size / max(out.size - means, 1)


def even_variance(squares: Array, input_mm2: Array) -> float:
    """Maximum-likelihood variance that must be added to `input_mm2`, if a share of the frames may be outliers.

    Parameters
    ----------
    squares : ndarray of float, shape (n,)
        Squared residuals (mm^2).
    input_mm2 : ndarray of float, shape (n,)
        Variance of each residual that is known (mm^2).

    Frames with a well-known input determine the variance; a median over all frames would fail if these frames are a
    minority. The residuals are assumed to have a contaminated normal distribution (Tukey 1960). If large squares were
    only clipped, there would be no probability density: the smallest variance, at which every frame is clipped, would
    then be the most likely variance.
    """
    high = max(float(np.median(squares)) / MEDIAN_CHI_SQUARE, 1e-18)
    tried = high * np.geomspace(1e-4, 4.0, TRIED)

    def density(variance: Array | float) -> Array:
        return np.asarray(np.exp(-0.5 * squares / variance) / np.sqrt(variance))

    wrong = WRONG * density(WIDER * (high + input_mm2))
    likelihood = [float(np.sum(np.log((1.0 - WRONG) * density(one + input_mm2) + wrong))) for one in tried]
    return float(tried[int(np.argmax(likelihood))])


def _least_variance(residual_mm: Array) -> float:
    """Lower bound of the gap's own variance, from second differences, in which slow errors cancel."""
    if residual_mm.size < FEWEST_SHARED:
        return 0.0
    spread_mm = float(np.median(np.abs(np.diff(residual_mm, 2)))) / float(np.sqrt(MEDIAN_CHI_SQUARE))
    return CORRELATED * spread_mm**2 / 6.0


def _explained(terms: Array, residual: Array) -> float:
    """Fraction of the variance that an autoregression predicts."""
    if not terms.size:
        return 0.0
    order = terms.size
    left = residual[order:].copy()
    for k, share in enumerate(terms, start=1):
        left -= share * residual[order - k : residual.size - k]
    return 1.0 - float(np.var(left) / max(float(np.var(residual)), 1e-30))
