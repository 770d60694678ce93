"""Translation and rotation of a textured surface, by registration of patches against a reference picture.

The zero-normalised sum of squared differences is minimised over translation and rotation by the inverse-compositional
Gauss-Newton method (Baker & Matthews, Int. J. Computer Vision 56(3), 2004, doi:10.1023/B:VISI.0000011205.11775.fd; Pan,
Li & Tong, Experimental Mechanics 53(7), 2013, doi:10.1007/s11340-013-9717-6). A linear gradient of light and a gain are
removed from both pictures. Both pictures are smoothed in the same way and interpolated by cubic B-splines
(`spline_interpolation`). Many patches of one size are registered together.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d

from fingervision.domain.loops import loop
from fingervision.vision.spline_interpolation import (
    KERNEL_REACH,
    SPLINE_REACH,
    coefficients,
    derivative_power,
    gaussian,
    levels_and_derivatives,
    phase_power,
)

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

# Pixels beyond a patch that interpolation and gradients need.
MARGIN_PX = KERNEL_REACH + SPLINE_REACH
# Both pictures are smoothed. Near the highest frequency that pixels hold a picture shows what is folded down from
# beyond (aliasing), which seems to move the other way; it would decide, because the finest texture has the largest
# gradients. A Gaussian of 0.7 px leaves 9 % of that frequency and 55 % of half of it: photographs without any optics
# are registered to some 0.01 px instead of 0.02 to 0.03 (`python -m tests.benchmarks.gauges --only photographs`).
# 0.5 px takes off half as much of the error; with 1 px and more, patches of 21 px hold too little for some textures.
SMOOTHING_PX = 0.7
# Gauss-Newton ends after a step below this (pixels at the patch's rim); it converges faster than linearly, so less than
# a thousandth of a pixel is left.
SETTLED_PX, ITERATIONS = 0.01, 12
# A Gram matrix whose smallest normalised eigenvalue is below this is that of noise, or of an edge that slides along
# itself.
LEAST_INFORMATION = 0.02
# Noise's own part of the Gram matrix scatters: smoothed, 31 px square hold some 150 independent gradients, and three
# standard deviations of their power are a third of it. What is no more than this is that of noise.
NOISE_MARGIN = 1.4
# Variance of rounding to whole grey levels: no noise is smaller.
ROUNDING = 1.0 / 12.0
# The patch is divided into so many blocks across and down: each then holds several correlation lengths of smoothed
# noise (2.5 px), and sixteen of them tell a variance to a third.
BLOCKS = 4
# What blocks scatter by over what white noise makes them scatter by: exceeded by one in a hundred of chi-square with
# 13 degrees of freedom over 13. Beyond, the residuals are no noise but texture that moves otherwise than the rest
# (aliased, or of a surface that deforms), and the blocks tell the covariance (White, Econometrica 48, 1980,
# doi:10.2307/1912934).
MOST_SCATTER = 2.13

_settled = loop("patch_registration_settled")


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
    fine : (float, float)
        Share of the gradients' power along x and along y that the smoothing takes off, 0 to 1: most of texture too fine
        for the pixels.
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
    fine: tuple[float, float]
    template: Floats

    @property
    def size(self) -> tuple[int, int]:
        """Number of columns and rows of a patch."""
        return 2 * self.half_width_px + 1, 2 * self.half_height_px + 1


@dataclass(frozen=True, slots=True, eq=False)
class Registered:
    """Positions and rotations of k patches in another picture.

    Parameters
    ----------
    x_px, y_px, turn_rad : ndarray of float, shape (k,)
        Middle of each patch, and rotation clockwise on the screen relative to the reference picture.
    covariance : ndarray of float, shape (k, 3, 3)
        Covariance of x, y and rotation, from the noise of both pictures.
    correlation : ndarray of float, shape (k,)
        Zero-normalised correlation of the patch with the registered part of the picture, with planes subtracted.
    noise : ndarray of float, shape (k,)
        Standard deviation of the noise of one picture.
    settled : ndarray of bool, shape (k,)
        Whether the registration converged inside the given part.
    """

    x_px: Doubles
    y_px: Doubles
    turn_rad: Doubles
    covariance: Doubles
    correlation: Doubles
    noise: Doubles
    settled: NDArray[np.bool_]


def _taken_off(smoothed: Floats, sharp: Floats) -> float:
    """Share of a gradient's power that the smoothing removes."""
    return 1.0 - float(np.sum(smoothed.astype(np.float64) ** 2)) / max(
        float(np.sum(sharp.astype(np.float64) ** 2)), 1e-30
    )


