"""Plane shapes from which a body is composed: polygons and ellipses, each with its outline and its interior."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fingervision.models.outline_curves import Curve, crossings

Array = NDArray[np.float64]
Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Polygon:
    """A straight-sided shape.

    Parameters
    ----------
    corners_mm : tuple of (float, float)
        Corners in order, clockwise or anticlockwise.
    """

    corners_mm: tuple[Point, ...]

    def curves(self) -> list[Curve]:
        """Sides of the polygon, as curves."""
        corners = np.array(self.corners_mm)
        pairs = zip(corners, np.roll(corners, -1, axis=0), strict=True)
        return [Curve(a, b - a, None, 0.0, 1.0) for a, b in pairs if np.hypot(*(b - a)) > 0.0]

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Whether points, shape (2, n), lie inside: an odd number of the polygon's sides is then to their right."""
        x, y = points
        inside = np.zeros(x.shape, dtype=bool)
        corners = np.array(self.corners_mm)
        for (xa, ya), (xb, yb) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            if ya != yb:
                inside ^= ((ya > y) != (yb > y)) & (x < xa + (xb - xa) * (y - ya) / (yb - ya))
        return inside


@dataclass(frozen=True, slots=True)
class Ellipse:
    """A disc or an ellipse.

    Parameters
    ----------
    centre_mm : (float, float)
        Centre of the ellipse.
    half_axes_mm : (float, float)
        Half axes, along the ellipse's axis and across it; equal for a disc.
    axis_deg : float
        Angle of the ellipse's axis from x.
    """

    centre_mm: Point
    half_axes_mm: Point
    axis_deg: float = 0.0

    def _axes(self) -> tuple[Array, Array]:
        angle = np.radians(self.axis_deg)
        along = np.array([np.cos(angle), np.sin(angle)])
        return self.half_axes_mm[0] * along, self.half_axes_mm[1] * np.array([-along[1], along[0]])

    def curves(self) -> list[Curve]:
        """Outline of the ellipse as four arcs."""
        u, v = self._axes()
        quarters = np.pi / 2.0 * np.arange(5.0)
        return [Curve(np.array(self.centre_mm), u, v, a, b) for a, b in pairwise(quarters.tolist())]

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Whether points, shape (2, n), lie inside."""
        return np.asarray(self.curves()[0].level(points) < 0.0)


Shape = Polygon | Ellipse


def crosses_itself(corners_mm: tuple[Point, ...]) -> bool:
    """Whether two non-adjacent sides of a polygon meet."""
    sides = Polygon(corners_mm).curves()
    count = len(sides)
    return any(
        crossings(sides[i], sides[j])
        for i in range(count)
        for j in range(i + 2, count)
        if not (i == 0 and j == count - 1)
    )


def bar(x0: float, y0: float, x1: float, y1: float, width_mm: float) -> Polygon:
    """A straight bar whose axis joins two points."""
    length = float(np.hypot(x1 - x0, y1 - y0))
    nx, ny = -(y1 - y0) / length * width_mm / 2.0, (x1 - x0) / length * width_mm / 2.0
    return Polygon(((x0 - nx, y0 - ny), (x1 - nx, y1 - ny), (x1 + nx, y1 + ny), (x0 + nx, y0 + ny)))


def box(x0: float, x1: float, y0: float, y1: float) -> Polygon:
    """An upright rectangle."""
    return Polygon(((x0, y0), (x1, y0), (x1, y1), (x0, y1)))
