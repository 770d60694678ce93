"""How far a textured piece of surface has moved and turned: registration of patches against a reference picture.

Inverse-compositional Gauss-Newton of the zero-normalised sum of squared differences over translation and rotation
(Baker & Matthews, Int. J. Computer Vision 56(3), 2004, doi:10.1023/B:VISI.0000011205.11775.fd; Pan, Li & Tong,
Experimental Mechanics 53(7), 2013, doi:10.1007/s11340-013-9717-6). A linear gradient of light and a gain are removed
from both pictures. The moved picture is interpolated by cubic B-splines (Unser, IEEE Signal Processing Magazine
16(6), 1999, doi:10.1109/79.799930). Many patches of one size are registered together.
"""

from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

# Pixels beyond a patch that interpolation and gradients need; the prefilter's kernel z^|k|, z = sqrt(3) - 2, has fallen
# to 4e-5 after eight pixels.
PREFILTER_REACH, SPLINE_REACH = 8, 2
MARGIN_PX = PREFILTER_REACH + SPLINE_REACH
# Gauss-Newton ends after a step below this (pixels at the patch's rim); it converges faster than linearly, so less than
# a thousandth of a pixel is left.
SETTLED_PX, ITERATIONS = 0.01, 12
# A Gram matrix whose smallest normalised eigenvalue is below this is that of noise, or of an edge that slides along
# itself.
LEAST_INFORMATION = 0.02
# Variance of rounding to whole grey levels: no noise is smaller.
ROUNDING = 1.0 / 12.0


@dataclass(frozen=True, slots=True, eq=False)
class PatchReference:
    """A patch of the reference picture, prepared for registration.

    Parameters
    ----------
    x_px, y_px : float
        Its middle, on a pixel.
    half_width_px, half_height_px : int
        Pixels to either side of the middle.
    levels : ndarray, shape (n,)
        Light, with plane and mean taken off; norm `contrast`.
    jacobian : ndarray, shape (3, n)
        Change of `levels` with x, y and angle (radians), what plane and gain explain taken off.
    hessian : ndarray, shape (3, 3)
        Gram matrix of the jacobian.
    template : ndarray, shape (height, width)
        Light as it was seen, for coarse search.
    """

    x_px: float
    y_px: float
    half_width_px: int
    half_height_px: int
    levels: Floats
    jacobian: Floats
    hessian: Doubles
    template: Floats

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows."""
        return 2 * self.half_width_px + 1, 2 * self.half_height_px + 1


@dataclass(frozen=True, slots=True, eq=False)
class Registered:
    """Where patches lie in another picture; arrays over the k patches.

    Parameters
    ----------
    x_px, y_px, turn_rad : ndarray of float, shape (k,)
        Middle, and rotation clockwise on the screen, since the reference.
    covariance : ndarray of float, shape (k, 3, 3)
        Of the three, from the noise of both pictures.
    correlation : ndarray of float, shape (k,)
        Zero-normalised correlation of the patch with what was found, planes taken off.
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


@cache
def _prefilter() -> Floats:
    """Interpolation's inverse filter, truncated: coefficients of the cubic B-spline."""
    z = np.sqrt(3.0) - 2.0
    k = np.arange(-PREFILTER_REACH, PREFILTER_REACH + 1)
    kernel = z ** np.abs(k) * (-6.0 * z / (1.0 - z * z))
    return np.asarray(kernel / kernel.sum(), dtype=np.float32)


@cache
def derivative_power() -> float:
    """Variance of the spline's derivative at a pixel for unit noise of the pixels."""
    kernel = np.convolve(_prefilter().astype(np.float64), [0.5, 0.0, -0.5])
    return float(kernel @ kernel)


@cache
def _phase_power(steps: int = 64) -> Doubles:
    """Variance of an interpolated level for unit noise, by the fraction of a pixel along one axis."""
    fraction = np.arange(steps) / steps
    weights = np.stack(_weights(fraction), axis=1)
    kernel = _prefilter().astype(np.float64)
    return np.array([np.sum(np.convolve(kernel, w) ** 2) for w in weights])