@cache
def _grid(half_width: int, half_height: int) -> tuple[Floats, Floats, Doubles]:
    """Columns and rows counted from the patch's centre, and an orthonormal basis of linear levels, shape (3, n)."""
    y, x = np.mgrid[-half_height : half_height + 1, -half_width : half_width + 1]
    dx, dy = x.ravel().astype(np.float64), y.ravel().astype(np.float64)
    basis = np.stack((np.ones_like(dx), dx, dy))
    basis /= np.sqrt((basis**2).sum(axis=1))[:, None]
    return dx.astype(np.float32), dy.astype(np.float32), basis


@cache
def _extent(half_width: int, half_height: int) -> tuple[int, float]:
    """Number of pixels of a patch, and the sum of their squared distances from its centre."""
    dx, dy, _ = _grid(half_width, half_height)
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
    dx, dy, basis = _grid(half_width, half_height)
    rows = slice(row - half_height - MARGIN_PX, row + half_height + MARGIN_PX + 1)
    columns = slice(column - half_width - MARGIN_PX, column + half_width + MARGIN_PX + 1)
    part = np.ascontiguousarray(levels[rows, columns], dtype=np.float32)
    inner = slice(MARGIN_PX, -MARGIN_PX)
    level, by_x, by_y = (of[inner, inner].ravel() for of in levels_and_derivatives(coefficients(part, SMOOTHING_PX)))
    _, sharp_x, sharp_y = (of[inner, inner].ravel() for of in levels_and_derivatives(coefficients(part)))
    own = level.astype(np.float64)
    own = own - (basis @ own) @ basis
    jacobian = np.stack((by_x, by_y, dx * by_y - dy * by_x)).astype(np.float64)
    jacobian -= (jacobian @ basis.T) @ basis
    power = float(own @ own)
    if power > 0.0:
        jacobian -= np.outer(jacobian @ own / power, own)
    images = jacobian.reshape(3, 2 * half_height + 1, 2 * half_width + 1)
    for axis in (1, 2):
        images = correlate1d(images, gaussian(SMOOTHING_PX), axis=axis, mode="constant")
    smoothed = images.reshape(3, -1)
    fine = (_taken_off(by_x, sharp_x), _taken_off(by_y, sharp_y))
    return PatchReference(
        float(column), float(row), half_width, half_height, own.astype(np.float32), jacobian.astype(np.float32),
        jacobian @ jacobian.T, smoothed @ smoothed.T, fine, part[inner, inner].copy(),
    )  # fmt: skip


def register(
    references: list[PatchReference],
    parts: list[Floats],
    origins_px: Doubles,
    start: Doubles,
    shared_pixels: float = 1.0,
) -> Registered:
    """Register patches of one size, each in its own part of another picture.

    Parameters
    ----------
    references : list of PatchReference
        The patches, all of one size.
    parts : list of ndarray, shape (height, width)
        Light of the part of the picture in which each patch is searched, all of one size.
    origins_px : ndarray of float, shape (k, 2)
        Column and row of each part's first pixel.
    start : ndarray of float, shape (k, 3)
        Initial estimate of x, y and rotation, accurate to about half a period of the finest texture.
    shared_pixels : float
        Number of neighbouring pixels that share an error (from a codec) and count as one pixel.

    Returns
    -------
    Registered
        Results in the order of the references.
    """
    first = references[0]
    hessian = np.stack([reference.hessian for reference in references])
    hessian += 1e-6 * np.trace(hessian, axis1=1, axis2=2)[:, None, None] * np.eye(3) + 1e-12 * np.eye(3)
    inverse = np.asarray(np.linalg.inv(hessian), dtype=np.float64)
    scores = np.zeros((len(references), BLOCKS**2, 3))
    found = [
        _settled(
            coefficients(part, SMOOTHING_PX), reference.levels, reference.jacobian, own,
            first.half_width_px, first.half_height_px, x - left, y - top, turn, by_block,
        )
        for reference, part, own, (left, top), (x, y, turn), by_block in zip(
            references, parts, inverse, origins_px.tolist(), start.tolist(), scores, strict=True
        )
    ]  # fmt: skip
    x, y, turn, gain, correlation, squares = np.array([of[:6] for of in found]).T
    settled = np.array([of[6] for of in found], dtype=bool)
    score = np.stack([reference.score for reference in references])
    size = (first.half_width_px, first.half_height_px)
    covariance, noise = _covariance(hessian, score, squares, gain, x, y, size, shared_pixels)
    covariance = _as_blocks_scatter(covariance, inverse, scores)
    return Registered(x + origins_px[:, 0], y + origins_px[:, 1], turn, covariance, correlation, noise, settled)


