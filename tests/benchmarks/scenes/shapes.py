"""Outlines as polygons, and the truth that is read off them."""

from dataclasses import dataclass
from math import cos, hypot, radians, sin

import numpy as np

from tests.benchmarks.scenes.canvas import Points, Rng

ARC_POINTS = 48


def arc(x: float, y: float, radius: float, start_deg: float, end_deg: float) -> Points:
    """Points of an arc; angles from the x axis towards y."""
    angle = np.radians(np.linspace(start_deg, end_deg, ARC_POINTS))
    return np.column_stack((x + radius * np.cos(angle), y + radius * np.sin(angle)))


def disc(x: float, y: float, radius: float) -> Points:
    """A full circle."""
    angle = np.linspace(0.0, 2.0 * np.pi, 240, endpoint=False)
    return np.column_stack((x + radius * np.cos(angle), y + radius * np.sin(angle)))


def box(x0: float, y0: float, x1: float, y1: float) -> Points:
    """A rectangle."""
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)


def turned(points: Points, degrees: float, about: tuple[float, float]) -> Points:
    """The same outline turned about a point."""
    c, s = cos(radians(degrees)), sin(radians(degrees))
    away = points - np.array(about)
    return away @ np.array([[c, s], [-s, c]]) + np.array(about)


def blob(x: float, y: float, radius: float, rng: Rng, rough: float = 0.25) -> Points:
    """An irregular closed outline."""
    angle = np.linspace(0.0, 2.0 * np.pi, 200, endpoint=False)
    r = np.ones_like(angle)
    for k in range(2, 7):
        r += rough / k * rng.normal() * np.cos(k * angle + rng.uniform(0, 2 * np.pi))
    r = radius * np.clip(r, 0.3, 2.0)
    return np.column_stack((x + r * np.cos(angle), y + r * np.sin(angle)))


def smooth_way(places: Points) -> Points:
    """A smooth curve through places (Catmull and Rom)."""
    p = np.vstack((2 * places[0] - places[1], places, 2 * places[-1] - places[-2]))
    t = np.linspace(0.0, 1.0, 30)[:, None]
    pieces = [
        0.5
        * (
            2 * p[i]
            + (p[i + 1] - p[i - 1]) * t
            + (2 * p[i - 1] - 5 * p[i] + 4 * p[i + 1] - p[i + 2]) * t**2
            + (3 * p[i] - p[i - 1] - 3 * p[i + 1] + p[i + 2]) * t**3
        )
        for i in range(1, len(p) - 2)
    ]
    return np.vstack(pieces)


@dataclass(frozen=True)
class Finger:
    """A bar with two shaped corners, tips up, its root far below the picture.

    Parameters
    ----------
    middle_px, tip_px : float
        Middle of its end before it is turned about that point.
    width_px : float
        Breadth at the end.
    inner_corner_px, outer_corner_px : float
        Radius of the corner, or length of its cut where `is_cut`.
    tilt_deg : float
        Turn; positive turns clockwise on the screen.
    side : int
        -1 for the left finger, +1 for the right one.
    is_cut : bool
        Corners cut straight at 45 degrees instead of rounded.
    taper : float
        How much broader it gets on either side per pixel towards the root.
    length_px : float
        How far it goes down.
    """

    middle_px: float
    tip_px: float
    width_px: float
    inner_corner_px: float
    outer_corner_px: float
    tilt_deg: float
    side: int
    is_cut: bool = False
    taper: float = 0.0
    length_px: float = 900.0

    def outline(self) -> Points:
        """Closed polygon, from the inner root over the tip to the outer root."""
        half, s = 0.5 * self.width_px, -float(self.side)  # s points to the gap
        inner, outer = self.inner_corner_px, self.outer_corner_px
        if self.is_cut:
            top = np.array([(half, inner), (half - inner, 0.0), (-half + outer, 0.0), (-half, outer)])
        else:
            top = np.vstack(
                (arc(half - inner, inner, inner, 0.0, -90.0), arc(-half + outer, outer, outer, -90.0, -180.0))
            )
        wide = half + self.taper * self.length_px
        own = np.vstack(([(wide, self.length_px)], top, [(-wide, self.length_px)]))
        own[:, 0] *= s
        return turned(own + np.array([self.middle_px, self.tip_px]), self.tilt_deg, (self.middle_px, self.tip_px))

    def tip(self) -> float:
        """Height of the outermost point."""
        return float(self.outline()[:, 1].min())

    def inner(self, height: float) -> float:
        """Where the inner side crosses a row."""
        crossings = crossings_of(self.outline(), height)
        return max(crossings) if self.side < 0 else min(crossings)


def crossings_of(points: Points, height: float) -> list[float]:
    """Where a closed polygon crosses a row."""
    following = np.roll(points, -1, axis=0)
    found = []
    for (x0, y0), (x1, y1) in zip(points, following, strict=True):
        if (y0 - height) * (y1 - height) < 0.0 or (y0 == height and y1 != height):
            found.append(x0 + (x1 - x0) * (height - y0) / (y1 - y0))
    return found


def gap_between(left: Finger, right: Finger, below_px: float) -> float:
    """Distance between the inner sides, each so far below its own tip."""
    heights = [finger.tip() + below_px for finger in (left, right)]
    across = [finger.inner(height) for finger, height in zip((left, right), heights, strict=True)]
    return hypot(across[1] - across[0], heights[1] - heights[0])