def interpolated_power(place_px: float) -> float:
    """Variance of a level interpolated at a place along one axis, for unit noise of the pixels."""
    table = _phase_power()
    return float(table[round((place_px % 1.0) * table.size) % table.size])


def _weights(fraction: NDArray[np.floating]) -> tuple[NDArray[np.floating], ...]:
    """Cubic B-spline's weights of the four pixels about a place."""
    f, g = fraction, 1.0 - fraction
    f2, g2 = f * f, g * g
    first, last = g2 * g / 6.0, f2 * f / 6.0
    second = 2.0 / 3.0 - f2 * (0.5 + 0.5 * g)
    return first, second, 1.0 - first - second - last, last


def coefficients(levels: Floats) -> Floats:
    """Coefficients of the cubic B-spline through a picture's levels, borders reflected."""
    kernel = _prefilter()
    return np.asarray(cv2.sepFilter2D(levels, cv2.CV_32F, kernel, kernel, borderType=cv2.BORDER_REFLECT_101))


@cache
def _grid(half_width: int, half_height: int) -> tuple[Floats, Floats, Doubles]:
    """Columns and rows from the middle, and an orthonormal basis of planes, shape (3, n)."""
    y, x = np.mgrid[-half_height : half_height + 1, -half_width : half_width + 1]
    dx, dy = x.ravel().astype(np.float64), y.ravel().astype(np.float64)
    basis = np.stack((np.ones_like(dx), dx, dy))
    basis /= np.sqrt((basis**2).sum(axis=1))[:, None]
    return dx.astype(np.float32), dy.astype(np.float32), basis


def patch_reference(levels: Floats, column: int, row: int, half_width: int, half_height: int) -> PatchReference:
    """Prepare a patch of a picture.

    Parameters
    ----------
    levels : ndarray, shape (height, width)
        Light of the picture, or of a part of it; at least `MARGIN_PX` to every side of the patch.
    column, row : int
        The patch's middle pixel.
    half_width, half_height : int
        Pixels to either side.

    Returns
    -------
    PatchReference
        Its place is in pixels of `levels`.
    """
    dx, dy, basis = _grid(half_width, half_height)
    rows = slice(row - half_height - MARGIN_PX, row + half_height + MARGIN_PX + 1)
    columns = slice(column - half_width - MARGIN_PX, column + half_width + MARGIN_PX + 1)
    part = np.ascontiguousarray(levels[rows, columns], dtype=np.float32)
    c = coefficients(part)
    inner = slice(MARGIN_PX, -MARGIN_PX)
    # Derivatives of the spline at the pixels: (c[+1] - c[-1]) / 2 along, (c[-1] + 4 c[0] + c[+1]) / 6 across.
    across_x = (np.roll(c, -1, 1) - np.roll(c, 1, 1)) * 0.5
    across_y = (np.roll(c, -1, 0) - np.roll(c, 1, 0)) * 0.5
    by_x = ((np.roll(across_x, 1, 0) + 4 * across_x + np.roll(across_x, -1, 0)) / 6.0)[inner, inner].ravel()
    by_y = ((np.roll(across_y, 1, 1) + 4 * across_y + np.roll(across_y, -1, 1)) / 6.0)[inner, inner].ravel()
    template = part[inner, inner].copy()
    own = template.ravel().astype(np.float64)
    own = own - (basis @ own) @ basis
    jacobian = np.stack((by_x, by_y, dx * by_y - dy * by_x)).astype(np.float64)
    jacobian -= (jacobian @ basis.T) @ basis
    power = float(own @ own)
    if power > 0.0:
        jacobian -= np.outer(jacobian @ own / power, own)
    return PatchReference(
        float(column), float(row), half_width, half_height, own.astype(np.float32), jacobian.astype(np.float32),
        jacobian @ jacobian.T, template,
    )  # fmt: skip


