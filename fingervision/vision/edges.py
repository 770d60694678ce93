"""Step 5, the edges: where the grey level passes from finger to ground, in every row and column of the outline.

Each row across a flank, and each column across a tip, holds one edge: a step between two levels of its own, spread by
a Gaussian and integrated over the pixel. The position is the maximum-likelihood one under white noise, so its variance
is the Cramer-Rao bound. What all rows share is the spread, one for each flank and each tip (motion spreads a
flank more than a tip). Nothing is resampled.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from fingervision.vision.edge_filters import LARGEST_OFFSET_PX, EdgeFilters, blurred_step, edge_filters, reach_for
from fingervision.vision.fingers import CoarseFinger
from fingervision.vision.grey import GreyImage

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Half-length of the first look at an edge (pixels): enough for the strongest blur that is still measured.
FIRST_REACH_PX = 20
# Blur of an edge is looked for within these limits (pixels); `blurred` begins at 5.
SMALLEST_BLUR_PX, LARGEST_BLUR_PX = 0.2, 8.0
# Two flanks and two tips.
GROUPS = 4
# The passes of Gauss-Newton, and whether each also refines the blur. It converges quadratically from the first look.
BLUR_PASSES = (True, True, False)
# Variance of rounding to whole grey levels: no noise is smaller.
PIXEL_ROUNDING = 1.0 / 12.0
# Wide tips and long flanks have points enough: so many columns of a tip, so many rows of an outer flank.
TIP_COLUMNS, OUTER_ROWS = 100, 20
# Outline slopes are taken over so many rows or columns to either side.
SLOPE_REACH_PX = 4


@dataclass(frozen=True, slots=True, eq=False)
class ProfileLines:
    """Where to look: one line of pixels across the outline for every row of a flank and every column of a tip.

    All arrays have length n. Coordinates are the fingers' axes (across, along).

    Parameters
    ----------
    group : ndarray of int
        0 flank and 1 tip of the left finger, 2 and 3 of the right one.
    is_row : ndarray of bool
        Whether the line runs along a row (across the fingers) or along a column.
    fixed : ndarray of int
        The row or column.
    coarse : ndarray of int
        The finger's last pixel on that line.
    outward : ndarray of int
        +1 or -1: the sense in which the line leaves the finger.
    slope : ndarray of float
        Change of the edge per row or column.
    is_inner : ndarray of bool
        Whether the line crosses the side that faces the gap.
    """

    group: Ints
    is_row: NDArray[np.bool_]
    fixed: Ints
    coarse: Ints
    outward: Ints
    slope: Floats
    is_inner: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class EdgePoints:
    """Sub-pixel points of the half-level outline.

    Parameters
    ----------
    lines : ProfileLines
        Where they were looked for.
    position : ndarray of float, shape (n,)
        Coordinate along each line, in the picture's pixels.
    u_position : ndarray of float, shape (n,)
        Standard uncertainty of each from the noise of its own profile.
    contrast : ndarray of float, shape (n,)
        Outside level minus inside level.
    blur_px : ndarray of float, shape (4,)
        Gaussian sigma of the optics in each group, without the pixel.
    noise : float
        Standard deviation of the grey levels about the model.
    curvature_gain : ndarray of float, shape (n,)
        How much more than the half-level a fit along this line feels the outline's curvature.
    clipped : ndarray of bool, shape (n,)
        Whether the flank itself, not only the plateau, touches the end of the scale.
    """

    lines: ProfileLines
    position: Floats
    u_position: Floats
    contrast: Floats
    blur_px: Floats
    noise: float
    curvature_gain: Floats
    clipped: NDArray[np.bool_]


def profile_lines(left: CoarseFinger, right: CoarseFinger) -> ProfileLines:
    """Lines across both fingers' outlines, each outline point belonging to one line only."""
    pieces = [piece for number, finger in enumerate((left, right)) for piece in _finger_lines(finger, 2 * number)]
    columns = [np.concatenate(column) for column in zip(*pieces, strict=True)]
    return ProfileLines(*columns)


