"""Step 5, the edges: sub-pixel position of the transition from finger to background in every row and column.

Each row across a flank, and each column across a tip, contains one edge: a step between two levels, blurred by a
Gaussian and integrated over the pixel. The position is the maximum-likelihood estimate under white noise, whose
variance is the Cramer-Rao bound. Each finger has one blur for the rows across its flanks and another for the columns
across its tip, because motion blurs a flank more than a tip. The picture is not resampled.
"""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.edge_filters import (
    PIXEL_VARIANCE,
    SMALLEST_BLUR_PX,
    EdgeFilters,
    Lines,
    curvature_gain,
    edge_filters,
    reach_for,
)
from fingervision.vision.edge_profile import NO_MARK, EdgeMark, edge_mark
from fingervision.vision.facing import facing_lines, without_the_other
from fingervision.vision.grey import GreyImage
from fingervision.vision.line_levels import first_blur, first_position, line_levels
from fingervision.vision.median import middle
from fingervision.vision.noise_correlation import flat_noise
from fingervision.vision.profile_lines import INNER, IS_ROW, PLACES, ProfileLines

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]
Number = TypeVar("Number", np.float64, np.bool_)

# Number of Gauss-Newton passes that also refine the blur, which converge quadratically; number of further passes if the
# last one changed a blur by more than this (pixels). A blur may change slowly because its step is limited, for instance
# that of sharp tips beside flanks that are blurred by motion. A final pass leaves the blur unchanged.
BLUR_PASSES, MORE_PASSES, SETTLED_PX = 2, 8, 0.2
# Blurs across and along the fingers are separated if the squared blurs of the lines differ by this share, more than
# noise explains, and if the lines' average share of the other axis is below this limit.
UNLIKE, MOST_OF_OTHER = 0.15, 0.7
# Index of the blur of every line: the lines of a finger's flanks have one blur, those of its tip another.
BLUR_OF_LINE = np.concatenate((np.where(IS_ROW, 0, 1), np.where(IS_ROW, 2, 3)))
# Number of pixels at the outer end of a line over which the ground's level is averaged.
GROUND_PX = 2
# Variance of rounding to whole grey levels, the least noise.
ROUNDING = 1.0 / 12.0

_inside = loop("edges_inside")
_clipped = loop("edges_clipped")


@dataclass(frozen=True, slots=True, eq=False)
class EdgePoints:
    """Sub-pixel points of two fingers' half-level outlines; arrays of shape (2, PLACES) unless stated otherwise.

    Parameters
    ----------
    lines : ProfileLines
        Lines of pixels along which the edges were fitted.
    position : ndarray of float
        Coordinate along each line, in the picture's pixels.
    u_position : ndarray of float
        Standard uncertainty of each position, from the noise of its own line.
    contrast : ndarray of float
        Outside level minus inside level.
    blur_px : ndarray of float, shape (2, 2)
        Gaussian sigma, without the pixel's width, of each finger's edges across the fingers (from the flanks) and along
        them (from the tip); the two differ if a finger moved during the exposure.
    noise : float
        Standard deviation of the grey levels about the fitted model.
    curvature_gain : ndarray of float
        Ratio of the fitted position's sensitivity to the outline's curvature to that of the half-level.
    is_clipped : ndarray of bool
        Whether the flank itself, not only the plateau, reaches the end of the scale.
    reach_px : int
        Half-length of the window along each line.
    marks : (EdgeMark, EdgeMark)
        Deviation of each inner flank from a blurred step; zero if the window contains both fingers' edges.
    inside : (float, float)
        Level of each finger next to its inner flank.
    ground : ndarray of float
        Level at the outer end of every line.
    shared_lines : float
        Number of neighbouring lines that share their noise.
    shared_on_both : float
        The smaller number of the fingers and the ground.
    noise_flat : float
        Standard deviation of the light in the flat parts beside the edges; 0 if no flat part is in view.
    beside : str
        Disturbance found beside the edges: wall, shadow, glare, motion, trail, sharpening, or a strip of a third tone
        (which is not measured); empty if none was found.
    """

    lines: ProfileLines
    position: Floats
    u_position: Floats
    contrast: Floats
    blur_px: Floats
    noise: float
    curvature_gain: Floats
    is_clipped: NDArray[np.bool_]
    reach_px: int
    marks: tuple[EdgeMark, EdgeMark]
    inside: tuple[float, float]
    ground: Floats
    shared_lines: float = 1.0
    shared_on_both: float = 1.0
    noise_flat: float = 0.0
    beside: str = ""

    @property
    def unexplained(self) -> float:
        """Squared residuals of the fitted steps over the noise of the picture's flat parts."""
        return (self.noise / self.noise_flat) ** 2 if self.noise_flat > 0.0 else 1.0

    @property
    def widened(self) -> float:
        """Squared blur of the flanks over that of the tips, pixel width included."""
        flank, tip = np.mean(self.blur_px**2, axis=0) + PIXEL_VARIANCE
        return float(flank / tip)