def sampled(flat: Floats, start: NDArray[np.intp], stride: int, x: Floats, y: Floats) -> Floats:
    """Spline's levels at places of several coefficient images that lie one after another in memory.

    Parameters
    ----------
    flat : ndarray, shape (m,)
        Coefficients.
    start : ndarray of int, shape (k,)
        Where each image begins.
    stride : int
        Columns of each image.
    x, y : ndarray, shape (k, n)
        Places in each image.
    """
    column, row = np.floor(x), np.floor(y)
    across = _weights(x - column)
    down = _weights(y - row)
    first = (row.astype(np.intp) - 1) * stride + (column.astype(np.intp) - 1) + start[:, None]
    total = np.zeros_like(x)
    for j in range(4):
        line = across[0] * flat.take(first)
        for i in range(1, 4):
            line += across[i] * flat.take(first + i)
        total += down[j] * line
        first += stride
    return total


def register(
    references: list[PatchReference],
    parts: list[Floats],
    origins_px: Doubles,
    start: Doubles,
    shared_pixels: float = 1.0,
) -> Registered:
    """Register patches of one size, each in a part of another picture.

    Parameters
    ----------
    references : list of PatchReference
        The patches, all of one size.
    parts : list of ndarray, shape (height, width)
        Light of the part of the picture in which each is looked for, all of one size.
    origins_px : ndarray of float, shape (k, 2)
        Column and row of each part's first pixel.
    start : ndarray of float, shape (k, 3)
        First guess of x, y and turn, to about half a period of the finest texture.
    shared_pixels : float
        So many pixels count as one, where a codec is known to share its errors.

    Returns
    -------
    Registered
        In the order of the references.
    """
    first = references[0]
    dx, dy, basis = _grid(first.half_width_px, first.half_height_px)
    basis32 = basis.astype(np.float32)
    height, width = parts[0].shape
    count = len(references)
    flat = np.concatenate([coefficients(part).ravel() for part in parts])
    begin = np.arange(count, dtype=np.intp) * (height * width)
    own = np.stack([reference.levels for reference in references])
    jacobian = np.stack([reference.jacobian for reference in references])
    hessian = np.stack([reference.hessian for reference in references])
    hessian += 1e-6 * np.trace(hessian, axis1=1, axis2=2)[:, None, None] * np.eye(3) + 1e-12 * np.eye(3)
    inverse = np.linalg.inv(hessian)
    rim = max(first.half_width_px, first.half_height_px)
    x, y, turn = (start[:, i] - (origins_px[:, i] if i < 2 else 0.0) for i in range(3))
    settled, inside = np.zeros(count, dtype=bool), np.ones(count, dtype=bool)
    residual, gain = np.zeros_like(own), np.ones(count, dtype=np.float64)
    correlation = np.zeros(count)
    at = np.arange(count)
    for _iteration in range(ITERATIONS):
        cosine, sine = np.cos(turn[at]), np.sin(turn[at])
        c32, s32 = cosine.astype(np.float32)[:, None], sine.astype(np.float32)[:, None]
        px = c32 * dx - s32 * dy + x[at].astype(np.float32)[:, None]
        py = s32 * dx + c32 * dy + y[at].astype(np.float32)[:, None]
        fits = (px.min(1) >= 1) & (py.min(1) >= 1) & (px.max(1) < width - 2) & (py.max(1) < height - 2)
        inside[at[~fits]] = False
        at, px, py, cosine, sine = at[fits], px[fits], py[fits], cosine[fits], sine[fits]
        if not at.size:
            break
        seen = sampled(flat, begin[at], width, px, py)
        seen -= (seen @ basis32.T) @ basis32
        power = np.einsum("ij,ij->i", seen, seen).astype(np.float64)
        common = np.einsum("ij,ij->i", seen, own[at]).astype(np.float64)
        gain[at] = common / np.maximum(power, 1e-12)
        own_power = np.einsum("ij,ij->i", own[at], own[at]).astype(np.float64)
        correlation[at] = common / np.sqrt(np.maximum(power * own_power, 1e-12))
        left = gain[at].astype(np.float32)[:, None] * seen - own[at]
        residual[at] = left
        score = np.einsum("kij,kj->ki", jacobian[at], left).astype(np.float64)
        step = np.einsum("kij,kj->ki", inverse[at], score)
        size = np.hypot(step[:, 0], step[:, 1])
        limit = np.minimum(1.0, 1.0 / np.maximum(np.maximum(size, rim * np.abs(step[:, 2])), 1e-12))
        step *= limit[:, None]
        # The warp is composed with the inverse of the step: x -> R (R_s^T (x - t_s)) + t.
        new_turn = turn[at] - step[:, 2]
        cosine, sine = np.cos(new_turn), np.sin(new_turn)
        x[at] -= cosine * step[:, 0] - sine * step[:, 1]
        y[at] -= sine * step[:, 0] + cosine * step[:, 1]
        turn[at] = new_turn
        done = np.maximum(size, rim * np.abs(step[:, 2])) < SETTLED_PX
        settled[at[done]] = True
        at = at[~done]
        if not at.size:
            break
    settled &= inside
    covariance, noise = _covariance(hessian, residual, gain, x, y, dx, dy, shared_pixels)
    return Registered(x + origins_px[:, 0], y + origins_px[:, 1], turn, covariance, correlation, noise, settled)


