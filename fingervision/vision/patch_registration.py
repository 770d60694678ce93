"""Translation and rotation of a textured surface, by registration of patches against a reference picture.

The zero-normalised sum of squared differences is minimised over translation and rotation by the inverse-compositional
Gauss-Newton method (Baker & Matthews, Int. J. Computer Vision 56(3), 2004, doi:10.1023/B:VISI.0000011205.11775.fd; Pan,
Li & Tong, Experimental Mechanics 53(7), 2013, doi:10.1007/s11340-013-9717-6). A linear gradient of light and a gain are
removed from both pictures. Both pictures are smoothed in the same way and interpolated by cubic B-splines
(`spline_interpolation`). Many patches of one size are registered together.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.patch_aliasing import aliasing_at
from fingervision.vision.patch_covariance import noise_covariance, residual_power, widened
from fingervision.vision.patch_reference import CURVATURE, SMOOTHING_PX, PatchReference  # noqa: F401 - the loop takes it
from fingervision.vision.spline_interpolation import coefficients

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

# Step (pixels at the patch's rim) below which the Gauss-Newton iteration ends, with a remaining error below 0.001 px,
# and largest number of steps.
SETTLED_PX, ITERATIONS = 0.01, 12
# Number of blocks across and down into which a patch is divided. Each block contains several correlation lengths of
# smoothed noise (2.5 px), and sixteen blocks determine a variance with a relative uncertainty of a third.
BLOCKS = 4

# Unknowns of a registration: x, y, rotation, gain, and the plane's three.
UNKNOWNS = 7

_settled = loop("patch_registration_settled")


@dataclass(frozen=True, slots=True, eq=False)
class Registered:
    """Positions and rotations of k patches in another picture.

    Parameters
    ----------
    x_px, y_px, turn_rad : ndarray of float, shape (k,)
        Middle of each patch, and rotation clockwise on the screen relative to the reference picture.
    covariance : ndarray of float, shape (k, 3, 3)
        Covariance of x, y and rotation, from the noise of both pictures, the scatter of its blocks, and aliasing.
    correlation : ndarray of float, shape (k,)
        Zero-normalised correlation of the patch with the registered part of the picture, with planes subtracted.
    noise : ndarray of float, shape (k,)
        Standard deviation of the noise of one picture.
    settled : ndarray of bool, shape (k,)
        Whether the registration converged inside the given part.
    aliasing_px : ndarray of float, shape (k,)
        Standard deviation of x or y by texture that is too fine for the pixels, at the sub-pixel phase where it is
        largest.
    """

    x_px: Doubles
    y_px: Doubles
    turn_rad: Doubles
    covariance: Doubles
    correlation: Doubles
    noise: Doubles
    settled: NDArray[np.bool_]
    aliasing_px: Doubles


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
    residual, by_noise = squares / max((2 * size[0] + 1) * (2 * size[1] + 1) - UNKNOWNS, 1), residual_power(gain, x, y)
    covariance, noise = noise_covariance(hessian, score, residual, by_noise, gain, size, shared_pixels)
    aliasing = [reference.aliasing for reference in references]
    aliased = aliasing_at(aliasing, (x, y, turn), size, residual, by_noise)
    covariance = widened(covariance, inverse, scores, aliased.variance)
    x_px, y_px = (np.stack([x, y], axis=1) + aliased.pull_px + origins_px).T
    return Registered(x_px, y_px, turn, covariance, correlation, noise, settled, aliased.worst_px)
