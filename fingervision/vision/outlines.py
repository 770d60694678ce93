"""Outlines of all objects in a binary picture, to the nearest pixel, in the fingers' axes."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.direction import Direction
from fingervision.domain.loops import loop
from fingervision.vision.orientation import Orientation

# Points of an outline in order, shape (n, 2).
Outline = NDArray[np.int32]

# Length of outline (pixels) below which an object is a speck.
SHORTEST_OUTLINE_PX = 20

_from_lowest, _largest_extents = loop("outlines_from_lowest"), loop("outlines_largest_extents")


@dataclass(frozen=True, slots=True, eq=False)
class Outlines:
    """The outlines of all objects in a binary picture, one after another in one array.

    Parameters
    ----------
    points : ndarray of int32, shape (n, 2)
        Coordinates (x, y) of the points of all outlines.
    starts : ndarray of int64, shape (m + 1,)
        Index in `points` at which each outline starts; the last entry is the number of points.
    third_length : int
        Number of points of the third longest outline; 0 if there are fewer outlines.
    """

    points: Outline
    starts: NDArray[np.int64]
    third_length: int

    def __len__(self) -> int:
        return len(self.starts) - 1

    def __getitem__(self, number: int) -> Outline:
        return self.points[self.starts[number] : self.starts[number + 1]]


def find_outlines(mask: NDArray[np.uint8]) -> Outlines:
    """Outlines (x, y) of all objects in a mask, including holes, without specks."""
    found, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    long = [outline for outline in found if len(outline) > SHORTEST_OUTLINE_PX]
    points = np.concatenate(long)[:, 0] if long else np.empty((0, 2), dtype=np.int32)
    lengths = [len(outline) for outline in long]
    starts = np.array([0, *accumulate(lengths)], dtype=np.int64)
    return Outlines(np.asarray(points, dtype=np.int32), starts, sorted(lengths)[-3] if len(long) > 2 else 0)


def longest_first(outlines: Outlines, directions: Sequence[Direction]) -> list[tuple[Direction, int]]:
    """The directions, each with the extent of the longest outline along it (pixels), largest first."""
    widest, tallest = _largest_extents(outlines.points, outlines.starts)
    sizes = [(direction, tallest if direction.is_vertical else widest) for direction in directions]
    return sorted(sizes, key=lambda size: -size[1])


def in_axes(pixels: Outline, orientation: Orientation) -> Outline:
    """Convert a closed outline (x, y) to the fingers' axes; it then starts at its lowest point."""
    pixels = np.ascontiguousarray(pixels, dtype=np.int32)
    outline = np.empty_like(pixels)
    is_vertical, size = orientation.direction.is_vertical, orientation.along_size
    _from_lowest(pixels, is_vertical, orientation.is_flipped, size, outline)
    return outline