def _finger_lines(finger: CoarseFinger, group: int) -> list[tuple[NDArray[np.generic], ...]]:
    across, along = finger.outline[:, 0], finger.outline[:, 1]
    crest = int(np.argmin(along))
    sides = []
    for part, sign in ((slice(None, crest + 1), finger.inner_sign), (slice(crest, None), -finger.inner_sign)):
        first, last = int(along[part].min()), int(along[part].max())
        reach = np.full(last - first + 1, -np.inf)
        np.maximum.at(reach, along[part] - first, sign * across[part])
        rows = np.arange(first, last + 1)
        slope = sign * _slope(reach)
        keep = np.flatnonzero(np.abs(slope) <= 1.0)
        if sign != finger.inner_sign:
            keep = keep[:: max(1, len(keep) // OUTER_ROWS)]
        n = len(keep)
        sides.append(
            (
                np.full(n, group),
                np.ones(n, dtype=bool),
                rows[keep],
                (sign * reach[keep]).astype(int),
                np.full(n, sign),
                slope[keep],
                np.full(n, sign == finger.inner_sign),
            )
        )
    first, last = int(across.min()), int(across.max())
    height = np.full(last - first + 1, np.inf)
    np.minimum.at(height, across - first, along)
    slope = _slope(height)
    keep = np.flatnonzero(np.abs(slope) < 1.0)
    keep = keep[:: max(1, len(keep) // TIP_COLUMNS)]
    n = len(keep)
    crest_lines = (
        np.full(n, group + 1),
        np.zeros(n, dtype=bool),
        np.arange(first, last + 1)[keep],
        height[keep].astype(int),
        np.full(n, -1),
        slope[keep],
        np.zeros(n, dtype=bool),
    )
    return [*sides, crest_lines]


def _slope(values: Floats) -> Floats:
    """Slope over `SLOPE_REACH_PX` to either side, one-sided at the ends."""
    n = len(values)
    index = np.arange(n)
    low, high = np.maximum(index - SLOPE_REACH_PX, 0), np.minimum(index + SLOPE_REACH_PX, n - 1)
    return (values[high] - values[low]) / np.maximum(high - low, 1)


def fit_edges(upright: GreyImage, lines: ProfileLines) -> EdgePoints:
    """Sub-pixel position of the edge on every line.

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
    filters = edge_filters(reach_for(float(blur.max())))
    values = _gather(upright, lines, filters.reach_px)
    return _fit(values, lines, blur, filters, float(np.iinfo(upright.dtype).max))


def _gather(upright: GreyImage, lines: ProfileLines, reach: int) -> Floats:
    """Grey levels from inside to outside, `reach` pixels to either side of the coarse edge.

    Beyond the picture's border the last pixel is repeated: what is cut off there is a finger's inside or the ground.
    """
    moving = lines.coarse[:, None] + lines.outward[:, None] * np.arange(-reach, reach + 1)
    is_row = lines.is_row
    rows, columns = upright.shape
    values = np.empty(moving.shape)
    across, along = moving[is_row], moving[~is_row]
    np.clip(across, 0, columns - 1, out=across)
    np.clip(along, 0, rows - 1, out=along)
    values[is_row] = upright[lines.fixed[is_row][:, None], across]
    values[~is_row] = upright[along, lines.fixed[~is_row][:, None]]
    return values


def _first_blur(upright: GreyImage, lines: ProfileLines) -> Floats:
    """Blur of each group from the steepest place of some of its profiles, robustly."""
    blur = np.full(GROUPS, 1.0)
    some = ProfileLines(*(getattr(lines, name)[::4] for name in ProfileLines.__slots__))
    values = _gather(upright, some, FIRST_REACH_PX)
    middle = values[:, FIRST_REACH_PX - 9 : FIRST_REACH_PX + 10]
    steepest = np.abs(middle[:, 2:] - middle[:, :-2]).max(axis=1) / 2.0
    contrast = np.abs(values[:, -6:].mean(axis=1) - values[:, :6].mean(axis=1))
    share = np.clip(steepest / np.maximum(contrast, 1.0), 0.02, 0.49)
    for group in range(GROUPS):
        mine = some.group == group
        if mine.any():
            blur[group] = 1.0 / ndtri(0.5 + float(np.median(share[mine])))
    return np.clip(blur, SMALLEST_BLUR_PX, LARGEST_BLUR_PX)


def _fit(values: Floats, lines: ProfileLines, blur: Floats, filters: EdgeFilters, top_level: float) -> EdgePoints:
    """Gauss-Newton over every line's two levels and position, and every group's blur."""
    stretch = 1.0 + lines.slope**2
    from_slope = lines.slope**2 / 12.0
    facing, partner = _facing(lines, filters.reach_px)
    position, levels = _first_position(values), values
    limit = LARGEST_OFFSET_PX
    for change_blur in BLUR_PASSES:
        sigma = np.sqrt(blur[lines.group] ** 2 * stretch + from_slope)
        row, column = filters.rows(sigma), filters.columns(position)
        start = filters.offsets_px[column]
        contrast = np.einsum("nk,nk->n", filters.contrast[row, column], levels)
        safe = np.where(np.abs(contrast) < 1e-3, 1e-3, contrast)
        move = np.einsum("nk,nk->n", filters.shift[row, column], levels) / safe
        position = np.clip(start + np.clip(move, -1.0, 1.0), -limit, limit)
        if change_blur:
            change = np.einsum("nk,nk->n", filters.blur[row, column], levels) / safe
            by_blur = np.clip(change * sigma / (blur[lines.group] * stretch), -0.3, 0.3)
            count = np.maximum(np.bincount(lines.group, minlength=GROUPS), 1)
            blur = np.clip(
                blur + np.bincount(lines.group, by_blur, minlength=GROUPS) / count, SMALLEST_BLUR_PX, LARGEST_BLUR_PX
            )
        if len(facing):
            levels = _without_the_other(values, lines, filters.reach_px, facing, partner, position, contrast, sigma)
    residual = levels - levels.mean(axis=1, keepdims=True)
    residual -= contrast[:, None] * filters.step[row, filters.columns(position)]
    mean_square = np.einsum("nk,nk->n", residual, residual) / (levels.shape[1] - 3.0)
    # The last step of an eighth of a pixel is not in the residual's table: taken off to first order.
    mean_square -= (contrast * (position - filters.offsets_px[filters.columns(position)])) ** 2 * (
        filters.shift_gain[row, column] ** 2 / (levels.shape[1] - 3.0)
    )
    noise = float(np.sqrt(max(float(np.median(mean_square)), PIXEL_ROUNDING)))
    own_noise = np.sqrt(np.maximum(mean_square, noise**2))
    return EdgePoints(
        lines,
        lines.coarse + lines.outward * position,
        own_noise / (np.abs(safe) * filters.shift_gain[row, column]),
        contrast,
        blur,
        noise,
        1.0 + lines.slope**2 * _skew(filters.reach_px / sigma),
        _clipped(values, position, sigma, filters.reach_px, top_level),
    )


def _first_position(values: Floats) -> Floats:
    """Where an edge between the window's two end levels would have the same mean level as the window."""
    reach = values.shape[1] // 2
    inside, outside = values[:, :3].mean(axis=1), values[:, -3:].mean(axis=1)
    contrast = outside - inside
    safe = np.where(np.abs(contrast) < 1e-3, 1e-3, contrast)
    share = (outside - values.mean(axis=1)) / safe
    return np.asarray(np.clip(share * values.shape[1] - reach - 0.5, -2.0, 2.0))


def _without_the_other(
    values: Floats,
    lines: ProfileLines,
    reach: int,
    facing: Ints,
    partner: Ints,
    position: Floats,
    contrast: Floats,
    sigma: Floats,
) -> Floats:
    """Grey levels without the other finger, where it reaches into the window: the ground between is a stripe."""
    other = (lines.coarse + lines.outward * position)[partner] - lines.coarse[facing]
    borders = np.arange(-reach - 0.5, reach + 1.0) - (lines.outward[facing] * other)[:, None]
    step, _, _ = blurred_step(borders, sigma[partner][:, None])
    levels = values.copy()
    levels[facing] += contrast[facing][:, None] * step
    return levels


def _clipped(values: Floats, position: Floats, sigma: Floats, reach: int, top_level: float) -> NDArray[np.bool_]:
    """Whether the flank itself, within 0.7 sigma of the edge, touches the end of the scale."""
    ends = (values <= 0) | (values >= top_level)
    if not ends.any():
        return np.zeros(len(values), dtype=bool)
    near = np.abs(np.arange(-reach, reach + 1) - position[:, None]) < 0.7 * sigma[:, None]
    return np.asarray((ends & near).any(axis=1))


def _facing(lines: ProfileLines, reach: int) -> tuple[Ints, Ints]:
    """Lines whose window holds the other finger's inner edge, and the line on which that edge is measured."""
    left = np.flatnonzero(lines.is_inner & (lines.group == 0))
    right = np.flatnonzero(lines.is_inner & (lines.group == 2))  # noqa: PLR2004 - the right finger's flank
    _, in_left, in_right = np.intersect1d(lines.fixed[left], lines.fixed[right], return_indices=True)
    left, right = left[in_left], right[in_right]
    near = lines.coarse[right] - lines.coarse[left] < 2 * reach
    left, right = left[near], right[near]
    return np.concatenate((left, right)), np.concatenate((right, left))


def _skew(reach_sigmas: Floats) -> Floats:
    """What a fit with two free levels makes of an edge whose distance along the line is not quite straight.

    Along a line that meets a curved edge at a slant of slope m, the distance to the edge is t + kappa m^2 t^2 / (2 (1 +
    m^2)^(1/2)). Projected on the fit's own directions over a window of w standard deviations this moves the position by
    m^2 c sigma^2 kappa / 2 across the edge, c = (1 / (4 sqrt pi) - 1 / 2w) / (1 / (2 sqrt pi) - 1 / 2w).
    """
    level = 0.5 / np.maximum(reach_sigmas, 2.5)
    root = 0.5 / np.sqrt(np.pi)
    return np.asarray((0.5 * root - level) / (root - level))