def _covariance(
    hessian: Doubles,
    score: Doubles,
    squares: Doubles,
    gain: Doubles,
    x: Doubles,
    y: Doubles,
    half_size: tuple[int, int],
    shared_pixels: float,
) -> tuple[Doubles, Doubles]:
    """Covariance of x, y and rotation from the residuals, and standard deviation of the noise of one picture.

    Both pictures have noise. Smoothed and interpolated levels have less noise than pixels, so that the residuals have
    the variance `sigma^2 (k_0 + g^2 k)`, where g is the gain and `k` depends on the sub-pixel phase. The estimate is
    affected by the pixels' noise after smoothing only, because the texture is coarser than the pixels: the covariance
    of the gradient projections is `2 sigma^2` times the Gram matrix of the gradients smoothed once more. The noise in
    the gradients of the reference increases their Gram matrix and is subtracted from it (errors in variables):
    covariance = sigma_r^2 H^-1 S_seen H^-1.
    """
    count, (n, turned) = squares.size, _extent(*half_size)
    table = phase_power(SMOOTHING_PX)
    places = [np.floor((v - np.floor(v)) * table.size).astype(np.intp) % table.size for v in (x, y)]
    power = table[places[0]] * table[places[1]]
    one = np.maximum(squares / max(n - 7, 1) / (table[0] ** 2 + gain**2 * power), ROUNDING)
    spread = one * (1.0 + gain**2) * shared_pixels
    noisy = np.zeros((count, 3, 3))
    noisy[:, 0, 0] = noisy[:, 1, 1] = one * n * derivative_power(SMOOTHING_PX)
    noisy[:, 2, 2] = one * turned * derivative_power(SMOOTHING_PX)
    return _propagated(hessian, score, noisy, spread), np.sqrt(one)


def _as_blocks_scatter(covariance: Doubles, inverse: Doubles, scores: Doubles) -> Doubles:
    """Increase covariances to the scatter of the patch's blocks if this is larger than the noise explains.

    Parameters
    ----------
    covariance : ndarray of float, shape (k, 3, 3)
        By the noise.
    inverse : ndarray of float, shape (k, 3, 3)
        Of the Gram matrices.
    scores : ndarray of float, shape (k, blocks, 3)
        Products of gradients and residuals by block; their sum is zero where the registration settled.
    """
    blocks = scores.shape[1]
    away = (scores - scores.mean(axis=1, keepdims=True)) @ inverse
    seen = np.einsum("kbi,kbi->ki", away, away) * (blocks / (blocks - 3.0))
    ratio = seen / np.einsum("kii->ki", covariance)
    wider = np.sqrt(np.where(ratio > MOST_SCATTER, ratio, 1.0))
    return np.asarray(covariance * wider[:, :, None] * wider[:, None, :])


def _propagated(hessian: Doubles, score: Doubles, noisy: Doubles, spread: Doubles) -> Doubles:
    """Covariances of k patches, shape (k, 3, 3); infinite if the gradients are noise, or all in one direction."""
    true = hessian - noisy
    size = np.sqrt(np.maximum(np.einsum("kii->ki", hessian), 1e-30))
    surely = hessian - NOISE_MARGIN * noisy
    least = np.linalg.eigvalsh(surely / (size[:, :, None] * size[:, None, :]))[:, 0]
    is_sound = least > LEAST_INFORMATION
    own = np.linalg.inv(np.where(is_sound[:, None, None], true, np.eye(3)))
    covariance = spread[:, None, None] * (own @ score @ own)
    return np.where(is_sound[:, None, None], covariance, np.diag([np.inf] * 3))


def reference_covariance(reference: PatchReference, noise: float) -> Doubles:
    """Predicted covariance of x, y and rotation for a registration of this patch, shape (3, 3).

    The covariance is infinite if the gradients do not exceed those of noise, or all have one direction.

    Parameters
    ----------
    reference : PatchReference
        The patch.
    noise : float
        Standard deviation of the noise of one picture.
    """
    variance = max(noise**2, ROUNDING)
    pixels, turned = _extent(reference.half_width_px, reference.half_height_px)
    noisy = variance * derivative_power(SMOOTHING_PX) * np.diag([pixels, pixels, turned])
    return np.asarray(
        _propagated(reference.hessian[None], reference.score[None], noisy[None], np.array([2.0 * variance]))[0]
    )
