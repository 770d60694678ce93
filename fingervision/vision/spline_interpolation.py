"""Interpolation of a picture between its pixels by cubic B-splines, and its effect on the noise.

Source: Unser, IEEE Signal Processing Magazine 16(6), 1999, doi:10.1109/79.799930. Gaussian smoothing before the
interpolation costs no extra time, because it is part of the spline's prefilter.

The spectrum of the interpolated picture contains copies of the picture's spectrum, centred on every multiple of the
sampling frequency. The copies of the spectrum seem to move differently from the picture, which causes a bias of a
registration that depends on the sub-pixel phase (Schreier, Braasch & Sutton, Optical Engineering 39(11), 2000,
doi:10.1117/1.1314593). A kernel `b + c b''`, where b is the B-spline, uses the same four pixels and also has
approximation order 4 (Blu, Thevenaz & Unser, IEEE Trans. Image Processing 10(7), 2001, doi:10.1109/83.931101); its
spectrum `sinc(f)^4 (1 - c (2 pi f)^2)` has an additional zero, at a frequency that can be chosen. With the coefficients
of the plain B-spline, the kernel `b + c b''` smooths slightly more.
"""

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

# Number of pixels after which the spline's kernel z^|k|, z = sqrt(3) - 2, has decreased to 4e-5; number of pixels on
# either side that a spline uses.
KERNEL_REACH, SPLINE_REACH = 8, 2


@cache
def gaussian(sigma_px: float) -> Doubles:
    """Sampled Gaussian with sum 1 over five standard deviations on either side; a single 1 for a width of 0."""
    reach = int(np.ceil(5.0 * sigma_px))
    k = np.arange(-reach, reach + 1)
    kernel = np.exp(-0.5 * (k / sigma_px) ** 2) if sigma_px > 0.0 else np.ones(1)
    return np.asarray(kernel / kernel.sum(), dtype=np.float64)


@cache
def _prefilter(sigma_px: float) -> Floats:
    """Truncated filter from levels to the coefficients of the cubic B-spline, including Gaussian smoothing."""
    z = np.sqrt(3.0) - 2.0
    k = np.arange(-2 * KERNEL_REACH, 2 * KERNEL_REACH + 1)
    kernel = np.convolve(z ** np.abs(k), gaussian(sigma_px), mode="same")[KERNEL_REACH:-KERNEL_REACH]
    return np.asarray(kernel / kernel.sum(), dtype=np.float32)


def _symbol(curvature: float) -> Doubles:
    """Values of the kernel `b + curvature b''` at the pixels -1, 0 and 1."""
    side = 1.0 / 6.0 + curvature
    return np.array([side, 1.0 - 2.0 * side, side])


def _slope(curvature: float) -> Doubles:
    """Derivatives of `b + curvature b''` at the pixels -2 to 2; at a kink, the mean of the derivatives on its sides."""
    return np.array([0.5 * curvature, 0.5 - curvature, 0.0, curvature - 0.5, -0.5 * curvature])


@cache
def smoothing(sigma_px: float, curvature: float = 0.0) -> Doubles:
    """Filter from a picture's levels to the interpolated levels at the pixels, with all smoothing included."""
    return np.convolve(_prefilter(sigma_px).astype(np.float64), _symbol(curvature))


@cache
def derivative_power(sigma_px: float = 0.0, curvature: float = 0.0) -> float:
    """Variance of the interpolation's derivative at a pixel along one axis, for pixel noise of unit variance."""
    kernel = np.convolve(_prefilter(sigma_px).astype(np.float64), _slope(curvature))
    across = smoothing(sigma_px, curvature)
    return float(kernel @ kernel) * (float(across @ across) if sigma_px > 0.0 else 1.0)


@cache
def phase_power(sigma_px: float = 0.0, curvature: float = 0.0, steps: int = 64) -> Doubles:
    """Variance of an interpolated level for unit pixel noise, by the fraction of a pixel along one axis."""
    fraction = np.arange(steps) / steps
    by_phase = np.stack(weights(fraction, curvature), axis=1)
    kernel = _prefilter(sigma_px).astype(np.float64)
    return np.array([np.sum(np.convolve(kernel, w) ** 2) for w in by_phase])


def interpolated_power(place_px: float) -> float:
    """Variance of a level interpolated at a position along one axis, for unit pixel noise."""
    table = phase_power()
    return float(table[round((place_px % 1.0) * table.size) % table.size])


def weights(fraction: NDArray[np.floating], curvature: float = 0.0) -> tuple[NDArray[np.floating], ...]:
    """Weights of the kernel `b + curvature b''` for the four pixels around a position."""
    f, g = fraction, 1.0 - fraction
    f2, g2 = f * f, g * g
    first, last = g2 * g / 6.0 + curvature * g, f2 * f / 6.0 + curvature * f
    second = 2.0 / 3.0 - f2 * (0.5 + 0.5 * g) + curvature * (3.0 * f - 2.0)
    return first, second, 1.0 - first - second - last, last


def coefficients(levels: Floats, sigma_px: float = 0.0) -> Floats:
    """Coefficients of the cubic B-spline through a Gaussian-smoothed picture, with reflected borders."""
    kernel = _prefilter(sigma_px)
    return np.asarray(cv2.sepFilter2D(levels, cv2.CV_32F, kernel, kernel, borderType=cv2.BORDER_REFLECT_101))


def levels_and_derivatives(c: Floats, curvature: float = 0.0) -> tuple[Floats, Floats, Floats]:
    """Values and derivatives (by x and y) of the interpolation at the pixels, with periodic borders."""
    value, slope = _symbol(curvature).astype(np.float32), _slope(curvature).astype(np.float32)

    def along(of: Floats, weight: Floats, axis: int) -> Floats:
        reach = weight.size // 2
        return sum((w * np.roll(of, k - reach, axis) for k, w in enumerate(weight.tolist())), np.zeros_like(of))

    flat = along(c, value, 0)
    return along(flat, value, 1), along(flat, slope, 1), along(along(c, value, 1), slope, 0)


def sampled(flat: Floats, start: NDArray[np.intp], stride: int, x: Floats, y: Floats) -> Floats:
    """Values of the spline at positions in several coefficient images that are stored one after another.

    Parameters
    ----------
    flat : ndarray, shape (m,)
        Coefficients.
    start : ndarray of int, shape (k,)
        Index at which each image starts.
    stride : int
        Number of columns of each image.
    x, y : ndarray, shape (k, n)
        Positions in each image.
    """
    column, row = np.floor(x), np.floor(y)
    across = weights(x - column)
    down = weights(y - row)
    first = (row.astype(np.intp) - 1) * stride + (column.astype(np.intp) - 1) + start[:, None]
    total = np.zeros_like(x)
    for j in range(4):
        line = across[0] * flat.take(first)
        for i in range(1, 4):
            line += across[i] * flat.take(first + i)
        total += down[j] * line
        first += stride
    return total
