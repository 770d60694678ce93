"""Pairs of the two fingers' edges so close together that one search window contains both."""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.edge_filters import blurred_step
from fingervision.vision.profile_lines import INNER, ProfileLines

Floats = NDArray[np.float64]
# Indices of the left and of the right finger's inner lines in the same rows.
Facing = tuple[NDArray[np.int_], NDArray[np.int_]]

_are_apart = loop("facing_are_apart")


def facing_lines(lines: ProfileLines, reach: int) -> Facing | None:
    """Indices of the inner lines of left and right finger in the same rows, where one window contains both edges."""
    if _are_apart(lines.coarse, lines.weight, 2 * reach):
        return None
    filled = [int(n) for n in lines.weight[:, :INNER].sum(axis=1)]
    _, left, right = np.intersect1d(lines.fixed[0, : filled[0]], lines.fixed[1, : filled[1]], return_indices=True)
    near = lines.coarse[1, right] - lines.coarse[0, left] < 2 * reach
    return (left[near], right[near]) if near.any() else None


def without_the_other(
    values: Floats, lines: ProfileLines, facing: Facing, position: Floats, contrast: Floats, sigma: Floats
) -> Floats:
    """Subtract the other finger's edge from lines whose window contains the edges of both fingers.

    In a window that contains both edges, the background between the fingers appears as a narrow stripe.
    """
    levels, reach = values.copy(), values.shape[-1] // 2
    edge = lines.coarse + lines.outward * position
    borders = np.arange(-reach - 0.5, reach + 1.0)
    for own, other in ((0, 1), (1, 0)):
        mine, theirs = facing[own], facing[other]
        away = lines.outward[own, mine] * (edge[other, theirs] - lines.coarse[own, mine])
        step, _, _ = blurred_step(borders - away[:, None], sigma[other, theirs][:, None])
        levels[own, mine] += contrast[own, mine][:, None] * step
    return levels
