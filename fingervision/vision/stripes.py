"""The ground between two near edges: a stripe narrower than the blur never reaches the ground's own level.

Its contrast cannot be told from its width in the row itself, so the contrast is taken from the tips, where the same
ground lies open, and both edges of a row are fitted together.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.edge_filters import blurred_step
from fingervision.vision.grey import GreyImage

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# A stripe is fitted as one where its edges are nearer than so many sigma of the blur.
NEAR_SIGMAS = 7.0
ITERATIONS = 6
# The ground between the fingers and that beyond the tips are lit alike to this (standard uncertainty, relative).
U_CONTRAST = 0.015


@dataclass(frozen=True, slots=True, eq=False)
class StripeEdges:
    """Both edges of a stripe in every row; arrays of shape (n,).

    Parameters
    ----------
    left, right : ndarray of float
        Where the ground begins and ends, in the picture's pixels.
    u_noise : ndarray of float
        Standard uncertainty of each edge from the noise of its own row.
    u_shared : ndarray of float
        Standard uncertainty of each edge from the contrast, which all rows share.
    """

    left: Floats
    right: Floats
    u_noise: Floats
    u_shared: Floats


def fit_stripes(
    upright: GreyImage,
    row: Ints,
    left: Floats,
    right: Floats,
    sigma: Floats,
    contrast: float,
    noise: float,
    margin: int,
) -> StripeEdges:
    """Fit a blurred stripe of known contrast to each row.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels.
    row : ndarray of int, shape (n,)
        Rows.
    left, right : ndarray of float, shape (n,)
        First guess of the edges.
    sigma : ndarray of float, shape (n,)
        Blur along the row.
    contrast : float
        Level of the ground minus level of the fingers.
    noise : float
        Standard deviation of the grey levels.
    margin : int
        Pixels of the fingers to either side.

    Returns
    -------
    StripeEdges
        One a row.
    """
    middle = np.rint(0.5 * (left + right)).astype(int)
    reach = int(np.ceil(0.5 * float((right - left).max()))) + margin
    columns = np.clip(middle[:, None] + np.arange(-reach, reach + 1), 0, upright.shape[1] - 1)
    values = upright[row[:, None], columns].astype(np.float64)
    borders = np.arange(-reach - 0.5, reach + 1.0)
    wide = sigma[:, None]
    centre, width = 0.5 * (left + right) - middle, np.maximum(right - left, 0.5)
    for _iteration in range(ITERATIONS):
        rise, by_left, _ = blurred_step(borders - (centre - 0.5 * width)[:, None], wide)
        fall, by_right, _ = blurred_step(borders - (centre + 0.5 * width)[:, None], wide)
        stripe = rise - fall
        jacobian = np.stack(
            (np.ones_like(stripe), contrast * (by_left - by_right), -0.5 * contrast * (by_left + by_right)), axis=-1
        )
        turned = np.swapaxes(jacobian, 1, 2)
        normal = turned @ jacobian + 1e-9 * np.eye(3)
        level = (values - contrast * stripe).mean(axis=1, keepdims=True)
        residual = values - contrast * stripe - level
        move = np.linalg.solve(normal, turned @ residual[..., None])[..., 0]
        centre = centre + np.clip(move[:, 1], -1.0, 1.0)
        width = np.maximum(width + np.clip(move[:, 2], -1.0, 1.0), 0.05)
    inverse = np.linalg.inv(normal)
    by_contrast = (inverse @ (turned @ stripe[..., None]))[:, 2, 0] * contrast
    return StripeEdges(
        left=middle + centre - 0.5 * width,
        right=middle + centre + 0.5 * width,
        u_noise=noise * np.sqrt(inverse[:, 1, 1] + 0.25 * inverse[:, 2, 2]),
        u_shared=0.5 * U_CONTRAST * np.abs(by_contrast),
    )
