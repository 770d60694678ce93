"""A circular arc, as a piece of an outline."""

from dataclasses import dataclass
from math import atan2, ceil, cos, floor, pi, sin

import numpy as np
from numpy.typing import NDArray

from fingervision.rendering.plane import Motion, Points


@dataclass(frozen=True, slots=True)
class Arc:
    """A circular arc about (x, y), from the angle `start_rad` through `sweep_rad` (positive from x towards y)."""

    x_px: float
    y_px: float
    radius_px: float
    start_rad: float
    sweep_rad: float

    @property
    def start(self) -> tuple[float, float]:
        """First point of the arc."""
        return self._at(0.0)

    @property
    def end(self) -> tuple[float, float]:
        """Last point of the arc."""
        return self._at(1.0)

    def _at(self, t: float) -> tuple[float, float]:
        angle = self.start_rad + t * self.sweep_rad
        return (self.x_px + self.radius_px * cos(angle), self.y_px + self.radius_px * sin(angle))

    @property
    def length_px(self) -> float:
        """Length along the arc."""
        return abs(self.radius_px * self.sweep_rad)

    @property
    def box_px(self) -> tuple[float, float, float, float]:
        """Bounding box of the arc: smallest x, smallest y, largest x, largest y."""
        # The outermost points of an arc are its ends, or points where it crosses a horizontal or vertical line through
        # its centre.
        quarters = sorted((self.start_rad / (pi / 2), (self.start_rad + self.sweep_rad) / (pi / 2)))
        passed = [quarter * pi / 2 for quarter in range(ceil(quarters[0]), floor(quarters[1]) + 1)]
        x = [self.start[0], self.end[0]] + [self.x_px + self.radius_px * cos(angle) for angle in passed]
        y = [self.start[1], self.end[1]] + [self.y_px + self.radius_px * sin(angle) for angle in passed]
        return (min(x), min(y), max(x), max(y))

    def points(self, t: NDArray[np.float64]) -> Points:
        """Points at the fractions `t` of the length, shape (n, 2)."""
        angle = self.start_rad + np.asarray(t, dtype=np.float64) * self.sweep_rad
        x = self.x_px + self.radius_px * np.cos(angle)
        y = self.y_px + self.radius_px * np.sin(angle)
        return np.stack([x, y], axis=-1)

    def heading_rad(self, t: float) -> float:
        """Direction of travel at the fraction `t`, from x towards y."""
        quarter = pi / 2 if self.sweep_rad * self.radius_px >= 0.0 else -pi / 2
        return self.start_rad + t * self.sweep_rad + quarter

    def part(self, t0: float, t1: float) -> "Arc":
        """Return the part between two fractions of the length."""
        start = self.start_rad + t0 * self.sweep_rad
        return Arc(self.x_px, self.y_px, self.radius_px, start, (t1 - t0) * self.sweep_rad)

    def backwards(self) -> "Arc":
        """Return the arc with its direction reversed."""
        return Arc(self.x_px, self.y_px, self.radius_px, self.start_rad + self.sweep_rad, -self.sweep_rad)

    def moved(self, motion: Motion) -> "Arc":
        """Return the arc after a rigid motion."""
        x, y = motion.place(self.x_px, self.y_px)
        first_x, first_y = motion.place(*self.start)
        sweep = -self.sweep_rad if motion.mirrors else self.sweep_rad
        return Arc(x, y, self.radius_px, atan2(first_y - y, first_x - x), sweep)

    def grown(self, by_px: float) -> "Arc":
        """Offset the arc parallel to itself by `by_px`, towards the outside of the outline."""
        outwards = 1.0 if self.sweep_rad >= 0.0 else -1.0
        return Arc(self.x_px, self.y_px, self.radius_px + outwards * by_px, self.start_rad, self.sweep_rad)
