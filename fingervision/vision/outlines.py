"""The outlines of everything in a binary picture, to a pixel, seen in the fingers' axes."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.direction import Direction
from fingervision.domain.loops import loop
from fingervision.vision.orientation import Orientation

# Points in order, shape (n, 2).
Outline = NDArray[np.int32]

# What has a shorter outline is a speck (pixels).
SHORTEST_OUTLINE_PX = 20

_from_lowest = loop("outlines_from_lowest")


def find_outlines(mask: NDArray[np.uint8]) -> list[Outline]:
    """Outlines (x, y) of everything set in a mask, holes included, but for specks."""
    outlines, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    return [np.asarray(outline[:, 0, :], dtype=np.int32) for outline in outlines if len(outline) > SHORTEST_OUTLINE_PX]


def longest_first(outlines: list[Outline], directions: Sequence[Direction]) -> list[tuple[Direction, int]]:
    """Directions with the extent of the longest outline along them (pixels), the greatest first."""
    sizes = [cv2.boundingRect(outline)[2:] for outline in outlines] or [(0, 0)]
    widest, tallest = (max(size[axis] for size in sizes) for axis in (0, 1))
    extents = [(direction, tallest if direction.is_vertical else widest) for direction in directions]
    return sorted(extents, key=lambda extent: -extent[1])


def in_axes(pixels: Outline, orientation: Orientation) -> Outline:
    """A closed outline (x, y) in the fingers' axes, from its lowest point on: it rises and falls back to it."""
    pixels = np.ascontiguousarray(pixels, dtype=np.int32)
    outline = np.empty_like(pixels)
    is_vertical, size = orientation.direction.is_vertical, orientation.along_size
    _from_lowest(pixels, is_vertical, orientation.is_flipped, size, outline)
    return outline
