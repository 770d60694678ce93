"""Outlines of a plate deformed in a finite-element model: quadratic edges joined to closed loops in the picture."""

import numpy as np
from numpy.typing import NDArray

from fingervision.rendering.outline import Outline
from fingervision.rendering.polygon import polygon

SAGITTA_PX = 2e-4
"""Largest distance of a chord from the curve that it replaces: a fifth of the accuracy of a rendered outline."""
MOST_CHORDS = 16


def deformed_outlines(edges: NDArray[np.int64], nodes_px: NDArray[np.float64]) -> tuple[Outline, ...]:
    """Join the edges of the outline into loops; each edge, a parabola through three nodes, is replaced by chords.

    Parameters
    ----------
    edges : ndarray of int, shape (3, k)
        First node, last node and the node between them, for every edge of the outline, in any order; the body is on the
        same side of all edges.
    nodes_px : ndarray of float, shape (2, n)
        Positions of the nodes in the picture.

    Returns
    -------
    tuple of Outline
        Closed outlines; a loop whose direction is opposite to that of the largest loop becomes a hole.
    """
    following = {int(edge[0]): place for place, edge in enumerate(edges.T)}
    left = set(range(edges.shape[1]))
    loops = []
    while left:
        place = min(left)
        corners: list[tuple[float, float]] = []
        while place in left:
            left.discard(place)
            corners += _chords(*(nodes_px[:, node] for node in edges[:, place]))
            place = following[int(edges[1, place])]
        loops.append(tuple(corners))
    areas = [_area_px2(loop) for loop in loops]
    solid = np.sign(max(areas, key=abs, default=1.0))
    outlines = (polygon(loop) for loop in loops)
    # `polygon` always returns a solid; a loop whose direction is opposite to that of the largest loop is a hole.
    return tuple(
        outline if np.sign(area) == solid else outline.backwards()
        for outline, area in zip(outlines, areas, strict=True)
    )


def _area_px2(corners: tuple[tuple[float, float], ...]) -> float:
    x, y = np.array(corners).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def _chords(
    start: NDArray[np.float64], end: NDArray[np.float64], middle: NDArray[np.float64]
) -> list[tuple[float, float]]:
    """Points on the parabola through three points, without its last point."""
    bend = start + end - 2.0 * middle
    # Largest distance between the parabola and n equal chords: an eighth of its second derivative, 4 `bend`, divided by
    # n squared.
    count = int(np.clip(np.ceil(np.sqrt(0.5 * float(np.hypot(*bend)) / SAGITTA_PX)), 1, MOST_CHORDS))
    t = np.arange(count) / count
    x, y = np.outer(start, (1 - t) * (1 - 2 * t)) + np.outer(middle, 4 * t * (1 - t)) + np.outer(end, t * (2 * t - 1))
    return list(zip(x.tolist(), y.tolist(), strict=True))
