"""A patch of a reference picture, prepared for registration: smoothed levels, gradients, and expected precision."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from fingervision.vision.patch_aliasing import Aliasing, patch_aliasing
from fingervision.vision.spline_interpolation import (
    KERNEL_REACH,
    SPLINE_REACH,
    coefficients,
    levels_and_derivatives,
    smoothing,
)

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

# Number of pixels beyond a patch that interpolation and gradients need.
MARGIN_PX = KERNEL_REACH + SPLINE_REACH
# Standard deviation of the Gaussian with which both pictures are smoothed. Without smoothing, aliased texture near the
# Nyquist frequency would dominate the registration, because the finest texture has the largest gradients, and aliased
# texture seems to move in the opposite direction. This Gaussian and the interpolation's own smoothing leave 2 % of the
# Nyquist frequency and 50 % of half of this frequency. With 1 px or more, patches of 21 px have too little information
# for some textures.
SMOOTHING_PX = 0.7
# Coefficient c of the interpolating kernel `b + c b''` (`spline_interpolation`), with which the kernel's spectrum has a
# further zero at 0.65 of the sampling frequency, in the middle of the range of the images of texture of 0.2 to 0.5
# cycles per pixel. The image of texture of 0.3 cycles per pixel then has 0.7 % of the texture's amplitude instead of
# 3.4 %. The bias that depends on the sub-pixel phase decreases from 0.0042 to 0.0008 px, for white texture behind
# optics of 0.7 px.
CURVATURE = 0.06


@dataclass(frozen=True, slots=True, eq=False)
class PatchReference:
    """A patch of the reference picture, prepared for registration.

    Parameters
    ----------
    x_px, y_px : float
        Middle of the patch, on a pixel.
    half_width_px, half_height_px : int
        Number of pixels on either side of the middle.
    levels : ndarray, shape (n,)
        Light, smoothed, with the fitted plane (mean included) subtracted.
    jacobian : ndarray, shape (3, n)
        Derivatives of `levels` by x, y and angle (radians), without the components that a plane of light or a gain
        explains.
    hessian : ndarray, shape (3, 3)
        Gram matrix of the jacobian.
    score : ndarray, shape (3, 3)
        That of the jacobian smoothed once more: covariance of what smoothed noise of unit variance projects on it.
    aliasing : Aliasing
        What texture that is too fine for the pixels does to the registration.
    template : ndarray, shape (height, width)
        Light without smoothing, for the coarse search.
    """

    x_px: float
    y_px: float
    half_width_px: int
    half_height_px: int
    levels: Floats
    jacobian: Floats
    hessian: Doubles
    score: Doubles
    aliasing: Aliasing
    template: Floats

    @property
    def size(self) -> tuple[int, int]:
        """Number of columns and rows of a patch."""
        return 2 * self.half_width_px + 1, 2 * self.half_height_px + 1


@cache
def grid(half_width: int, half_height: int) -> tuple[Floats, Floats, Doubles]:
    """Columns and rows counted from the patch's centre, and an orthonormal basis of linear levels, shape (3, n)."""
    y, x = np.mgrid[-half_height : half_height + 1, -half_width : half_width + 1]
    dx, dy = x.ravel().astype(np.float64), y.ravel().astype(np.float64)
    basis = np.stack((np.ones_like(dx), dx, dy))
    basis /= np.sqrt((basis**2).sum(axis=1))[:, None]
    return dx.astype(np.float32), dy.astype(np.float32), basis


@cache
def extent(half_width: int, half_height: int) -> tuple[int, float]:
    """Number of pixels of a patch, and the sum of their squared distances from its centre."""
    dx, dy, _ = grid(half_width, half_height)
    return dx.size, float((dx.astype(np.float64) ** 2 + dy.astype(np.float64) ** 2).sum())


def patch_reference(levels: Floats, column: int, row: int, half_width: int, half_height: int) -> PatchReference:
    """Prepare a patch of a picture.

    Parameters
    ----------
    levels : ndarray, shape (height, width)
        Light of the picture, or of a part of it that extends at least `MARGIN_PX` beyond the patch on every side.
    column, row : int
        The patch's middle pixel.
    half_width, half_height : int
        Number of pixels on either side of the middle pixel.

    Returns
    -------
    PatchReference
        The prepared patch; its position is in pixels of `levels`.
    """
    dx, dy, basis = grid(half_width, half_height)
    rows = slice(row - half_height - MARGIN_PX, row + half_height + MARGIN_PX + 1)
    columns = slice(column - half_width - MARGIN_PX, column + half_width + MARGIN_PX + 1)
    part = np.ascontiguousarray(levels[rows, columns], dtype=np.float32)
    inner = slice(MARGIN_PX, -MARGIN_PX)
    level, by_x, by_y = (
        of[inner, inner].ravel() for of in levels_and_derivatives(coefficients(part, SMOOTHING_PX), CURVATURE)
    )
    own = level.astype(np.float64)
    own = own - (basis @ own) @ basis
    jacobian = np.stack((by_x, by_y, dx * by_y - dy * by_x)).astype(np.float64)
    jacobian -= (jacobian @ basis.T) @ basis
    power = float(own @ own)
    if power > 0.0:
        jacobian -= np.outer(jacobian @ own / power, own)
    images = jacobian.reshape(3, 2 * half_height + 1, 2 * half_width + 1)
    for axis in (1, 2):
        images = correlate1d(images, smoothing(SMOOTHING_PX, CURVATURE), axis=axis, mode="constant")
    smoothed = images.reshape(3, -1)
    aliasing = patch_aliasing(part, MARGIN_PX, jacobian, smoothing(SMOOTHING_PX, CURVATURE))
    return PatchReference(
        float(column), float(row), half_width, half_height, own.astype(np.float32), jacobian.astype(np.float32),
        jacobian @ jacobian.T, smoothed @ smoothed.T, aliasing, part[inner, inner].copy(),
    )  # fmt: skip
