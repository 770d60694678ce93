"""The fingers' axes: every position is expressed as if the tips pointed up in the picture.

`across` grows to the image's right for tips up or down, and downwards for tips left or right. `along` grows from the
tips towards the roots. A picture is turned by an array view, never by copying or resampling, so that a turned or
mirrored recording gives the same numbers.
"""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.direction import Direction


@dataclass(frozen=True, slots=True)
class Orientation:
    """The transformation between a picture's pixels and the fingers' axes.

    Parameters
    ----------
    direction : Direction
        Direction in which the tips point.
    height_px, width_px : int
        Size of the picture.
    """

    direction: Direction
    height_px: int
    width_px: int

    @property
    def across_size(self) -> int:
        """Size of the picture across the fingers (pixels)."""
        return self.width_px if self.direction.is_vertical else self.height_px

    @property
    def along_size(self) -> int:
        """Size of the picture along the fingers (pixels)."""
        return self.height_px if self.direction.is_vertical else self.width_px

    @property
    def is_flipped(self) -> bool:
        """Whether the axis along the fingers runs opposite to the picture's axis."""
        return self.direction in (Direction.DOWN, Direction.RIGHT)

    def view(self, image: NDArray[Any]) -> NDArray[Any]:
        """View of the picture as if the tips pointed up: the row index counts along the fingers, from the tips."""
        upright = image if self.direction.is_vertical else image.T
        return upright[::-1] if self.is_flipped else upright

    def upright(self, mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return a mask as if the tips pointed up, contiguous in memory.

        The function `upright` is faster than NumPy's copy of a transposed view.
        """
        turned = mask if self.direction.is_vertical else cv2.transpose(mask)
        return np.ascontiguousarray(cv2.flip(turned, 0) if self.is_flipped else turned, dtype=np.uint8)

    def to_pixels(self, across: float, along: float) -> tuple[float, float]:
        """Convert (across, along) to pixel coordinates (x, y)."""
        if self.is_flipped:
            along = self.along_size - 1 - along
        return (across, along) if self.direction.is_vertical else (along, across)

    def points_to_pixels(
        self, across: NDArray[np.float64], along: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Convert arrays of (across, along) to pixel coordinates (x, y)."""
        if self.is_flipped:
            along = self.along_size - 1 - along
        return (across, along) if self.direction.is_vertical else (along, across)

    def along_to_pixels(self, along: float) -> float:
        """Convert a coordinate along the fingers to the picture's coordinate on the same axis."""
        return self.along_size - 1 - along if self.is_flipped else along
