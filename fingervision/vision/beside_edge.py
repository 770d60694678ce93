"""Fit the edges again after the shadow or glare beside them has been subtracted from each line of pixels.

The mean profile across the flanks gives the breadth, strength and blur of the shadow or glare; breadth, strength and
blur are assumed to be the same all around a finger. Along a slanted line of pixels, shadow or glare is stretched by the
same factor as the edge. After the subtraction and a new fit of the step, no line's edge is displaced by the shadow or
glare, however much of it was in the line's window.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.edge_filters import PIXEL_VARIANCE, Lines, edge_filters, reach_for
from fingervision.vision.edges import BLUR_OF_LINE, ROUNDING, EdgePoints
from fingervision.vision.grey import GreyImage
from fingervision.vision.line_levels import line_levels
from fingervision.vision.median import middle
from fingervision.vision.outline_blur import curvature_gain
from fingervision.vision.profile_lines import ProfileLines
from fingervision.vision.profile_models import GLARE, ProfileFit

Floats = NDArray[np.float64]

# Largest number of rounds in which edge and disturbance are fitted alternately.
LOOKS = 5
# Least blur found in a round, as a share of the blur of the profile.
LEAST_BLUR_SHARE = 0.5

_take_off = loop("beside_edge_without")


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
    filters = edge_filters(reach_for(float(blur.max())))
    lines = edges.lines
    coarse = np.rint(edges.position).astype(np.intp)
    position = lines.outward * (edges.position - coarse)
    lines = ProfileLines(lines.fixed, coarse, lines.slope, lines.weight, lines.outward)
    levels = line_levels(upright, lines, light, filters.reach_px)
    shape, pixels = coarse.shape, levels.shape[-1]
    contrast = np.repeat([[_contrast(edges, k)] for k in range(2)], shape[1], axis=1)
    shared = Lines(lines.slope.ravel(), lines.weight.ravel(), BLUR_OF_LINE)
    sizes = np.array([fit.share * (fit.blur * np.sqrt(2.0 * np.pi) if kind == GLARE else 1.0) for fit in fits])
    breadths, blurs = np.array([fit.breadth for fit in fits]), np.array([fit.blur for fit in fits])
    found = np.repeat(blur, 2)
    for number in range(LOOKS):
        seen = levels.copy()
        _take_off(lines.slope, position, contrast, kind, sizes, breadths, blurs, seen)
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
