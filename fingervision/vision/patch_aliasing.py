"""Apparent displacement of a patch that is caused by texture too fine for the pixels (aliasing).

Texture of a frequency f above the Nyquist frequency (half a cycle per pixel) appears at the frequency `1 - f` and seems
to move in the opposite direction: relative to the rest of the patch its phase changes by 2 pi for every pixel of
displacement. After a displacement d of the patch, the residual due to aliased texture is `2 sin(pi d)` times as large
as the aliased texture itself. The part of the aliased residual that looks like a displacement is a bias, which depends
on the sub-pixel phase. The bias has two parts:

* The product of the residual with the aliased texture's own gradient is the same for every texture of equal power: the
  product pulls the patch towards whole pixels by `pull sin(2 pi d)`. The pull is computed and corrected
  (`aliasing_pull`).
* The product of the residual with the gradient of the remaining texture has either sign. The variance of the product is
  computed (`aliasing_covariance`).

The power above the Nyquist frequency is extrapolated from the power of the patch below the Nyquist frequency. The
aliased power is assumed to be equal for all frequencies along the other axis, so that an edge parallel to the pixels,
whose phase is constant along its length, counts as a single edge.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

# Frequency bands (cycles per pixel) from which the power above 0.5 is extrapolated, as near to 0.5 as a patch of 9 px
# resolves, and the centres of these bands.
LOW_BAND, HIGH_BAND = (0.18, 0.32), (0.36, 0.5)
LOW, HIGH = 0.25, 0.43
# Number of iterations in which the share of the power near the Nyquist frequency that is not aliased is determined to 1
# %.
UNFOLDINGS = 8
# Side (pixels) of the square over which the power of fine texture is averaged to locate the texture; smoothing and
# derivatives spread a line over this width.
NEARBY_PX = 5
# Condition number above which the gradients do not determine the motion: half the digits of a double are lost.
SINGULAR = 1e8
# Least difference between the effects of noise and of aliased texture on the residuals, as a share of the effect of
# noise, with which the two are separated.
LEAST_TOLD = 0.2
# Relative standard uncertainty of the pull: for surfaces without optical blur, the mean pull was 0.6 to 1.6 times the
# prediction.
U_PULL = 0.4


@dataclass(frozen=True, slots=True, eq=False)
class Aliasing:
    """Effects of texture that is too fine for the pixels on the registration of a patch.

    The first row (or element) of each array is for texture too fine for the columns of pixels, the second for texture
    too fine for the rows of pixels.

    Parameters
    ----------
    variance : ndarray of float, shape (2, 3)
        Variances of x, y and angle, for a factor 1 in `aliasing_at`.
    pull_px : ndarray of float, shape (2,)
        Amplitude of the pull of x and of y towards whole pixels.
    residual : ndarray of float, shape (2,)
        Mean square of the smoothed aliased texture per pixel.
    power : ndarray of float, shape (2,)
        Power per pixel near the Nyquist frequency, including noise; the other attributes are extrapolated from this
        power.
    """

    variance: Doubles
    pull_px: Doubles
    residual: Doubles
    power: Doubles


def patch_aliasing(part: Floats, margin_px: int, jacobian: Doubles, smoothing: Doubles) -> Aliasing:
    """Predict the effects of aliased texture on the registration of a patch from its spectrum.

    Parameters
    ----------
    part : ndarray, shape (height + 2 margin, width + 2 margin)
        Light of the patch and its surroundings.
    margin_px : int
        Number of pixels of `part` beyond the patch on every side.
    jacobian : ndarray, shape (3, height * width)
        Derivatives of the smoothed levels by x, y and angle.
    smoothing : ndarray, shape (m,)
        Filter by which both pictures are smoothed along each axis.
    """
    inner = part[margin_px:-margin_px, margin_px:-margin_px].astype(np.float64)
    gram = jacobian @ jacobian.T
    if not np.linalg.cond(gram / np.sqrt(np.outer(gram.diagonal(), gram.diagonal()) + 1e-30)) < SINGULAR:
        return Aliasing(np.zeros((2, 3)), np.zeros(2), np.zeros(2), np.ones(2))
    inverse = np.linalg.inv(gram)
    # Changes of x, y and angle if the level of one pixel increases by one.
    influence = (inverse @ jacobian).reshape(3, *inner.shape)
    response = np.multiply.outer(*(_response(smoothing, n) for n in inner.shape))
    weight = np.abs(np.fft.fft2(influence)) ** 2 * response
    variance, pull_px, residual, powers = np.empty((2, 3)), np.empty(2), np.empty(2), np.empty(2)
    for row, axis in enumerate((1, 0)):
        rows = part[margin_px:-margin_px, :] if axis == 1 else part[:, margin_px:-margin_px]
        least, folded, powers[row] = _folded_power(rows.astype(np.float64), axis, margin_px)
        residual[row] = float((folded * response).mean())
        slope = 2.0 * np.pi * np.abs(np.fft.fftfreq(inner.shape[axis]))
        along = slope[None, :] if axis == 1 else slope[:, None]
        pull_px[row] = float((along * least * response).sum()) * inverse[row, row]
        # If fine texture covers only a few places of the patch, its errors do not average out, because the gradients
        # lie in the same places.
        beside = 0.5 * (np.roll(part, 1, axis) + np.roll(part, -1, axis))
        fine = cv2.blur((part - beside).astype(np.float64) ** 2, (NEARBY_PX, NEARBY_PX))
        fine = fine[margin_px:-margin_px, margin_px:-margin_px]
        gathered = (influence**2 * fine).sum(axis=(1, 2)) / (influence**2).sum(axis=(1, 2))
        gathered /= max(float(fine.mean()), 1e-30)
        variance[row] = (weight * folded).sum(axis=(1, 2)) / inner.size * np.maximum(gathered, 1.0)
    ratio = inverse[0, 0] / inverse[1, 1]
    # Aliased texture is as strong as the stronger gradients, and displaces the patch more in the direction of the
    # weaker gradients.
    x, y = variance[:, 0].copy(), variance[:, 1].copy()
    variance[:, 0], variance[:, 1] = np.maximum(x, y * ratio), np.maximum(y, x / ratio)
    return Aliasing(variance, pull_px, residual, powers)


@dataclass(frozen=True, slots=True, eq=False)
class AliasingError:
    """Errors of k registered patches due to aliased texture.

    Parameters
    ----------
    pull_px : ndarray of float, shape (k, 2)
        Correction to be added to the displacements x and y, which are pulled towards whole pixels.
    variance : ndarray of float, shape (k, 3)
        Variances of x, y and rotation at this displacement.
    worst_px : ndarray of float, shape (k,)
        Larger standard deviation of x and y, at the sub-pixel phase with the largest value.
    """

    pull_px: Doubles
    variance: Doubles
    worst_px: Doubles


def aliasing_at(
    aliasing: Sequence[Aliasing],
    place: tuple[Doubles, Doubles, Doubles],
    half_size: tuple[int, int],
    residual: Doubles,
    by_noise: Doubles,
) -> AliasingError:
    """Errors of k registered patches due to aliased texture, at the patches' displacements.

    The power of aliased texture contributes with the factor `4 sin^2(pi d) = 2 (1 - cos(2 pi d))` at the displacement
    d, averaged over a rotated patch. The power near the Nyquist frequency is the sum of noise and texture, and so is
    the mean square of the residuals. The power near the Nyquist frequency and the mean square of the residuals together
    give the noise; only the remaining power is texture.

    Parameters
    ----------
    aliasing : sequence of Aliasing
        Predictions for a factor 1.
    place : (ndarray, ndarray, ndarray) of float, shape (k,)
        Fractional part of the displacement along x and y, in pixels, and rotation in radians.
    half_size : (int, int)
        Pixels on either side of the patch's middle across and down.
    residual : ndarray of float, shape (k,)
        Mean square of the smoothed residuals.
    by_noise : ndarray of float, shape (k,)
        Mean square of the smoothed residuals for noise of unit variance in every pixel of both pictures.
    """
    variance, pull_px = np.stack([of.variance for of in aliasing]), np.stack([of.pull_px for of in aliasing])
    folded, power = np.stack([of.residual for of in aliasing]), np.stack([of.power for of in aliasing])
    power = np.maximum(power, 1e-30)
    x, y, turn = place
    across, down = half_size
    phase = 2.0 * np.pi * np.stack([x, y], axis=1)
    even = np.sinc(2.0 * np.stack([down * turn, across * turn], axis=1))
    factor = 2.0 * (1.0 - np.cos(phase) * even)
    # residual = by_noise n + sum of factor folded (1 - n / power), solved for the variance n of the noise.
    ratio = (factor * folded / power).sum(axis=1)
    noise = (residual - (factor * folded).sum(axis=1)) / np.maximum(by_noise - ratio, LEAST_TOLD * by_noise)
    noise = np.clip(noise, 0.0, residual / by_noise)
    share = np.clip(1.0 - noise[:, None] / power, 0.0, 1.0)
    pull = share * pull_px
    # The measured displacement, from which the phase is calculated, is itself pulled towards whole pixels.
    toward = np.sin(phase + 2.0 * np.pi * pull * np.sin(phase)) * pull * even
    spread = ((share * factor)[:, :, None] * variance).sum(axis=1)
    spread[:, :2] += (U_PULL * toward) ** 2
    worst = (4.0 * share[:, :, None] * variance).sum(axis=1)[:, :2] + pull**2
    return AliasingError(toward, spread, np.sqrt(worst.max(axis=1)))


def _folded_power(light: Doubles, axis: int, margin_px: int) -> tuple[Doubles, Doubles, float]:
    """Power spectra, in the shape of the patch, of the texture that is aliased along an axis, by apparent frequency.

    The first spectrum assumes the blur of optics, which leaves the least aliased power, and serves for a correction.
    The second spectrum assumes edges and lines. The third result is the mean power near the Nyquist frequency, from
    which both spectra are extrapolated. The window extends beyond the patch along the axis, so that the whole patch has
    full weight, including lines at its border.
    """
    of = np.moveaxis(light, axis, 1)
    n = of.shape[1] - 2 * margin_px
    down, across = np.mgrid[: of.shape[0], : of.shape[1]]
    basis = np.stack([np.ones(of.size), down.ravel() - down.mean(), across.ravel() - across.mean()])
    basis /= np.sqrt((basis**2).sum(axis=1))[:, None]
    flat = of.ravel() - (basis @ of.ravel()) @ basis
    taper = np.sin(0.5 * np.pi * np.arange(1, margin_px + 1) / (margin_px + 1)) ** 2
    window = np.concatenate([taper, np.ones(n), taper[::-1]])
    power = np.abs(np.fft.fft2(flat.reshape(of.shape) * window)) ** 2 / (of.shape[0] * (window**2).sum())
    frequency = np.abs(np.fft.fftfreq(of.shape[1]))
    low = power[:, (frequency > LOW_BAND[0]) & (frequency <= LOW_BAND[1])].mean(axis=1)
    high = power[:, (frequency > HIGH_BAND[0]) & (frequency <= HIGH_BAND[1])].mean(axis=1)
    beyond = 1.0 - np.abs(np.fft.fftfreq(n))
    gaussian, exponential = (
        np.moveaxis(np.multiply.outer(high, _beyond(beyond, float(low.sum()), float(high.sum()), order)), 1, axis)
        for order in (2, 1)
    )
    return gaussian, exponential, float(high.mean())


def _beyond(frequency: Doubles, low: float, high: float, order: int) -> Doubles:
    """Power at frequencies beyond 0.5, as a share of the power `high` at the frequency `HIGH`, which is partly aliased.

    The area of a pixel multiplies the power by sinc^2. The remaining decrease from `LOW` to `HIGH` is extrapolated as
    `exp(-fall f^order)`: order 2 is the blur of optics, with the steepest decrease; for edges and lines, the order is
    1.
    """
    by_pixel = 2.0 * np.log(np.sinc(LOW) / np.sinc(HIGH))
    own = 1.0
    for _ in range(UNFOLDINGS):
        seen = np.log(max(low, 1e-30) / max(own * high, 1e-30))
        fall = max(seen - by_pixel, 0.0) / (HIGH**order - LOW**order)

        def passed(f: Doubles, fall: float = fall) -> Doubles:
            return np.asarray((np.sinc(f) / np.sinc(HIGH)) ** 2 * np.exp(-fall * (f**order - HIGH**order)))

        own = 1.0 / (1.0 + float(passed(np.array(1.0 - HIGH))))
    return own * passed(frequency)


def _response(kernel: Doubles, n: int) -> Doubles:
    """Power response of a symmetric filter at the n frequencies of a discrete Fourier transform."""
    k = np.arange(kernel.size) - kernel.size // 2
    return np.asarray((np.cos(2.0 * np.pi * np.multiply.outer(np.fft.fftfreq(n), k)) @ kernel) ** 2)
