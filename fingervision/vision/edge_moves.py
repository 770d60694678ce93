"""Move edges to the finger's own edge according to a model of the profile, or increase their uncertainty.

Fit the edges again after the shadow or glare beside them has been subtracted from each line of pixels.

The mean profile across the flanks gives the breadth, strength and blur of the shadow or glare; breadth, strength and
blur are assumed to be the same all around a finger. Along a slanted line of pixels, shadow or glare is stretched by the
same factor as the edge. After the subtraction and a new fit of the step, no line's edge is displaced by the shadow or
glare, however much of it was in the line's window.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.camera import AddedLight, BesideEdges
from fingervision.domain.loops import loop
from fingervision.vision.edge_filters import PIXEL_VARIANCE, Lines, curvature_gain, edge_filters, reach_for
from fingervision.vision.edge_profile import EdgeMark
from fingervision.vision.edges import BLUR_OF_LINE, ROUNDING, EdgePoints
from fingervision.vision.grey import GreyImage
from fingervision.vision.line_levels import line_levels
from fingervision.vision.median import middle
from fingervision.vision.profile_lines import IS_INNER, IS_ROW, ProfileLines
from fingervision.vision.profile_models import GLARE, ProfileFit

Floats = NDArray[np.float64]

# Limits of the share of the contrast due to a structure beside an edge: a smaller share is texture, a larger share
# means that the edge is not that of a finger.
SHARES = (0.05, 0.85)


def are_of_size(fits: list[ProfileFit], sign: float) -> bool:
    """Whether the fitted structure beside a dark finger's edge has a plausible sign and size."""
    return all(SHARES[0] < sign * fit.share < SHARES[1] for fit in fits)


def moved_by_wall(edges: EdgePoints) -> Floats:
    """Displacement along every line of pixels if a side wall displaces the inner edge horizontally by one pixel."""
    towards_gap = edges.lines.outward[:, :1] * edges.lines.slope
    return np.where(IS_INNER, 1.0, np.where(IS_ROW, 0.0, np.maximum(towards_gap, 0.0)))


def beyond_wall(fit: ProfileFit) -> ProfileFit:
    """Move the position of a fitted wall from its near to its far edge."""
    return fit._replace(position=fit.position + fit.breadth)


def moved_edges(
    edges: EdgePoints, fits: list[ProfileFit], u_relative: float, by_pixel: Floats, beside: str
) -> EdgePoints:
    """Move the edges to the positions given by a model, and state the remaining uncertainty."""
    moves = np.array([fit.position for fit in fits])[:, None] * by_pixel
    u_px = [float(np.hypot(fit.u_position, u_relative * fit.position)) for fit in fits]
    position = edges.position + edges.lines.outward * moves
    return replace(edges, position=position, marks=stated_marks(edges, u_px), beside=beside)


def with_blur(edges: EdgePoints, widths: list[float]) -> EdgePoints:
    """Set the blur of the inner flanks to a given value, because a wall beside an edge is not blur."""
    blur_px = edges.blur_px.copy()
    blur_px[:, 0] = [np.sqrt(max(width**2 - PIXEL_VARIANCE, 0.0)) for width in widths]
    blur_px[:, 1] = np.minimum(blur_px[:, 0], blur_px[:, 1])
    return replace(edges, blur_px=blur_px)


def unsure_edges(edges: EdgePoints, limit_px: list[float], beside: str) -> EdgePoints:
    """Leave the edges in place, with an uncertainty for the possible displacement, because its cause is undecided."""
    u_px = [max(abs(m.shift_px), limit / np.sqrt(3.0)) for m, limit in zip(edges.marks, limit_px, strict=True)]
    return replace(edges, marks=stated_marks(edges, u_px), beside=beside)


def stated_marks(edges: EdgePoints, u_px: list[float]) -> tuple[EdgeMark, EdgeMark]:
    """Edge marks with the given uncertainties, one for each finger."""
    left, right = (EdgeMark(u, mark.beyond) for u, mark in zip(u_px, edges.marks, strict=True))
    return left, right


# No displacement: edges stay where steps were fitted.
STEPS_ALONE = BesideEdges("", 1.0, (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), 0.0, 0.0)


def moved_by_recording(
    upright: GreyImage, edges: EdgePoints, light: Floats, beside: BesideEdges, is_outline: bool
) -> EdgePoints:
    """Move the edges along their normal by what the whole recording shows beside them.

    Where its light is the same along the whole outline, it is taken off every line, and the step is fitted again.
    """
    inner = np.array(beside.outline_px if is_outline else beside.inner_px)[:, None]
    outer, tip = np.array(beside.outer_px)[:, None], np.array(beside.tip_px)[:, None]
    # What all sides have in common acts along the normal; a wall on the gap's side alone lies across the fingers.
    across = np.where(IS_ROW & ~IS_INNER, outer - tip, (inner - tip) * moved_by_wall(edges))
    moves = tip * np.hypot(1.0, edges.lines.slope) + across
    position = edges.position + edges.lines.outward * moves
    u_px = 0.5 * (beside.u_outline_px if is_outline else beside.u_gap_px)
    moved = replace(edges, position=position, marks=stated_marks(edges, [u_px, u_px]), beside=beside.name)
    return moved if beside.added is None else _without_added(upright, moved, light, beside.added)


