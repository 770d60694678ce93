"""Straight edges of a picture, located to the nearest pixel, and the pairs that bound a bar or a slot."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.errors import CalibrationError
from calib.parallel_edges import ParallelEdges, measure_parallel_edges

Floats = NDArray[np.float64]

# Lengths (pixels) of the longer side of the reduced picture in which edges are found; the averaging reduces noise and
# blur, and an error of one or two pixels is permitted.
FINDING_SIDES_PX = (640, 320)
# Largest difference in direction (degrees), and largest distance from the line (pixels of the reduced picture), of
# segments that belong to one edge.
SAME_DIRECTION_DEG, SAME_LINE_PX = 4.0, 2.0
# Largest interruption of an edge (by dust or a highlight), as a share of the total length of both segments.
LARGEST_BREAK = 0.5
# Smallest length of an edge (pixels of the reduced picture); shorter segments are corners, letters and dust.
SHORTEST_EDGE_PX = 14.0


@dataclass(frozen=True, slots=True)
class StraightEdge:
    """A straight edge from (x0, y0) to (x1, y1) in pixels, with the dark side to the right of this direction.

    "Right" refers to the picture as displayed, with x to the right and y downwards.
    """

    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def length_px(self) -> float:
        """Length of the edge."""
        return hypot(self.x1 - self.x0, self.y1 - self.y0)

    @property
    def direction(self) -> Floats:
        """Unit vector along the edge, shape (2,)."""
        return np.array([self.x1 - self.x0, self.y1 - self.y0]) / self.length_px

    @property
    def to_dark(self) -> Floats:
        """Unit vector perpendicular to the edge, towards its dark side, shape (2,)."""
        along = self.direction
        return np.array([-along[1], along[0]])

    @property
    def ends(self) -> Floats:
        """End points of the edge, shape (2, 2)."""
        return np.array([[self.x0, self.y0], [self.x1, self.y1]])


def find_straight_edges(grey: NDArray[np.uint8] | NDArray[np.uint16], side_px: int) -> list[StraightEdge]:
    """Find straight edges, the longest first.

    The edges are line segments found by the method of Grompone von Gioi et al. (IEEE PAMI 32(4), 2010, 722-732);
    segments that continue each other are joined.

    Parameters
    ----------
    grey : ndarray, shape (height, width)
        Grey levels.
    side_px : int
        Largest length of the longer side of the (reduced) picture in which edges are searched.
    """
    factor = min(1.0, side_px / max(grey.shape))
    small = cv2.resize(grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA) if factor < 1.0 else grey
    low, high = (float(level) for level in np.percentile(small, (0.1, 99.9)))
    if not high > low:
        return []
    stretched = np.clip((small.astype(np.float32) - low) * (255.0 / (high - low)), 0, 255).astype(np.uint8)
    found = cv2.createLineSegmentDetector().detect(cv2.GaussianBlur(stretched, (0, 0), 1.0))[0]
    if found is None:
        return []
    scale = np.array([grey.shape[1] / small.shape[1], grey.shape[0] / small.shape[0]] * 2)
    segments = (np.asarray(found, dtype=np.float64).reshape(-1, 4) + 0.5) * scale - 0.5
    edges = [StraightEdge(*(float(value) for value in segment)) for segment in segments]
    edges = _joined([edge for edge in edges if edge.length_px * factor > SHORTEST_EDGE_PX / 2], SAME_LINE_PX / factor)
    return [edge for edge in edges if edge.length_px * factor >= SHORTEST_EDGE_PX]


def _joined(edges: list[StraightEdge], beside_px: float) -> list[StraightEdge]:
    waiting = sorted(edges, key=lambda edge: -edge.length_px)
    joined: list[StraightEdge] = []
    while waiting:
        edge = waiting.pop(0)
        while True:
            piece = next((other for other in waiting if _continues(edge, other, beside_px)), None)
            if piece is None:
                break
            waiting.remove(piece)
            ends = np.concatenate([edge.ends, piece.ends])
            along = (ends - ends[0]) @ edge.direction
            first, last = ends[int(np.argmin(along))], ends[int(np.argmax(along))]
            edge = StraightEdge(float(first[0]), float(first[1]), float(last[0]), float(last[1]))
        joined.append(edge)
    return sorted(joined, key=lambda edge: -edge.length_px)


def _continues(edge: StraightEdge, piece: StraightEdge, beside_px: float) -> bool:
    if edge.direction @ piece.direction < np.cos(np.radians(SAME_DIRECTION_DEG)):
        return False
    away = piece.ends - edge.ends[0]
    if np.max(np.abs(away @ edge.to_dark)) > beside_px:
        return False
    along = np.sort(away @ edge.direction)
    apart = max(along[0] - edge.length_px, -along[1])
    return bool(apart <= LARGEST_BREAK * (edge.length_px + piece.length_px))


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
