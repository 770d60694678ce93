"""Pairs of parallel straight edges in a picture: all candidates for the width of a bar or a slot."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from calib.errors import CalibrationError
from calib.parallel_edges import ParallelEdges, measure_parallel_edges
from calib.straight_edges import FINDING_SIDES_PX, StraightEdge, find_straight_edges

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8] | NDArray[np.uint16]

# Largest angle between two candidate edges (degrees), and largest change of the width per length after the measurement.
PARALLEL_DEG, LARGEST_TAPER = 5.0, 0.02
# Smallest length over which two edges face each other, as a share of the longer edge, and as a share of their distance.
LEAST_FACING, LEAST_FACING_OF_WIDTH = 0.3, 0.12
# Two edges are not neighbours if an edge between them extends over this share of the length over which they face each
# other.
BETWEEN = 0.3
# Smallest contrast of a pair as a share of the strongest pair's; weaker pairs are shadows and reflections.
LEAST_OF_STRONGEST = 0.4
# Pairs that agree within this distance (pixels) are the same pair.
SAME_PAIR_PX = 3.0
# Tolerance for an edge that joins the two edges of a pair, as a share of their distance.
ACROSS = 0.15
# Largest number of edges that are examined; shorter edges beyond this number are regarded as texture.
MOST_EDGES = 100


def find_edge_pairs(grey: Grey, region: tuple[int, int, int, int] | None = None) -> list[ParallelEdges]:
    """Measure every pair of neighbouring parallel edges, the longest first.

    Parameters
    ----------
    grey : ndarray, shape (height, width)
        Original grey levels.
    region : tuple of int, optional
        x, y, width and height of the part of the picture to be searched.

    Returns
    -------
    list of ParallelEdges
        Pairs of edges, in coordinates of the full picture.
    """
    part, x, y = _part(grey, region)
    levels = part.astype(np.float64)
    for side_px in FINDING_SIDES_PX:
        pairs = _measured(levels, _facing(find_straight_edges(part, side_px)[:MOST_EDGES]))
        if pairs:
            return [pair.moved(x, y) for pair in pairs]
    return []


def straight_edges_in_view(grey: Grey, region: tuple[int, int, int, int] | None) -> int:
    """Count straight edges, to report what is missing if no pair was found."""
    return len(find_straight_edges(_part(grey, region)[0], FINDING_SIDES_PX[0]))


def has_square_end(grey: Grey, region: tuple[int, int, int, int] | None, pair: ParallelEdges) -> bool:
    """Whether a straight edge across the pair joins its two edges at one end: the third side of a rectangle.

    Parameters
    ----------
    grey, region
        As for `find_edge_pairs`.
    pair : ParallelEdges
        A pair of edges found in this picture.
    """
    part, x, y = _part(grey, region)
    across = (pair.points_px[1] - pair.points_px[0]) / pair.width_px
    for edge in find_straight_edges(part, FINDING_SIDES_PX[0]):
        reach = np.sort((edge.ends + np.array([x, y]) - pair.points_px[0]) @ across) / pair.width_px
        is_across = abs(float(edge.direction @ across)) > np.cos(np.radians(PARALLEL_DEG))
        if is_across and reach[0] > -ACROSS and reach[1] < 1.0 + ACROSS and reach[1] - reach[0] > 1.0 - 2.0 * ACROSS:
            return True
    return False


def _part(grey: Grey, region: tuple[int, int, int, int] | None) -> tuple[Grey, int, int]:
    """Return a region of a picture, and the region's origin in the picture."""
    x, y, width, height = region if region is not None else (0, 0, grey.shape[1], grey.shape[0])
    if x < 0 or y < 0 or width < 1 or height < 1 or x + width > grey.shape[1] or y + height > grey.shape[0]:
        raise CalibrationError(
            f"The region must lie within the picture of {grey.shape[1]}x{grey.shape[0]} pixels, but is "
            f"{x},{y},{width},{height}: give X,Y,WIDTH,HEIGHT."
        )
    return grey[y : y + height, x : x + width], x, y


def _facing(edges: Sequence[StraightEdge]) -> list[tuple[StraightEdge, StraightEdge, bool]]:
    facing = []
    for index, first in enumerate(edges):
        for second in edges[index + 1 :]:
            if first.direction @ second.direction > -np.cos(np.radians(PARALLEL_DEG)):
                continue
            apart = float((second.ends.mean(axis=0) - first.ends.mean(axis=0)) @ first.to_dark)
            over = _facing_px(first, second)
            longest = max(first.length_px, second.length_px)
            if over < max(LEAST_FACING * longest, LEAST_FACING_OF_WIDTH * abs(apart)) or abs(apart) < 3.0:
                continue
            if not any(_between(first, second, apart, over, other) for other in edges):
                facing.append((first, second, apart < 0.0))
    return facing


def _facing_px(first: StraightEdge, second: StraightEdge) -> float:
    along = np.sort((second.ends - first.ends[0]) @ first.direction)
    return float(min(first.length_px, along[1]) - max(0.0, along[0]))


def _between(first: StraightEdge, second: StraightEdge, apart: float, over: float, other: StraightEdge) -> bool:
    if other is first or other is second:
        return False
    across = (other.ends - first.ends[0]) @ first.to_dark / apart
    of_second = (second.ends - first.ends[0]) @ first.to_dark / apart
    margin = min(SAME_PAIR_PX / abs(apart), 0.1)
    if across.min() < margin or across.max() > of_second.min() - margin:
        return False
    return _facing_px(first, other) > BETWEEN * over


def _measured(levels: Floats, facing: Sequence[tuple[StraightEdge, StraightEdge, bool]]) -> list[ParallelEdges]:
    pairs: list[ParallelEdges] = []
    for first, second, light in facing:
        try:
            pair = measure_parallel_edges(levels, (first.ends, second.ends), light)
        except CalibrationError:
            continue
        if abs(pair.taper) > LARGEST_TAPER or any(_same(pair, other) for other in pairs):
            continue
        pairs.append(pair)
    strongest = max((pair.contrast for pair in pairs), default=0.0)
    pairs = [pair for pair in pairs if pair.contrast >= LEAST_OF_STRONGEST * strongest]
    return sorted(pairs, key=lambda pair: -pair.length_px)


def _same(pair: ParallelEdges, other: ParallelEdges) -> bool:
    return bool(np.max(np.abs(pair.middle_px - other.middle_px)) < SAME_PAIR_PX) and bool(
        abs(pair.width_px - other.width_px) < SAME_PAIR_PX
    )
