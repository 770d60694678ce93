"""The picture plane: its points and rigid motions.

Coordinates are those of the picture: x to the right, y downwards, origin at the centre of the first pixel, lengths in
pixels.
"""

from dataclasses import dataclass
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]
"""Points in the picture, shape (..., 2): x and y."""

# Points closer than this are regarded as the same point; the value is far below every tolerance, and far above rounding
# errors in a 4K frame.
SAME_POINT_PX = 1e-7


@dataclass(frozen=True, slots=True)
class Motion:
    """A rigid motion of the plane, reflections included: matrix times point plus shift.

    Parameters
    ----------
    xx, xy, yx, yy : float
        Orthogonal matrix: new x = xx x + xy y, new y = yx x + yy y.
    x_px, y_px : float
        Shift.
    """

    xx: float = 1.0
    xy: float = 0.0
    yx: float = 0.0
    yy: float = 1.0
    x_px: float = 0.0
    y_px: float = 0.0

    @staticmethod
    def turn(angle_rad: float) -> "Motion":
        """Rotation about the origin, from x towards y (clockwise on the screen, because y points down)."""
        return Motion(cos(angle_rad), -sin(angle_rad), sin(angle_rad), cos(angle_rad))

    @property
    def mirrors(self) -> bool:
        """Whether the motion includes a reflection."""
        return self.xx * self.yy - self.xy * self.yx < 0.0

    def place(self, x_px: float, y_px: float) -> tuple[float, float]:
        """Position of a point after the motion."""
        return (self.xx * x_px + self.xy * y_px + self.x_px, self.yx * x_px + self.yy * y_px + self.y_px)
