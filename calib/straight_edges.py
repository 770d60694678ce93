"""Straight edges of a picture, located to the nearest pixel: candidates for the edges of a bar or a slot."""

from dataclasses import dataclass
from math import hypot

import cv2
import numpy as np
from numpy.typing import NDArray

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