def _covariance(
    hessian: Doubles,
    residual: Floats,
    gain: Doubles,
    x: Doubles,
    y: Doubles,
    dx: Floats,
    dy: Floats,
    shared_pixels: float,
) -> tuple[Doubles, Doubles]:
    """Covariance of x, y and turn from what is left, and the noise of one picture.

    Both pictures have noise. Interpolated levels have less of it than pixels, so the residuals show
    `sigma^2 (1 + g^2 k)` with `k` below 1 by the phase; the estimate feels all of it, because the texture is coarser
    than the pixels: `2 sigma^2`. The gradients of the reference hold noise as well, which adds to the Gram matrix and
    is taken off it (errors in variables): covariance = sigma_r^2 H^-1 H_seen H^-1.
    """
    count, n = residual.shape
    table = _phase_power()
    places = [np.floor((v - np.floor(v)) * table.size).astype(np.intp) % table.size for v in (x, y)]
    power = table[places[0]] * table[places[1]]
    squares = np.einsum("ij,ij->i", residual, residual).astype(np.float64) / max(n - 7, 1)
    one = np.maximum(squares / (1.0 + gain**2 * power), ROUNDING)
    spread = one * (1.0 + gain**2) * shared_pixels
    noisy = np.zeros((count, 3, 3))
    turned = float((dx.astype(np.float64) ** 2 + dy.astype(np.float64) ** 2).sum())
    noisy[:, 0, 0] = noisy[:, 1, 1] = one * n * derivative_power()
    noisy[:, 2, 2] = one * turned * derivative_power()
    return _propagated(hessian, noisy, spread), np.sqrt(one)


def _propagated(hessian: Doubles, noisy: Doubles, spread: Doubles) -> Doubles:
    """Covariances of k patches, shape (k, 3, 3); infinite where gradients are those of noise or of one direction."""
    true = hessian - noisy
    size = np.sqrt(np.maximum(np.einsum("kii->ki", hessian), 1e-30))
    least = np.linalg.eigvalsh(true / (size[:, :, None] * size[:, None, :]))[:, 0]
    is_sound = least > LEAST_INFORMATION
    own = np.linalg.inv(np.where(is_sound[:, None, None], true, np.eye(3)))
    covariance = spread[:, None, None] * (own @ hessian @ own)
    return np.where(is_sound[:, None, None], covariance, np.diag([np.inf] * 3))


def reference_covariance(reference: PatchReference, noise: float) -> Doubles:
    """Covariance of x, y and turn that a registration of this patch will have, shape (3, 3).

    Infinite where its gradients are no more than those of the noise, or lie in one direction alone.

    Parameters
    ----------
    reference : PatchReference
        The patch.
    noise : float
        Standard deviation of the noise of one picture.
    """
    dx, dy, _ = _grid(reference.half_width_px, reference.half_height_px)
    variance = max(noise**2, ROUNDING)
    turned = float((dx.astype(np.float64) ** 2 + dy.astype(np.float64) ** 2).sum())
    noisy = variance * derivative_power() * np.diag([dx.size, dx.size, turned])
    return np.asarray(_propagated(reference.hessian[None], noisy[None], np.array([2.0 * variance]))[0])