# Largest number of rounds in which edge and disturbance are fitted alternately.
LOOKS = 5
# Least blur found in a round, as a share of the blur of the profile.
LEAST_BLUR_SHARE = 0.5

_take_off = loop("edge_moves_without")


def without_additions(
    upright: GreyImage, edges: EdgePoints, light: Floats, kind: int, fits: list[ProfileFit]
) -> EdgePoints:
    """Return the edges of both fingers, fitted without the shadow or glare that each mean profile shows.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels of the picture, turned so that the tips point up.
    edges : EdgePoints
        Edges at the positions given by the mean profiles.
    light : ndarray of float, shape (levels,)
        Light for every grey level (look-up table).
    kind : int
        Kind of disturbance: SHADOW, FADING or GLARE.
    fits : list of ProfileFit
        Fits to the mean profiles of the left and of the right finger.
    """
    blur = np.array([np.sqrt(max(fit.blur**2 - PIXEL_VARIANCE, 0.04)) for fit in fits])
    sizes = np.array([fit.share * (fit.blur * np.sqrt(2.0 * np.pi) if kind == GLARE else 1.0) for fit in fits])
    breadths, blurs = np.array([fit.breadth for fit in fits]), np.array([fit.blur for fit in fits])

    def take_off(levels: Floats, slope: Floats, position: Floats, contrast: Floats) -> None:
        _take_off(slope, position, contrast, kind, sizes, breadths, blurs, levels)

    return _fitted_again(upright, edges, light, blur, take_off)


# The part of the outline that a line crosses, as in `AddedLight`: inner flank, outer flank, tip.
_PART = np.where(IS_INNER, 0, np.where(IS_ROW, 1, 2))


def _without_added(upright: GreyImage, edges: EdgePoints, light: Floats, added: AddedLight) -> EdgePoints:
    """Return the edges of both fingers, fitted without the light that the whole recording shows beside them."""

    def take_off(levels: Floats, slope: Floats, position: Floats, contrast: Floats) -> None:
        pixels = levels.shape[-1]
        away = (np.arange(pixels) - pixels // 2 - position[..., None]) / np.hypot(1.0, slope)[..., None]
        for finger in range(2):
            for part in range(3):
                mine = part == _PART
                share = np.interp(away[finger, mine], added.away_px, added.share[finger, part])
                levels[finger, mine] -= contrast[finger, mine, None] * share

    return _fitted_again(upright, edges, light, np.full(2, max(added.blur_px, 0.2)), take_off)


def _fitted_again(
    upright: GreyImage,
    edges: EdgePoints,
    light: Floats,
    blur: Floats,
    take_off: Callable[[Floats, Floats, Floats, Floats], None],
) -> EdgePoints:
    """Fit the steps of all lines and what is taken off beside them alternately."""
    filters = edge_filters(reach_for(float(blur.max())))
    lines = edges.lines
    coarse = np.rint(edges.position).astype(np.intp)
    position = lines.outward * (edges.position - coarse)
    lines = ProfileLines(lines.fixed, coarse, lines.slope, lines.weight, lines.outward)
    levels = line_levels(upright, lines, light, filters.reach_px)
    shape, pixels = coarse.shape, levels.shape[-1]
    contrast = np.repeat([[_contrast(edges, k)] for k in range(2)], shape[1], axis=1)
    shared = Lines(lines.slope.ravel(), lines.weight.ravel(), BLUR_OF_LINE)
    found = np.repeat(blur, 2)
    for number in range(LOOKS):
        seen = levels.copy()
        take_off(seen, lines.slope, position, contrast)
        look = filters.look(seen.reshape(-1, pixels), shared, found, position.ravel())
        position, contrast = look.position.reshape(shape), look.contrast.reshape(shape)
        if number < LOOKS - 1:
            found = np.maximum(look.blur, LEAST_BLUR_SHARE * np.repeat(blur, 2))
    mean_square, gain = filters.mean_square(seen.reshape(-1, pixels), look)
    variance = max(middle(mean_square[lines.weight.ravel() > 0]), ROUNDING)
    u_position = np.sqrt(np.maximum(mean_square, variance)) / (np.abs(look.contrast) * gain)
    return replace(
        edges,
        lines=lines,
        position=lines.coarse + lines.outward * position,
        u_position=u_position.reshape(shape),
        contrast=contrast,
        blur_px=found.reshape(2, 2),
        noise=float(np.sqrt(variance)),
        curvature_gain=curvature_gain(lines.slope, filters.reach_px / look.sigma.reshape(shape)),
        reach_px=filters.reach_px,
    )


def _contrast(edges: EdgePoints, k: int) -> float:
    return middle(edges.contrast[k][edges.lines.weight[k] > 0])