def fit_edges(upright: GreyImage, lines: ProfileLines, light: Floats, top_level: int) -> EdgePoints:
    """Sub-pixel position of the edge on every line of two fingers.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels of the picture, turned so that the tips point up.
    lines : ProfileLines
        Lines of pixels on which to fit an edge.
    light : ndarray of float, shape (levels,)
        Light for every grey level (look-up table), on the same scale as the levels.
    top_level : int
        Highest level of the scale, at whose light the picture is clipped.

    Returns
    -------
    EdgePoints
        One point per line.
    """
    blur = first_blur(upright, lines, light)
    filters = edge_filters(reach_for(blur))
    position = first_position(line_levels(upright, lines, light, filters.reach_px))
    # If the coarse outline is off by a pixel, the window is moved to the edge, so that the coarse outline does not
    # affect the result.
    coarse = lines.coarse + lines.outward * np.floor(position).astype(np.intp)
    lines = ProfileLines(lines.fixed, coarse, lines.slope, lines.weight, lines.outward)
    levels = line_levels(upright, lines, light, filters.reach_px)
    return _fit(upright, light, levels, lines, blur, filters, float(light[top_level]))


def _fit(
    upright: GreyImage,
    light: Floats,
    levels: Floats,
    lines: ProfileLines,
    blur_px: float,
    filters: EdgeFilters,
    top_level: float,
) -> EdgePoints:
    """Gauss-Newton fit of the two levels and the position of every line, and of the blurs of flanks and tips."""
    pixels, real = levels.shape[-1], lines.weight.ravel() > 0
    shared = Lines(lines.slope.ravel(), lines.weight.ravel(), BLUR_OF_LINE)
    facing = facing_lines(lines, filters.reach_px)
    blur, position, seen = np.full(4, blur_px), first_position(levels).ravel(), levels
    passes, is_settled, is_last = 0, False, False
    while not is_last:
        is_last, passes = is_settled, passes + 1
        look = filters.look(seen.reshape(-1, pixels), shared, blur, position)
        position = look.position
        if not is_last:
            moved_px = max(abs(new - old) for new, old in zip(look.blur.tolist(), blur.tolist(), strict=True))
            is_settled = passes >= BLUR_PASSES and (moved_px < SETTLED_PX or passes >= BLUR_PASSES + MORE_PASSES)
            blur = look.blur
        if facing is not None:
            where, contrast, sigma = (_shaped(a) for a in (position, look.contrast, look.sigma))
            seen = without_the_other(levels, lines, facing, where, contrast, sigma)
    mean_square, gain = filters.mean_square(seen.reshape(-1, pixels), look)
    noise_variance = max(middle(mean_square[real]), ROUNDING)
    noise = float(np.sqrt(noise_variance))
    marks = (NO_MARK, NO_MARK)
    if facing is None:
        left, right = (
            edge_mark(
                levels[k, :filled],
                position[k * PLACES : k * PLACES + filled],
                look.sigma[k * PLACES : k * PLACES + filled],
                look.contrast[k * PLACES : k * PLACES + filled],
                mean_square[k * PLACES : k * PLACES + filled],
                noise,
                top_level,
            )
            for k, filled in enumerate([int(np.count_nonzero(weight[:INNER])) for weight in lines.weight])
        )
        marks = (left, right)
    is_clipped = np.empty(len(position), dtype=np.bool_)
    _clipped(levels.reshape(-1, pixels), position, look.sigma, top_level, is_clipped)
    u_position = np.sqrt(np.maximum(mean_square, noise_variance)) / (np.abs(look.contrast) * gain)
    return EdgePoints(
        lines,
        lines.coarse + lines.outward * _shaped(position),
        _shaped(u_position),
        _shaped(look.contrast),
        _along_axes(blur.reshape(2, 2), lines),
        noise,
        curvature_gain(lines.slope, filters.reach_px / _shaped(look.sigma)),
        _shaped(is_clipped),
        filters.reach_px,
        marks,
        (_inside(levels[0], lines.weight[0]), _inside(levels[1], lines.weight[1])),
        levels[..., -GROUND_PX:].mean(axis=-1),
        *flat_noise(upright, light, lines, filters, *filters.middle(blur[0])),
    )


def _along_axes(blur: Floats, lines: ProfileLines) -> Floats:
    """Blur across the fingers and along them, from the fitted blurs of the flanks' rows and the tips' columns.

    The squared blur on a line that crosses an edge of slope m contains a share m^2 / (1 + m^2) of the other axis'
    squared blur. Without a correction for this share, sideways motion during the exposure would make a round tip appear
    blurred along the fingers.
    """
    out = blur.copy()
    squared = blur**2
    for k, pair in enumerate(squared.tolist()):
        if max(pair) - min(pair) < UNLIKE * max(pair):
            continue
        seen = squared[k]
        of_other = lines.weight[k] * lines.slope[k] ** 2 / (1.0 + lines.slope[k] ** 2)
        total, other = (np.bincount(BLUR_OF_LINE[:PLACES], a, minlength=2) for a in (lines.weight[k], of_other))
        share = other / np.maximum(total, 1e-9)
        if share.sum() > MOST_OF_OTHER:
            continue
        mixed = np.array([[1.0 - share[0], share[0]], [share[1], 1.0 - share[1]]])
        apart = np.linalg.solve(mixed, seen)
        out[k] = np.sqrt(np.maximum(apart, SMALLEST_BLUR_PX**2))
    return out


def _shaped(a: NDArray[Number]) -> NDArray[Number]:
    return a.reshape(2, PLACES)
