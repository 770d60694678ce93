"""Move edges to the finger's own edge by what the recording shows beside it, or increase their uncertainty.

Light that is the same all around a finger (a shadow, a bright line) is taken off every line of pixels, and the step is
fitted again. Along a slanted line it is stretched by the same factor as the edge. No line's edge is then displaced by
it, however much of it was in the line's window.
"""

from collections.abc import Callable
from dataclasses import replace
from math import hypot

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.camera import AddedLight, BesideEdges
from fingervision.vision.edge_filters import Lines, curvature_gain, edge_filters, reach_for
from fingervision.vision.edge_profile import EdgeMark
from fingervision.vision.edges import BLUR_OF_LINE, ROUNDING, EdgePoints
from fingervision.vision.grey import GreyImage
from fingervision.vision.line_levels import line_levels
from fingervision.vision.median import middle
from fingervision.vision.profile_lines import IS_INNER, IS_ROW, ProfileLines

Floats = NDArray[np.float64]


def moved_by_wall(edges: EdgePoints) -> Floats:
    """Displacement along every line of pixels if a side wall displaces the inner edge horizontally by one pixel."""
    towards_gap = edges.lines.outward[:, :1] * edges.lines.slope
    return np.where(IS_INNER, 1.0, np.where(IS_ROW, 0.0, np.maximum(towards_gap, 0.0)))


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
    own_px = 0.5 * (beside.u_outline_px if is_outline else beside.u_gap_px)
    # What the frame itself shows is explained as far as something is beside the edges.
    u_px = [float(np.hypot(own_px, (1.0 - beside.probability) * mark.shift_px)) for mark in edges.marks]
    name = beside.name if beside.probability > 0.5 else edges.beside
    moved = replace(edges, position=position, marks=stated_marks(edges, u_px), beside=name)
    return moved if beside.added is None else _without_added(upright, moved, light, beside.added)


def u_aslant_px(beside: BesideEdges, slopes: tuple[float, float]) -> float:
    """Standard uncertainty of the gap (px), because a shadow or an obliquely seen wall may also lie along the fingers.

    Both are a copy of the outline displaced in one direction, which is the same at both fingers. The straight flanks
    show how far it lies across the fingers; along them it is taken to be as far. Where the measured edge is slanted,
    the copy's distance from it differs by the slope times this.

    Parameters
    ----------
    beside : BesideEdges
        What the recording shows beside the edges.
    slopes : (float, float)
        Slope of both edges at the measuring height.
    """
    left, right = beside.inner_px
    if beside.added is not None or not (left or right):
        return 0.0
    one_way = abs(left - right) / (abs(left) + abs(right))
    return one_way * hypot(left * slopes[0], right * slopes[1])


# Largest number of rounds in which edge and disturbance are fitted alternately.
LOOKS = 5
# Least blur found in a round, as a share of the blur of the profile.
LEAST_BLUR_SHARE = 0.5

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
