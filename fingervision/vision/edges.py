"""Step 5, the edges: where the grey level passes from finger to ground, in every row and column of the outline.

Each row across a flank, and each column across a tip, holds one edge: a step between two levels of its own, spread by
a Gaussian and integrated over the pixel. The position is the maximum-likelihood one under white noise, so its variance
is the Cramer-Rao bound. What all rows share is the spread, one for the flanks and one for the tip of each finger
(motion spreads a flank more than a tip). Nothing is resampled.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from fingervision.vision.edge_filters import LARGEST_OFFSET_PX, EdgeFilters, blurred_step, edge_filters, reach_for
from fingervision.vision.grey import GreyImage
from fingervision.vision.profile_lines import INNER, IS_ROW, PLACES, ROWS, ProfileLines
from fingervision.vision.stripes import NEAR_SIGMAS, fit_stripes

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Half-length of the first look at an edge (pixels), enough for the strongest blur that is still measured; at one line
# in so many.
FIRST_REACH_PX, FIRST_LOOK = 20, 6
# Blur of an edge is looked for within these limits (pixels); `blurred` begins at 5.
SMALLEST_BLUR_PX, LARGEST_BLUR_PX = 0.2, 8.0
# The passes of Gauss-Newton, and whether each also refines the blur. It converges quadratically from the first look.
BLUR_PASSES = (True, True, False)
# A notch whose sides close in at this slope is left out where it is narrower than so many sigma.
CLOSING_SLOPE, NOTCH_SIGMAS = 0.1, 3.0
# Variance of rounding to whole grey levels, and of a pixel's own width: no noise and no blur is smaller.
ROUNDING = PIXEL_VARIANCE = 1.0 / 12.0


@dataclass(frozen=True, slots=True, eq=False)
class EdgePoints:
    """Sub-pixel points of two fingers' half-level outlines; arrays of shape (2, PLACES) unless said otherwise.

    Parameters
    ----------
    lines : ProfileLines
        Where they were looked for.
    position : ndarray of float
        Coordinate along each line, in the picture's pixels.
    u_position : ndarray of float
        Standard uncertainty of each from the noise of its own profile.
    contrast : ndarray of float
        Outside level minus inside level.
    blur_px : ndarray of float, shape (2, 2)
        Gaussian sigma of the optics at each finger's flanks and tip, without the pixel.
    noise : float
        Standard deviation of the grey levels about the model.
    curvature_gain : ndarray of float
        How much more than the half-level a fit along this line feels the outline's curvature.
    is_clipped : ndarray of bool
        Whether the flank itself, not only the plateau, touches the end of the scale.
    """

    lines: ProfileLines
    position: Floats
    u_position: Floats
    contrast: Floats
    blur_px: Floats
    noise: float
    curvature_gain: Floats
    is_clipped: NDArray[np.bool_]


def fit_edges(upright: GreyImage, lines: ProfileLines) -> EdgePoints:
    """Sub-pixel position of the edge on every line of two fingers.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels, seen with the tips up.
    lines : ProfileLines
        Where to look.

    Returns
    -------
    EdgePoints
        One point a line.
    """
    blur = _first_blur(upright, lines)
    filters = edge_filters(reach_for(blur))
    values = _gather(upright, lines, filters.reach_px)
    # Where the coarse outline lies a pixel off, the window follows the edge: what finds must not sway what measures.
    off = np.floor(_first_position(values)).astype(np.intp)
    lines = replace(lines, coarse=lines.coarse + lines.outward * off)
    values = _gather(upright, lines, filters.reach_px)
    edges = _fit(values, lines, np.full((2, 2), blur), filters, float(np.iinfo(upright.dtype).max))
    return _with_stripes(upright, edges, filters.reach_px)


def _with_stripes(upright: GreyImage, edges: EdgePoints, reach: int) -> EdgePoints:
    """The same points, but where the fingers nearly touch both edges of a row are fitted as one stripe."""
    lines = edges.lines
    facing = _facing(lines, reach)
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
    )
    position, u_position = edges.position.copy(), edges.u_position.copy()
    position[0, left], position[1, right] = stripes.left, stripes.right
    # What all rows share must not average out over them.
    u_row = np.hypot(stripes.u_noise, stripes.u_shared * np.sqrt(len(left)))
    u_position[0, left] = u_position[1, right] = u_row
    contrasts = edges.contrast.copy()
    contrasts[0, left] = contrasts[1, right] = contrast
    gain = edges.curvature_gain.copy()
    reach_sigmas = (reach + 0.5 * gap[near]) / sigma
    gain[0, left] = gain[1, right] = 1.0 + slope**2 * _skew(reach_sigmas)
    # Where a notch closes, the fingers overlap just below: what blur brings up from there belongs to neither edge.
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


def _gather(upright: GreyImage, lines: ProfileLines, reach: int) -> Floats:
    """Grey levels from inside to outside, `reach` pixels to either side of the coarse edge, shape (2, PLACES, n).

    Beyond the picture's border the last pixel is repeated: what is cut off there is a finger's inside or the ground.
    """
    rows, columns = upright.shape
    moving = lines.coarse[..., None] + lines.outward[..., None] * np.arange(-reach, reach + 1)
    across, along = moving[:, :ROWS], moving[:, ROWS:]
    np.minimum(np.maximum(across, 0, out=across), columns - 1, out=across)
    np.minimum(np.maximum(along, 0, out=along), rows - 1, out=along)
    values = np.empty(moving.shape)
    values[:, :ROWS] = upright[lines.fixed[:, :ROWS, None], across]
    values[:, ROWS:] = upright[along, lines.fixed[:, ROWS:, None]]
    return values


def _first_blur(upright: GreyImage, lines: ProfileLines) -> float:
    """Blur of the edges from the steepest place of some of the flanks' rows, robustly."""
    some_rows = slice(0, INNER, FIRST_LOOK)
    row, coarse = lines.fixed[:, some_rows], lines.coarse[:, some_rows]
    real = lines.weight[:, some_rows] > 0
    steps = np.arange(-FIRST_REACH_PX, FIRST_REACH_PX + 1)
    column = coarse[real][:, None] + lines.outward[:, some_rows][real][:, None] * steps
    np.minimum(np.maximum(column, 0, out=column), upright.shape[1] - 1, out=column)
    values = upright[row[real][:, None], column].astype(np.float64)
    if not len(values):
        return 1.0
    middle = values[:, FIRST_REACH_PX - 9 : FIRST_REACH_PX + 10]
    steepest = np.abs(middle[:, 2:] - middle[:, :-2]).max(axis=1) / 2.0
    contrast = np.abs(values[:, -6:].mean(axis=1) - values[:, :6].mean(axis=1))
    share = np.sort(steepest / np.maximum(contrast, 1.0))[len(values) // 2]
    return float(np.clip(1.0 / ndtri(0.5 + np.clip(share, 0.02, 0.49)), SMALLEST_BLUR_PX, LARGEST_BLUR_PX))


def _fit(values: Floats, lines: ProfileLines, blur: Floats, filters: EdgeFilters, top_level: float) -> EdgePoints:
    """Gauss-Newton over every line's two levels and position, and the blur of flanks and tips."""
    stretch = 1.0 + lines.slope**2
    from_slope = (stretch - 1.0) / 12.0
    facing = _facing(lines, filters.reach_px)
    position, levels = _first_position(values), values
    count = np.maximum(_by_part(lines.weight), 1.0)
    for is_blur_free in BLUR_PASSES:
        own_blur = np.repeat(blur, (ROWS, PLACES - ROWS), axis=1)
        sigma = np.sqrt(own_blur**2 * stretch + from_slope)
        at = filters.rows(sigma), filters.columns(position)
        contrast = np.einsum("fnk,fnk->fn", filters.contrast[at], levels)
        safe = np.where(np.abs(contrast) < 1e-3, 1e-3, contrast)
        move = np.einsum("fnk,fnk->fn", filters.shift[at], levels) / safe
        position = filters.offsets_px[at[1]] + np.minimum(np.maximum(move, -1.0), 1.0)
        position = np.minimum(np.maximum(position, -LARGEST_OFFSET_PX), LARGEST_OFFSET_PX)
        if is_blur_free:
            change = np.einsum("fnk,fnk->fn", filters.blur[at], levels) / safe * sigma / (own_blur * stretch)
            change = np.minimum(np.maximum(change, -0.3), 0.3) * lines.weight
            blur = np.clip(blur + _by_part(change) / count, SMALLEST_BLUR_PX, LARGEST_BLUR_PX)
        if facing is not None:
            levels = _without_the_other(values, lines, filters.reach_px, facing, position, contrast, sigma)
    remainder = position - filters.offsets_px[at[1]]
    free = levels.shape[-1] - 3.0
    residual = levels - levels.mean(axis=-1, keepdims=True) - contrast[..., None] * filters.step[at]
    # The last part of an eighth of a pixel is not in the table's edge: its share is taken off to first order.
    gain = filters.shift_gain[at]
    mean_square = (np.einsum("fnk,fnk->fn", residual, residual) - (contrast * remainder * gain) ** 2) / free
    typical = np.sort(mean_square[lines.weight > 0])[int(lines.weight.sum()) // 2]
    noise_variance = max(float(typical), ROUNDING)
    return EdgePoints(
        lines,
        lines.coarse + lines.outward * position,
        np.sqrt(np.maximum(mean_square, noise_variance)) / (np.abs(safe) * gain),
        contrast,
        blur,
        float(np.sqrt(noise_variance)),
        1.0 + lines.slope**2 * _skew(filters.reach_px / sigma),
        _clipped(values, position, sigma, filters.reach_px, top_level),
    )


def _by_part(a: Floats) -> Floats:
    """Sums over each finger's flanks and over its tip, shape (2, 2)."""
    return np.add.reduceat(a, (0, ROWS), axis=1)


def _first_position(values: Floats) -> Floats:
    """Where an edge between the window's two end levels would have the same mean level as the window."""
    n = values.shape[-1]
    inside, outside = values[..., :3].sum(axis=-1) / 3.0, values[..., -3:].sum(axis=-1) / 3.0
    contrast = outside - inside
    share = (outside - values.mean(axis=-1)) / np.where(np.abs(contrast) < 1e-3, 1e-3, contrast)
    return np.asarray(np.minimum(np.maximum(share * n - 0.5 * n, -2.0), 2.0))


def _facing(lines: ProfileLines, reach: int) -> tuple[Ints, Ints] | None:
    """Inner lines of the left and of the right finger in the same rows, where one window holds both edges."""
    filled = [int(n) for n in lines.weight[:, :INNER].sum(axis=1)]
    if min(filled) == 0 or lines.coarse[1, : filled[1]].min() - lines.coarse[0, : filled[0]].max() >= 2 * reach:
        return None
    _, left, right = np.intersect1d(lines.fixed[0, : filled[0]], lines.fixed[1, : filled[1]], return_indices=True)
    near = lines.coarse[1, right] - lines.coarse[0, left] < 2 * reach
    return (left[near], right[near]) if near.any() else None


def _without_the_other(
    values: Floats,
    lines: ProfileLines,
    reach: int,
    facing: tuple[Ints, Ints],
    position: Floats,
    contrast: Floats,
    sigma: Floats,
) -> Floats:
    """Grey levels without the other finger, where it reaches into the window: the ground between is a stripe."""
    levels = values.copy()
    edge = lines.coarse + lines.outward * position
    borders = np.arange(-reach - 0.5, reach + 1.0)
    for own, other in ((0, 1), (1, 0)):
        mine, theirs = facing[own], facing[other]
        away = lines.outward[own, mine] * (edge[other, theirs] - lines.coarse[own, mine])
        step, _, _ = blurred_step(borders - away[:, None], sigma[other, theirs][:, None])
        levels[own, mine] += contrast[own, mine][:, None] * step
    return levels


def _clipped(values: Floats, position: Floats, sigma: Floats, reach: int, top_level: float) -> NDArray[np.bool_]:
    """Whether the flank itself, within 0.7 sigma and a pixel's breadth of the edge, touches the end of the scale.

    Where the ground is far beyond the scale, what is left of a flank looks steep: sigma alone would look too near.
    """
    if values.min() > 0 and values.max() < top_level:
        return np.zeros(position.shape, dtype=bool)
    near = np.abs(np.arange(-reach, reach + 1) - position[..., None]) < np.maximum(0.7 * sigma, 0.8)[..., None]
    return np.asarray((((values <= 0) | (values >= top_level)) & near).any(axis=-1))


def _skew(reach_sigmas: Floats) -> Floats:
    """What a fit with two free levels makes of an edge whose distance along the line is not quite straight.

    Along a line that meets a curved edge at a slant of slope m, the distance to the edge is t + kappa m^2 t^2 / (2 (1 +
    m^2)^(1/2)). Projected on the fit's own directions over a window of w standard deviations this moves the position by
    m^2 c sigma^2 kappa / 2 across the edge, c = (1 / (4 sqrt pi) - 1 / 2w) / (1 / (2 sqrt pi) - 1 / 2w).
    """
    level = 0.5 / np.maximum(reach_sigmas, 2.5)
    root = 0.5 / np.sqrt(np.pi)
    return np.asarray((0.5 * root - level) / (root - level))


def outline_blur(edges: EdgePoints) -> Floats:
    """Blur (sigma_e, the pixel included) that the curvature of the outline is felt through, shape (2, PLACES)."""
    own = np.where(IS_ROW, edges.blur_px[:, :1], edges.blur_px[:, 1:])
    return np.asarray(np.sqrt((own**2 + PIXEL_VARIANCE) * edges.curvature_gain))
