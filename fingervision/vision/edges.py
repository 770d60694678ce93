"""Step 5, the edges: where the grey level passes from finger to ground, in every row and column of the outline.

Each row across a flank, and each column across a tip, holds one edge: a step between two levels of its own, spread by
a Gaussian and integrated over the pixel. The position is the maximum-likelihood one under white noise, so its variance
is the Cramer-Rao bound. What all rows share is the spread, one for the flanks and one for the tip of each finger
(motion spreads a flank more than a tip). Nothing is resampled.
"""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from fingervision.domain.compiled import compiled
from fingervision.vision.edge_filters import (
    LARGEST_BLUR_PX,
    PIXEL_VARIANCE,
    SMALLEST_BLUR_PX,
    EdgeFilters,
    Lines,
    edge_filters,
    reach_for,
)
from fingervision.vision.edge_profile import NO_MARK, EdgeMark, edge_mark
from fingervision.vision.facing import facing_lines, without_the_other
from fingervision.vision.grey import GreyImage
from fingervision.vision.median import middle
from fingervision.vision.noise_correlation import flat_noise
from fingervision.vision.profile_lines import INNER, IS_ROW, PLACES, ProfileLines

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]
Number = TypeVar("Number", np.float64, np.bool_)

# Half-length of the first look at an edge (pixels), enough for the strongest blur that is still measured; at one line
# in so many.
FIRST_REACH_PX, FIRST_LOOK, NEAR_MIDDLE_PX = 20, 6, 8
# The window follows an edge so far (pixels), where its ends differ by so many grey levels at all.
FIRST_MOVE_PX, LEAST_LEVELS = 2.0, 1e-3
# The passes of Gauss-Newton, and whether each also refines the blur. It converges quadratically from the first look.
BLUR_PASSES = (True, True, False)
# Lines of each finger's flanks and of its tip share their blur: the number of that blur, for every line.
BLUR_OF_LINE = np.concatenate((np.where(IS_ROW, 0, 1), np.where(IS_ROW, 2, 3)))
# Variance of rounding to whole grey levels: no noise is smaller.
ROUNDING = 1.0 / 12.0


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
    reach_px : int
        Half-length of the window along each line.
    marks : (EdgeMark, EdgeMark)
        What each inner flank shows that a blurred step does not; nothing where the window holds both edges.
    inside : (float, float)
        Level of each finger beside its inner flank.
    shared_lines : float
        Neighbouring lines that share their noise.
    noise_flat : float
        Standard deviation of the light in the flat parts beside the edges; 0 where none is in view.
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
    shared_lines: float = 1.0
    noise_flat: float = 0.0


def fit_edges(upright: GreyImage, lines: ProfileLines, light: Floats, top_level: int) -> EdgePoints:
    """Sub-pixel position of the edge on every line of two fingers.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels, seen with the tips up.
    lines : ProfileLines
        Where to look.
    light : ndarray of float, shape (levels,)
        Light of every grey level, on the levels' own scale.
    top_level : int
        End of the scale.

    Returns
    -------
    EdgePoints
        One point a line.
    """
    blur = _first_blur(upright, lines, light)
    filters = edge_filters(reach_for(blur))
    position = _first_position(_levels(upright, lines, light, filters.reach_px))
    # Where the coarse outline lies a pixel off, the window follows the edge: what finds must not sway what measures.
    coarse = lines.coarse + lines.outward * np.floor(position).astype(np.intp)
    lines = ProfileLines(lines.fixed, coarse, lines.slope, lines.weight, lines.outward)
    levels = _levels(upright, lines, light, filters.reach_px)
    return _fit(upright, light, levels, lines, blur, filters, float(top_level))


def _levels(upright: GreyImage, lines: ProfileLines, light: Floats, reach: int) -> Floats:
    return _gather(upright, light, IS_ROW, lines.fixed, lines.coarse, lines.outward, reach)


@compiled
def _gather(
    upright: GreyImage,
    light: Floats,
    is_row: NDArray[np.bool_],
    fixed: Ints,
    coarse: Ints,
    outward: Ints,
    reach: int,
) -> Floats:
    """Light from inside to outside, `reach` pixels to either side of the coarse edge, shape (2, n, pixels).

    Beyond the picture's border the last pixel is repeated: what is cut off there is a finger's inside or the ground.
    """
    rows, columns = upright.shape
    values = np.empty((fixed.shape[0], fixed.shape[1], 2 * reach + 1))
    for k in range(fixed.shape[0]):
        for i in range(fixed.shape[1]):
            for j in range(2 * reach + 1):
                at = coarse[k, i] + outward[k, i] * (j - reach)
                if is_row[i]:
                    values[k, i, j] = light[upright[fixed[k, i], min(max(at, 0), columns - 1)]]
                else:
                    values[k, i, j] = light[upright[min(max(at, 0), rows - 1), fixed[k, i]]]
    return values


def _first_blur(upright: GreyImage, lines: ProfileLines, light: Floats) -> float:
    """Blur of the edges from the steepest place of some of the flanks' rows, robustly."""
    some = slice(0, INNER, FIRST_LOOK)
    levels = _gather(
        upright,
        light,
        IS_ROW[some],
        lines.fixed[:, some],
        lines.coarse[:, some],
        lines.outward[:, some],
        FIRST_REACH_PX,
    )
    shares = _steepest_shares(levels)[lines.weight[:, some] > 0]
    if not len(shares):
        return 1.0
    sigma = 1.0 / ndtri(0.5 + min(max(middle(shares), 0.02), 0.49))
    return float(min(max(sigma, SMALLEST_BLUR_PX), LARGEST_BLUR_PX))


