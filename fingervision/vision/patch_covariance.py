"""Covariance of a registered patch: noise of both pictures, scatter of the patch's blocks, aliasing."""

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.patch_reference import CURVATURE, SMOOTHING_PX, PatchReference, extent
from fingervision.vision.spline_interpolation import derivative_power, phase_power

Doubles = NDArray[np.float64]

# Least normalised eigenvalue of a Gram matrix; a smaller eigenvalue means noise, or an edge that does not determine the
# position along itself.
LEAST_INFORMATION = 0.02
# Least ratio of the Gram matrix to its expectation for noise. A smoothed patch of 31 px has about 150 independent
# gradients, so that three standard deviations of the noise's power are a third of it.
NOISE_MARGIN = 1.4
# Variance of rounding to whole grey levels, the least noise.
ROUNDING = 1.0 / 12.0


def residual_power(gain: Doubles, x: Doubles, y: Doubles) -> Doubles:
    """Mean square of the smoothed residuals of k patches for noise of unit variance in every pixel of both pictures."""
    table = phase_power(SMOOTHING_PX, CURVATURE)
    places = [np.floor((v - np.floor(v)) * table.size).astype(np.intp) % table.size for v in (x, y)]
    return np.asarray(table[0] ** 2 + gain**2 * table[places[0]] * table[places[1]])


def noise_covariance(
    hessian: Doubles,
    score: Doubles,
    residual: Doubles,
    by_noise: Doubles,
    gain: Doubles,
    half_size: tuple[int, int],
    shared_pixels: float,
) -> tuple[Doubles, Doubles]:
    """Covariance of x, y and rotation from the residuals, and standard deviation of the noise of one picture.

    Parameters
    ----------
    hessian, score : ndarray of float, shape (k, 3, 3)
        Of the references.
    residual, by_noise : ndarray of float, shape (k,)
        Mean square of the smoothed residuals, and the same for noise of unit variance (`residual_power`).
    gain : ndarray of float, shape (k,)
        Contrast of the reference relative to that of the picture.
    half_size : (int, int)
        Pixels on either side of the patch's middle across and down.
    shared_pixels : float
        Number of neighbouring pixels that share an error and count as one.

    Both pictures have noise of variance `sigma^2` per pixel. Smoothing and interpolation reduce it by the factors `k_0`
    (first picture) and `k` (second picture, by the sub-pixel phase), so that the residuals have the variance
    `sigma^2 (k_0 + g^2 k)`, where g is the gain. The estimate is affected by the pixels' noise after smoothing only,
    because the texture is coarser than the pixels: the covariance of the gradient projections is `2 sigma^2` times the
    Gram matrix of the gradients smoothed once more. The noise in the gradients of the reference increases their Gram
    matrix and is subtracted from it (errors in variables): covariance = sigma_r^2 H^-1 S_seen H^-1.
    """
    count, (n, turned) = residual.size, extent(*half_size)
    one = np.maximum(residual / by_noise, ROUNDING)
    spread = one * (1.0 + gain**2) * shared_pixels
    noisy = np.zeros((count, 3, 3))
    noisy[:, 0, 0] = noisy[:, 1, 1] = one * n * derivative_power(SMOOTHING_PX, CURVATURE)
    noisy[:, 2, 2] = one * turned * derivative_power(SMOOTHING_PX, CURVATURE)
    return _propagated(hessian, score, noisy, spread), np.sqrt(one)


def widened(covariance: Doubles, inverse: Doubles, scores: Doubles, aliasing: Doubles) -> Doubles:
    """Increase covariances to the scatter of the patch's blocks and to aliasing, where these exceed the noise.

    If the residuals are not noise but texture that moves differently from the rest (because of aliasing, or on a
    surface that deforms), the covariance is estimated from the scatter of the blocks (White, Econometrica 48, 1980,
    doi:10.2307/1912934). An error that is common to a whole edge along the patch does not appear in the scatter of the
    blocks, but in the prediction from the patch's spectrum (`aliasing`).

    Parameters
    ----------
    covariance : ndarray of float, shape (k, 3, 3)
        Covariance due to the noise.
    inverse : ndarray of float, shape (k, 3, 3)
        Inverse of the Gram matrices.
    scores : ndarray of float, shape (k, blocks, 3)
        Products of gradients and residuals by block; their sum is zero if the registration has converged.
    aliasing : ndarray of float, shape (k, 3)
        Variances of x, y and rotation due to aliasing, predicted for the sub-pixel phases found.
    """
    blocks = scores.shape[1]
    away = (scores - scores.mean(axis=1, keepdims=True)) @ inverse
    seen = np.einsum("kbi,kbi->ki", away, away) * (blocks / (blocks - 3.0))
    ratio = np.maximum(seen, aliasing) / np.einsum("kii->ki", covariance)
    wider = np.sqrt(np.maximum(ratio, 1.0))
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
    """Predicted covariance of x, y and rotation for a registration of a patch, shape (3, 3).

    The covariance is infinite if the gradients do not exceed those of noise, or if all of them have the same direction.

    Parameters
    ----------
    reference : PatchReference
        The patch.
    noise : float
        Standard deviation of the noise of one picture.
    """
    variance = max(noise**2, ROUNDING)
    pixels, turned = extent(reference.half_width_px, reference.half_height_px)
    noisy = variance * derivative_power(SMOOTHING_PX, CURVATURE) * np.diag([pixels, pixels, turned])
    return np.asarray(
        _propagated(reference.hessian[None], reference.score[None], noisy[None], np.array([2.0 * variance]))[0]
    )
