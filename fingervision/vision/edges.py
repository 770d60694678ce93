"""Step 5, the edges: where the grey level passes from finger to ground, in every row and column of the outline.

Each row across a flank, and each column across a tip, holds one edge: a step between two levels of its own, spread by
a Gaussian and integrated over the pixel. The position is the maximum-likelihood one under white noise, so its variance
is the Cramer-Rao bound. What all rows share is the spread, one for each flank and each tip (motion spreads a
flank more than a tip). Nothing is resampled.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from fingervision.vision.fingers import CoarseFinger
from fingervision.vision.grey import GreyImage

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Half-length of the first look at an edge (pixels): enough for the strongest blur that is still measured.
FIRST_REACH_PX = 20
# Blur of an edge is looked for within these limits (pixels); `blurred` begins at 5.
SMALLEST_BLUR_PX, LARGEST_BLUR_PX = 0.2, 8.0
# A profile reaches this many standard deviations, and so many pixels more, to either side of the edge.
REACH_SIGMAS, REACH_EXTRA_PX = 3.0, 2.5
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
        keep = np.abs(slope) <= 1.0
        n = int(keep.sum())
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
    keep = np.abs(slope) < 1.0
    n = int(keep.sum())
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


def fit_edges(upright: GreyImage, lines: ProfileLines, limits: tuple[int, int, int, int]) -> EdgePoints:
    """Sub-pixel position of the edge on every line.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels, seen with the tips up.
    lines : ProfileLines
        Where to look.
    limits : tuple of int
        First and one past the last column, first and one past the last row that may be used.

    Returns
    -------
    EdgePoints
        One point a line.
    """
    blur = _first_blur(upright, lines, limits)
    reach = int(np.ceil(REACH_SIGMAS * np.hypot(blur.max(), 0.3) + REACH_EXTRA_PX))
    values, weight = _gather(upright, lines, reach, limits)
    return _fit(values, weight, lines, blur, reach, float(np.iinfo(upright.dtype).max))


def _gather(
    upright: GreyImage, lines: ProfileLines, reach: int, limits: tuple[int, int, int, int]
) -> tuple[Floats, Floats]:
    """Grey levels from inside to outside, `reach` pixels to either side of the coarse edge, and which are in view."""
    steps = np.arange(-reach, reach + 1)
    moving = lines.coarse[:, None] + lines.outward[:, None] * steps
    fixed = lines.fixed[:, None]
    column = np.where(lines.is_row[:, None], moving, fixed)
    row = np.where(lines.is_row[:, None], fixed, moving)
    first_column, past_column, first_row, past_row = limits
    weight = (column >= first_column) & (column < past_column) & (row >= first_row) & (row < past_row)
    np.clip(column, first_column, past_column - 1, out=column)
    np.clip(row, first_row, past_row - 1, out=row)
    return upright[row, column].astype(np.float64), weight.astype(np.float64)


def _first_blur(upright: GreyImage, lines: ProfileLines, limits: tuple[int, int, int, int]) -> Floats:
    """Blur of each group from the steepest place of some of its profiles, robustly."""
    blur = np.full(4, 1.0)
    some = np.zeros(len(lines.group), dtype=bool)
    some[::4] = True
    chosen = ProfileLines(*(getattr(lines, name)[some] for name in ProfileLines.__slots__))
    values, _ = _gather(upright, chosen, FIRST_REACH_PX, limits)
    middle = slice(FIRST_REACH_PX - 8, FIRST_REACH_PX + 9)
    steepest = np.abs(values[:, 2:] - values[:, :-2])[:, middle].max(axis=1) / 2.0
    contrast = np.abs(np.median(values[:, -8:], axis=1) - np.median(values[:, :8], axis=1))
    share = np.clip(steepest / np.maximum(contrast, 1.0), 0.02, 0.49)
    for group in range(4):
        mine = chosen.group == group
        if mine.any():
            blur[group] = 1.0 / ndtri(0.5 + float(np.median(share[mine])))
    return np.clip(blur, SMALLEST_BLUR_PX, LARGEST_BLUR_PX)


def _fit(values: Floats, weight: Floats, lines: ProfileLines, blur: Floats, reach: int, top_level: float) -> EdgePoints:
    """Gauss-Newton over every profile's two levels and position, and every group's blur."""
    n = len(values)
    borders = np.arange(-reach - 0.5, reach + 1.0)
    stretch = 1.0 + lines.slope**2
    from_slope = lines.slope**2 / 12.0
    count = np.maximum(weight.sum(axis=1), 1.0)
    position = np.full(n, 0.5)
    blur = blur.copy()
    in_group = lines.group[:, None] == np.arange(4)
    facing, partner = _facing(lines, reach)

    def centred(a: Floats) -> Floats:
        return np.asarray(a - ((weight * a).sum(axis=1) / count)[:, None])

    y0 = centred(values) * weight
    for _iteration in range(ITERATIONS):
        sigma = np.sqrt(np.maximum(blur, SMALLEST_BLUR_PX)[lines.group] ** 2 * stretch + from_slope)
        z = borders - position[:, None]
        q = z / sigma[:, None]
        cumulative = ndtr(q)
        density = np.exp(-0.5 * q * q) * (1.0 / np.sqrt(2.0 * np.pi))
        step = np.diff(z * cumulative + sigma[:, None] * density, axis=1)
        by_position = -np.diff(cumulative, axis=1)
        by_sigma = np.diff(density, axis=1)
        if len(facing):
            # The ground between two near edges is a stripe: what the other edge takes away belongs to the model.
            other = (lines.coarse + lines.outward * position)[partner] - lines.coarse[facing]
            z = borders - (lines.outward[facing] * other)[:, None]
            spread = sigma[partner][:, None]
            q = z / spread
            cumulative = ndtr(q)
            density = np.exp(-0.5 * q * q) * (1.0 / np.sqrt(2.0 * np.pi))
            step[facing] -= np.diff(z * cumulative + spread * density, axis=1)
            by_sigma[facing] -= np.diff(density, axis=1)
        s0, t0, v0 = centred(step) * weight, centred(by_position) * weight, centred(by_sigma) * weight
        ss, st, tt = (s0 * s0).sum(axis=1), (s0 * t0).sum(axis=1), (t0 * t0).sum(axis=1)
        sy, ty = (s0 * y0).sum(axis=1), (t0 * y0).sum(axis=1)
        determinant = np.maximum(ss * tt - st * st, 1e-12)
        contrast = (sy * tt - ty * st) / determinant
        move_contrast = (ty * ss - sy * st) / determinant
        safe_contrast = np.where(np.abs(contrast) < 1e-6, 1e-6, contrast)
        move = np.clip(move_contrast / safe_contrast, -1.5, 1.5)
        residual = y0 - contrast[:, None] * s0 - move_contrast[:, None] * t0
        # The blur's own direction, freed of what levels and position can do.
        sv, tv = (s0 * v0).sum(axis=1), (t0 * v0).sum(axis=1)
        free = (
            v0 - ((sv * tt - tv * st) / determinant)[:, None] * s0 - ((tv * ss - sv * st) / determinant)[:, None] * t0
        )
        gain = sigma / np.maximum(blur[lines.group], SMALLEST_BLUR_PX)  # d sigma / d blur is blur stretch / sigma
        direction = contrast * stretch / gain
        mean_square = (residual * residual).sum(axis=1) / np.maximum(count - 3.0, 1.0)
        typical = np.median(mean_square)
        trust = 1.0 / (1.0 + (mean_square / max(4.0 * typical, 1e-9)) ** 2)
        top = (trust * direction * (free * residual).sum(axis=1)) @ in_group
        bottom = (trust * direction**2 * (free * free).sum(axis=1)) @ in_group
        position = np.clip(position + move, -reach + 2.0, reach - 2.0)
        blur = np.clip(
            blur + np.clip(top / np.maximum(bottom, 1e-12), -0.5 * blur, 0.5 * blur), SMALLEST_BLUR_PX, LARGEST_BLUR_PX
        )
    noise = float(np.sqrt(max(typical, 1.0 / 12.0)))
    own_noise = np.sqrt(np.maximum(mean_square, noise**2))
    u_position = own_noise / np.sqrt(np.maximum(safe_contrast**2 * (tt - st * st / np.maximum(ss, 1e-12)), 1e-12))
    near = (np.abs(borders[:-1] + 0.5 - position[:, None]) < 0.7 * sigma[:, None]) & (weight > 0)
    clipped = (near & ((values <= 0) | (values >= top_level))).any(axis=1)
    return EdgePoints(
        lines,
        lines.coarse + lines.outward * position,
        u_position,
        contrast,
        blur,
        noise,
        1.0 + lines.slope**2 * _skew(reach / sigma),
        clipped,
    )


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


# Gauss-Newton converges quadratically from the first look; the fifth pass changes positions by less than 1e-4 px.
ITERATIONS = 4