@compiled
def _steepest_shares(levels: Floats) -> Floats:
    """Largest step from pixel to pixel near the middle, as a share of what lies between the ends; shape (2, n)."""
    fingers, lines, pixels = levels.shape
    shares = np.empty((fingers, lines))
    for k in range(fingers):
        for i in range(lines):
            line = levels[k, i]
            steepest, middle = 0.0, pixels // 2
            for j in range(middle - NEAR_MIDDLE_PX, middle + NEAR_MIDDLE_PX + 1):
                steepest = max(steepest, 0.5 * abs(line[j + 1] - line[j - 1]))
            contrast = abs(line[-6:].sum() - line[:6].sum()) / 6.0
            shares[k, i] = steepest / max(contrast, 1.0)
    return shares


@compiled
def _first_position(levels: Floats) -> Floats:
    """Where an edge between the window's two end levels would have the same mean level as the window."""
    fingers, lines, pixels = levels.shape
    position = np.empty((fingers, lines))
    for k in range(fingers):
        for i in range(lines):
            line = levels[k, i]
            outside = line[-3:].sum() / 3.0
            contrast = outside - line[:3].sum() / 3.0
            if abs(contrast) < LEAST_LEVELS:
                contrast = LEAST_LEVELS
            share = (outside - line.sum() / pixels) / contrast
            position[k, i] = min(max((share - 0.5) * pixels, -FIRST_MOVE_PX), FIRST_MOVE_PX)
    return position


def _fit(
    upright: GreyImage,
    light: Floats,
    levels: Floats,
    lines: ProfileLines,
    blur_px: float,
    filters: EdgeFilters,
    top_level: float,
) -> EdgePoints:
    """Gauss-Newton over every line's two levels and position, and the blur of flanks and tips."""
    pixels, real = levels.shape[-1], lines.weight.ravel() > 0
    shared = Lines(lines.slope.ravel(), lines.weight.ravel(), BLUR_OF_LINE)
    facing = facing_lines(lines, filters.reach_px)
    blur, position, seen = np.full(4, blur_px), _first_position(levels).ravel(), levels
    for is_blur_free in BLUR_PASSES:
        look = filters.look(seen.reshape(-1, pixels), shared, blur, position)
        position, blur = look.position, look.blur if is_blur_free else blur
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
            for k, filled in enumerate(np.count_nonzero(lines.weight[:, :INNER], axis=1).tolist())
        )
        marks = (left, right)
    u_position = np.sqrt(np.maximum(mean_square, noise_variance)) / (np.abs(look.contrast) * gain)
    return EdgePoints(
        lines,
        lines.coarse + lines.outward * _shaped(position),
        _shaped(u_position),
        _shaped(look.contrast),
        blur.reshape(2, 2),
        noise,
        curvature_gain(lines.slope, filters.reach_px / _shaped(look.sigma)),
        _shaped(_clipped(levels.reshape(-1, pixels), position, look.sigma, top_level)),
        filters.reach_px,
        marks,
        (_inside(levels[0], lines.weight[0]), _inside(levels[1], lines.weight[1])),
        *flat_noise(upright, light, lines, filters, *filters.middle(blur[0])),
    )


@compiled
def _inside(levels: Floats, weight: Floats) -> float:
    """Usual level at the inner end of an inner flank's lines; 0 where there is none."""
    return middle(levels[:INNER, 0].copy()[weight[:INNER] > 0])


def _shaped(a: NDArray[Number]) -> NDArray[Number]:
    return a.reshape(2, PLACES)


@compiled
def _clipped(levels: Floats, position: Floats, sigma: Floats, top_level: float) -> NDArray[np.bool_]:
    """Whether the flank itself, within 0.7 sigma and a pixel's breadth of the edge, touches the end of the scale.

    Where the ground is far beyond the scale, what is left of a flank looks steep: sigma alone would look too near.
    """
    lines, pixels = levels.shape
    is_clipped = np.zeros(lines, dtype=np.bool_)
    for i in range(lines):
        near = max(0.7 * sigma[i], 0.8)
        for j in range(pixels):
            if abs(j - pixels // 2 - position[i]) < near and (levels[i, j] <= 0 or levels[i, j] >= top_level):
                is_clipped[i] = True
    return is_clipped


def curvature_gain(slope: Floats, reach_sigmas: Floats) -> Floats:
    """What a fit with two free levels makes of an edge whose distance along the line is not quite straight.

    Along a line that meets a curved edge at a slant of slope m, the distance to the edge is t + kappa m^2 t^2 / (2 (1 +
    m^2)^(1/2)). Projected on the fit's own directions over a window of w standard deviations this moves the position by
    m^2 c sigma^2 kappa / 2 across the edge, c = (1 / (4 sqrt pi) - 1 / 2w) / (1 / (2 sqrt pi) - 1 / 2w); the half-level
    itself is moved by sigma^2 kappa / 2.
    """
    level = 0.5 / np.maximum(reach_sigmas, 2.5)
    root = 0.5 / np.sqrt(np.pi)
    return np.asarray(1.0 + slope**2 * (0.5 * root - level) / (root - level))


def outline_blur(edges: EdgePoints) -> Floats:
    """Blur (sigma_e, the pixel included) that the curvature of the outline is felt through, shape (2, PLACES).

    Blur along the edge moves a curved edge's half-level, blur across it does not. Motion makes the two differ: what is
    seen on the flanks is the blur across the fingers, what is seen on the tips that along them.
    """
    across, along = edges.blur_px[:, :1] ** 2, edges.blur_px[:, 1:] ** 2
    steep = edges.lines.slope**2
    own = np.where(IS_ROW, across * steep + along, across + along * steep) / (1.0 + steep)
    return np.asarray(np.sqrt((own + PIXEL_VARIANCE) * edges.curvature_gain))
