"""A straight piece of an outline."""

from dataclasses import dataclass
from math import atan2, cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from fingervision.rendering.plane import Motion, Points


@dataclass(frozen=True, slots=True)
class Line:
    """A straight piece from (x0, y0) to (x1, y1)."""

    x0_px: float
    y0_px: float
    x1_px: float
    y1_px: float

    @property
    def start(self) -> tuple[float, float]:
        """First point of the line."""
        return (self.x0_px, self.y0_px)

    @property
    def end(self) -> tuple[float, float]:
        """Last point of the line."""
        return (self.x1_px, self.y1_px)

    @property
    def length_px(self) -> float:
        """Length of the line."""
        return hypot(self.x1_px - self.x0_px, self.y1_px - self.y0_px)

    @property
    def box_px(self) -> tuple[float, float, float, float]:
        """Bounding box of the line: smallest x, smallest y, largest x, largest y."""
        (x0, y0), (x1, y1) = self.start, self.end
        return (min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1))

    def points(self, t: NDArray[np.float64]) -> Points:
        """Points at the fractions `t` of the length, shape (n, 2)."""
        t = np.asarray(t, dtype=np.float64)
        x = self.x0_px + t * (self.x1_px - self.x0_px)
        y = self.y0_px + t * (self.y1_px - self.y0_px)
        return np.stack([x, y], axis=-1)

    def heading_rad(self, t: float) -> float:
        """Direction of travel at the fraction `t`, from x towards y."""
        del t
        return atan2(self.y1_px - self.y0_px, self.x1_px - self.x0_px)

    def part(self, t0: float, t1: float) -> "Line":
        """Return the part between two fractions of the length."""
        (x0, y0), (x1, y1) = self.points(np.array([t0, t1])).tolist()
        return Line(x0, y0, x1, y1)

    def backwards(self) -> "Line":
        """Return the line with its direction reversed."""
        return Line(self.x1_px, self.y1_px, self.x0_px, self.y0_px)

    def moved(self, motion: Motion) -> "Line":
        """Return the line after a rigid motion."""
        return Line(*motion.place(*self.start), *motion.place(*self.end))

    def grown(self, by_px: float) -> "Line":
        """Offset the line parallel to itself by `by_px`, towards the outside of the outline."""
        heading = self.heading_rad(0.0)
        out_x, out_y = by_px * sin(heading), -by_px * cos(heading)
        return Line(self.x0_px + out_x, self.y0_px + out_y, self.x1_px + out_x, self.y1_px + out_y)
