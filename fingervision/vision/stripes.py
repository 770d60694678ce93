"""Fit a gap narrower than the blur, in which the light does not reach the level of the background.

Within a row, the contrast of a gap narrower than the blur cannot be separated from its width. The contrast is therefore
taken from the tips, where the same background is in full view, and both edges of a row are fitted together.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.edge_filters import blurred_step, curvature_gain
from fingervision.vision.edges import EdgePoints
from fingervision.vision.facing import facing_lines
from fingervision.vision.grey import GreyImage
from fingervision.vision.profile_lines import ROWS

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Distance of the two edges (in sigma of the blur) below which they are fitted together as a stripe.
NEAR_SIGMAS = 7.0
ITERATIONS = 6
# Relative standard uncertainty with which the background between the fingers is as light as the background beyond the
# tips.
U_CONTRAST = 0.015
# Slope of a notch's sides, and width (in sigma) below which such a notch is left out.
CLOSING_SLOPE, NOTCH_SIGMAS = 0.1, 3.0


@dataclass(frozen=True, slots=True, eq=False)
class StripeEdges:
    """Left and right edge of a narrow gap (a bright stripe) in every row; arrays of shape (n,).

    Parameters
    ----------
    left, right : ndarray of float
        Positions where the background begins and ends, in the picture's pixels.
    u_noise : ndarray of float
        Standard uncertainty of each edge from the noise of its own row.
    u_shared : ndarray of float
        Standard uncertainty of each edge due to the contrast, which is the same in all rows.
    """

    left: Floats
    right: Floats
    u_noise: Floats
    u_shared: Floats


def with_stripes(upright: GreyImage, edges: EdgePoints, light: Floats) -> EdgePoints:
    """Return the points, with both edges of a row fitted as one stripe in rows where the fingers nearly touch."""
    lines, reach = edges.lines, edges.reach_px
    facing = facing_lines(lines, reach)
    if facing is None:
        return edges
    left, right = facing
    gap = edges.position[1, right] - edges.position[0, left]
    tips = lines.weight[:, ROWS:] > 0
    blur = float(edges.blur_px[:, 1].mean())
    near = gap < NEAR_SIGMAS * blur
    if not near.any() or not tips.any():
        return edges
    left, right = left[near], right[near]
    contrast = float(np.median(edges.contrast[:, ROWS:][tips]))
    slope = 0.5 * (lines.slope[0, left] - lines.slope[1, right])
    sigma = np.sqrt(blur**2 * (1.0 + slope**2) + slope**2 / 12.0)
    stripes = fit_stripes(
        upright,
        lines.fixed[0, left],
        edges.position[0, left],
        edges.position[1, right],
        sigma,
        contrast,
        edges.noise,
        reach,
        light,
    )
    position, u_position = edges.position.copy(), edges.u_position.copy()
    position[0, left], position[1, right] = stripes.left, stripes.right
    # The uncertainty that is common to all rows must not average out over the rows.
    u_row = np.hypot(stripes.u_noise, stripes.u_shared * np.sqrt(len(left)))
    u_position[0, left] = u_position[1, right] = u_row
    contrasts = edges.contrast.copy()
    contrasts[0, left] = contrasts[1, right] = contrast
    gain = edges.curvature_gain.copy()
    gain[0, left] = gain[1, right] = curvature_gain(slope, (reach + 0.5 * gap[near]) / sigma)
    # Near the end of a notch, blur mixes in light from the overlapping fingers below, which belongs to neither edge.
    weight = lines.weight.copy()
    closes = (slope > CLOSING_SLOPE) & (stripes.right - stripes.left < NOTCH_SIGMAS * sigma)
    weight[0, left[closes]] = weight[1, right[closes]] = 0.0
    lines = replace(lines, weight=weight)
    blurs = edges.blur_px.copy()
    blurs[:, 0] = blur
    return replace(
        edges,
        lines=lines,
        position=position,
        u_position=u_position,
        contrast=contrasts,
        blur_px=blurs,
        curvature_gain=gain,
    )


def fit_stripes(
    upright: GreyImage,
    row: Ints,
    left: Floats,
    right: Floats,
    sigma: Floats,
    contrast: float,
    noise: float,
    margin: int,
    light: Floats | None = None,
) -> StripeEdges:
    """Fit a blurred stripe of known contrast to each row.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels.
    row : ndarray of int, shape (n,)
        Row numbers.
    left, right : ndarray of float, shape (n,)
        Initial estimates of the edges.
    sigma : ndarray of float, shape (n,)
        Blur along the row.
    contrast : float
        Level of the background minus level of the fingers.
    noise : float
        Standard deviation of the grey levels.
    margin : int
        Number of pixels of the fingers on either side.
    light : ndarray of float, shape (levels,), or None
        Light for every grey level (look-up table); None if the levels are proportional to light.

    Returns
    -------
    StripeEdges
        One pair of edges per row.
    """
    middle = np.rint(0.5 * (left + right)).astype(int)
    reach = int(np.ceil(0.5 * float((right - left).max()))) + margin
    columns = np.clip(middle[:, None] + np.arange(-reach, reach + 1), 0, upright.shape[1] - 1)
    levels = upright[row[:, None], columns]
    values = levels.astype(np.float64) if light is None else light[levels]
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
