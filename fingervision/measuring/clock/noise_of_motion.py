"""Noise of the gap beside a fitted motion: its correlation from frame to frame, and where the input is known badly."""

import numpy as np

from fingervision.domain.effect import Array
from fingervision.measuring.clock.joint_fit import Fit, Motion, Noise

MOST_ORDER = 4
"""Order at most: an autoregression with white noise beside it is told well enough by four terms."""
FRAMES_AN_ORDER = 25
"""Frames that each term must rest on."""
LARGEST_ROOT = 0.98
"""Sum of the terms' sizes above which a residual is as good as a random walk; there they are scaled back."""


def autoregression(residual_mm: Array) -> Array:
    """Fit an autoregression by Burg's method, its order by Akaike's criterion with Hurvich's correction.

    Parameters
    ----------
    residual_mm : ndarray of float, shape (n,)
        Residual along time.

    Returns
    -------
    ndarray of float, shape (p,)
        y_t = sum of a_k y_(t-k) + white noise; empty for white noise.
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


def noise_of(motion: Motion, found: Fit) -> Noise:
    """Estimate the noise that a fit leaves.

    The variance of a frame is that of the vision's noise, the same in all frames, and the square of what the input's
    uncertainty between two rows of the log makes of it. The first is where the median of squares fits.
    """
    log_s = motion.log_time_s(found.at)
    after = np.clip(np.searchsorted(motion.drive.time_s, log_s), 0, motion.path.u_mm.size - 1)
    slope = found.scale / max(0.5 * float(np.ptp(motion.drive.input_mm)), 1e-12)
    input_mm2 = (slope * motion.path.u_mm[after]) ** 2
    squares = (found.residual_mm - np.median(found.residual_mm)) ** 2
    even_mm2 = _even_variance(squares, input_mm2)
    shrunk = found.residual_mm * np.sqrt(even_mm2 / (even_mm2 + input_mm2))
    terms = autoregression(np.clip(shrunk, -4.0 * np.sqrt(even_mm2), 4.0 * np.sqrt(even_mm2)))
    order = terms.size
    white_mm2 = even_mm2 * max(1.0 - _explained(terms, shrunk), 1e-3)
    extra = input_mm2[order:].copy()
    for k, share in enumerate(terms, start=1):
        extra += share**2 * input_mm2[order - k : input_mm2.size - k]
    return Noise(terms, 1.0 / np.sqrt(1.0 + extra / white_mm2))


def _even_variance(squares: Array, input_mm2: Array) -> float:
    """Find the variance beside `input_mm2` with which the median of the normalised squares is a normal one's."""
    high = max(float(np.median(squares)) / MEDIAN_CHI_SQUARE, 1e-18)
    low = 1e-4 * high
    if float(np.median(squares / (low + input_mm2))) < MEDIAN_CHI_SQUARE:
        return low
    for _ in range(30):
        middle = float(np.sqrt(low * high))
        if float(np.median(squares / (middle + input_mm2))) > MEDIAN_CHI_SQUARE:
            low = middle
        else:
            high = middle
    return high


def _explained(terms: Array, residual: Array) -> float:
    """Share of the variance that an autoregression foretells."""
    if not terms.size:
        return 0.0
    order = terms.size
    left = residual[order:].copy()
    for k, share in enumerate(terms, start=1):
        left -= share * residual[order - k : residual.size - k]
    return 1.0 - float(np.var(left) / max(float(np.var(residual)), 1e-30))
