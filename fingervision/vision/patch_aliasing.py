"""Apparent displacement of a patch that is caused by texture too fine for the pixels (aliasing).

Texture of a frequency f above the Nyquist frequency (half a cycle per pixel) appears at the frequency `1 - f` and seems
to move in the opposite direction: relative to the rest of the patch its phase changes by 2 pi for every pixel of
displacement. After a displacement d its residual is `2 sin(pi d)` times as large as the aliased texture itself. The
part of this residual that looks like a displacement is a bias, which depends on the sub-pixel phase. The power above
the Nyquist frequency is extrapolated from the power of the patch below it. The aliased power is assumed to be equal for
all frequencies along the other axis, so that an edge parallel to the pixels, whose phase is constant along its length,
counts as a single edge.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

# Frequency bands (cycles per pixel) from which the power above 0.5 is extrapolated, as near to 0.5 as a patch of 9 px
# resolves, and the centres of these bands.
LOW_BAND, HIGH_BAND = (0.18, 0.32), (0.36, 0.5)
LOW, HIGH = 0.25, 0.43
# Side (pixels) of the square over which the power of fine texture is averaged to locate the texture; smoothing and
# gradients spread a line over this width.
NEARBY_PX = 5


def aliasing_covariance(part: Floats, margin_px: int, jacobian: Doubles, smoothing: Doubles) -> Doubles:
    """Variances due to texture that is too fine for the columns and for the rows, for a factor 1 in `aliasing_at`.

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

    Returns
    -------
    ndarray, shape (2, 3)
        Variances of x, y and angle due to texture that is aliased along x (first row) and along y (second row).
    """
    inner = part[margin_px:-margin_px, margin_px:-margin_px].astype(np.float64)
    gradients = jacobian.reshape(3, *inner.shape)
    information = (gradients**2).sum(axis=(1, 2))
    if not information.min() > 0.0:
        return np.zeros((2, 3))
    weight = np.abs(np.fft.fft2(gradients)) ** 2 * np.multiply.outer(*(_response(smoothing, n) for n in inner.shape))
    variance = np.empty((2, 3))
    for row, axis in enumerate((1, 0)):
        folded = _folded_power(inner, axis)
        # Fine texture in a few places coincides with the gradients there, so that its effect does not average out over
        # the patch.
        beside = 0.5 * (np.roll(part, 1, axis) + np.roll(part, -1, axis))
        fine = cv2.blur((part - beside).astype(np.float64) ** 2, (NEARBY_PX, NEARBY_PX))
        fine = fine[margin_px:-margin_px, margin_px:-margin_px]
        gathered = (gradients**2 * fine).sum(axis=(1, 2)) / (information * max(float(fine.mean()), 1e-30))
        variance[row] = (weight * folded).sum(axis=(1, 2)) / inner.size / information**2 * np.maximum(gathered, 1.0)
    # Aliased texture is as strong as the stronger gradients, and displaces the patch more along the axis of the weaker
    # gradients.
    ratio = information[1] / information[0]
    x, y = variance[:, 0].copy(), variance[:, 1].copy()
    variance[:, 0], variance[:, 1] = np.maximum(x, y * ratio), np.maximum(y, x / ratio)
    return variance


def aliasing_at(
    aliasing: Doubles, x_px: Doubles, y_px: Doubles, turn_rad: Doubles, half_size: tuple[int, int]
) -> Doubles:
    """Variances of x, y and rotation of k patches at their displacements, shape (k, 3).

    The power of aliased texture counts `4 sin^2(pi d) = 2 (1 - cos(2 pi d))` times, averaged over a rotated patch.

    Parameters
    ----------
    aliasing : ndarray of float, shape (k, 2, 3)
        From `aliasing_covariance`.
    x_px, y_px, turn_rad : ndarray of float, shape (k,)
        Displacement modulo one pixel, and rotation.
    half_size : (int, int)
        Number of pixels on either side of the patch's centre, across and down.
    """
    across, down = half_size
    along_x = 2.0 * (1.0 - np.cos(2.0 * np.pi * x_px) * np.sinc(2.0 * down * turn_rad))
    along_y = 2.0 * (1.0 - np.cos(2.0 * np.pi * y_px) * np.sinc(2.0 * across * turn_rad))
    return np.asarray(along_x[:, None] * aliasing[:, 0] + along_y[:, None] * aliasing[:, 1])


def _folded_power(light: Doubles, axis: int) -> Doubles:
    """Power spectrum of the texture that is aliased along an axis, by its apparent frequency; shape of `light`."""
    n = light.shape[axis]
    of = np.moveaxis(light, axis, 1)
    down, across = np.mgrid[: of.shape[0], :n]
    basis = np.stack([np.ones(of.size), down.ravel() - down.mean(), across.ravel() - across.mean()])
    basis /= np.sqrt((basis**2).sum(axis=1))[:, None]
    flat = of.ravel() - (basis @ of.ravel()) @ basis
    window = np.hanning(n + 2)[1:-1]
    power = np.abs(np.fft.fft2(flat.reshape(of.shape) * window)) ** 2 / (of.shape[0] * (window**2).sum())
    frequency = np.abs(np.fft.fftfreq(n))
    low = power[:, (frequency > LOW_BAND[0]) & (frequency <= LOW_BAND[1])].mean(axis=1)
    high = power[:, (frequency > HIGH_BAND[0]) & (frequency <= HIGH_BAND[1])].mean(axis=1)
    # Integration over a pixel reduces the power by sinc^2. Any further decrease is due to optics and texture, and is
    # assumed to continue above 0.5.
    by_pixel = 2.0 * np.log(np.sinc(LOW) / np.sinc(HIGH)) / (HIGH - LOW)
    seen = np.log(max(float(low.sum()), 1e-30) / max(float(high.sum()), 1e-30)) / (HIGH - LOW)
    beyond = 1.0 - frequency
    passed = (np.sinc(beyond) / np.sinc(HIGH)) ** 2 * np.exp(-max(seen - by_pixel, 0.0) * (beyond - HIGH))
    return np.moveaxis(np.multiply.outer(high, passed), 1, axis)


def _response(kernel: Doubles, n: int) -> Doubles:
    """Power response of a symmetric filter at the n frequencies of a discrete Fourier transform."""
    k = np.arange(kernel.size) - kernel.size // 2
    return np.asarray((np.cos(2.0 * np.pi * np.multiply.outer(np.fft.fftfreq(n), k)) @ kernel) ** 2)
