"""Quantities that a gauge can measure: a value in pixels with its uncertainty, and the points that define it.

The measured points are corrected for lens and perspective; the picture is never resampled. In millimetres, `u` includes
the whole uncertainty budget of a calibration. With a bare scale, which has no stated uncertainty, `u` is the
uncertainty of the fit only, as in pixels.
"""

from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin
from typing import NamedTuple, Protocol

from fingervision.gauges.plane_scale import PlaneScale

Point = tuple[float, float]
# An angle is corrected for lens and plane by means of two points at this distance (pixels) on either side of its
# middle.
ANGLE_REACH_PX = 10.0
SQRT_2 = 2.0**0.5


class Cell(NamedTuple):
    """Value and standard uncertainties, as in a row of gauges.csv.

    Parameters
    ----------
    value, u : float
        Value and its standard uncertainty.
    unit : str
        Unit of value and uncertainties.
    u_random : float
        The part of `u` that differs from frame to frame.
    u_phase : float
        The part that depends on where edges lie within their pixels: it does not cancel in a motion.
    relative_u : float
        Relative standard uncertainty of a change of the value, shared by all frames.
    """

    value: float
    u: float
    unit: str
    u_random: float
    u_phase: float = 0.0
    relative_u: float = 0.0

    def u_motion(self, first: "Cell") -> float:
        """Standard uncertainty of the difference from a value in an earlier frame: what both share cancels."""
        own = hypot(self.u_random, self.u_phase, first.u_random, first.u_phase)
        return 0.0 if self is first else hypot(own, self.relative_u * (self.value - first.value))


class Quantity(Protocol):
    """One quantity that a gauge measures."""

    @property
    def points_px(self) -> tuple[Point, ...]:
        """Points of the picture that define the measured quantity."""
        ...

    def in_pixels(self) -> Cell:
        """The value of the quantity in the picture, in pixels or degrees."""
        ...

    def on_plane(self, flat: tuple[Point, ...], scale: PlaneScale) -> Cell:
        """The value of the quantity in the object plane; `flat` are the points corrected for lens and perspective."""
        ...


@dataclass(frozen=True, slots=True)
class Position:
    """Position of a point or an edge along a direction.

    In pixels the position is measured from the centre of the picture's first pixel; in millimetres from the picture's
    centre, like `left_mm` in gaps.csv.

    Parameters
    ----------
    point_px : (float, float)
        The point, or the point at which the edge crosses the gauge's axis.
    direction_rad : float
        Direction of the position: 0 to the right, pi / 2 downwards.
    u_px : float
        Standard uncertainty along the direction, from the fit.
    dark_side : int
        For an edge: +1 if the side beyond the edge (along the direction) is dark, -1 if it is light; 0 for a point.
    u_response_px : float
        Standard uncertainty of an edge's position due to an unknown camera response.
    """

    point_px: Point
    direction_rad: float
    u_px: float
    dark_side: int = 0
    u_response_px: float = 0.0

    @property
    def points_px(self) -> tuple[Point, ...]:
        """The point."""
        return (self.point_px,)

    def in_pixels(self) -> Cell:
        """Position of the point along the direction, in pixels."""
        x, y = self.point_px
        return Cell(x * cos(self.direction_rad) + y * sin(self.direction_rad), self.u_px, "px", self.u_px)

    def on_plane(self, flat: tuple[Point, ...], scale: PlaneScale) -> Cell:
        """Position in millimetres from the picture's centre; for an edge, corrected by half of the edge bias."""
        ((x, y),) = flat
        x, y = x - scale.middle_px[0], y - scale.middle_px[1]
        away_px = x * cos(self.direction_rad) + y * sin(self.direction_rad)
        value_px = away_px + 0.5 * self.dark_side * scale.edge_bias_px
        relative = scale.relative_u(self.point_px, self.direction_rad)
        edge_px = scale.u_edge_px(self.u_response_px) if self.dark_side else 0.0
        phase_px = scale.u_phase_px if self.dark_side else 0.0
        return _in_mm(scale, value_px, hypot(relative * away_px, edge_px), self.u_px, phase_px, relative)


@dataclass(frozen=True, slots=True)
class Distance:
    """Distance between two points on two edges.

    Parameters
    ----------
    first_px, second_px : (float, float)
        The two points.
    u_px : float
        Standard uncertainty of the distance, from the fit.
    polarity : int
        +1 if the area between the edges is light, -1 if this area is dark; 0 if both edges have the same polarity, so
        that their biases cancel.
    u_response_px : float
        Standard uncertainty of each edge's position due to an unknown camera response.
    """

    first_px: Point
    second_px: Point
    u_px: float
    polarity: int
    u_response_px: float = 0.0

    @property
    def points_px(self) -> tuple[Point, ...]:
        """Both points."""
        return (self.first_px, self.second_px)

    def in_pixels(self) -> Cell:
        """Distance between the two points, in pixels."""
        (x, y), (to_x, to_y) = self.points_px
        return Cell(hypot(to_x - x, to_y - y), self.u_px, "px", self.u_px)

    def on_plane(self, flat: tuple[Point, ...], scale: PlaneScale) -> Cell:
        """Distance in millimetres, `(distance_px + p b) / s`, corrected for the edge bias like a gap."""
        (x, y), (to_x, to_y) = flat
        apart_px = hypot(to_x - x, to_y - y)
        direction = atan2(to_y - y, to_x - x)
        middle = (0.5 * (self.first_px[0] + self.second_px[0]), 0.5 * (self.first_px[1] + self.second_px[1]))
        relative = scale.relative_u(middle, direction)
        edge_px = 2.0 * abs(self.polarity) * scale.u_edge_px(self.u_response_px)
        value_px = apart_px + self.polarity * scale.edge_bias_px
        phase_px = SQRT_2 * scale.u_phase_px
        return _in_mm(scale, value_px, hypot(relative * apart_px, edge_px), self.u_px, phase_px, relative)


@dataclass(frozen=True, slots=True)
class Shift:
    """Displacement of a point along a direction since the first frame.

    Parameters
    ----------
    from_px, to_px : (float, float)
        The point in the first frame, and in the present frame.
    direction_rad : float
        Direction of the displacement: 0 to the right, pi / 2 downwards.
    u_px : float
        Standard uncertainty of the shift, from the registration.
    """

    from_px: Point
    to_px: Point
    direction_rad: float
    u_px: float

    @property
    def points_px(self) -> tuple[Point, ...]:
        """Positions of the followed point in the first frame and in the present frame."""
        return (self.from_px, self.to_px)

    def in_pixels(self) -> Cell:
        """Displacement of the point along the direction, in pixels."""
        x, y = self.to_px[0] - self.from_px[0], self.to_px[1] - self.from_px[1]
        return Cell(x * cos(self.direction_rad) + y * sin(self.direction_rad), self.u_px, "px", self.u_px)

    def on_plane(self, flat: tuple[Point, ...], scale: PlaneScale) -> Cell:
        """Displacement in millimetres; a bias common to both pictures cancels, the sub-pixel phase error does not."""
        (x, y), (to_x, to_y) = flat
        moved_px = (to_x - x) * cos(self.direction_rad) + (to_y - y) * sin(self.direction_rad)
        relative = scale.relative_u(self.from_px, self.direction_rad)
        # In the first frame, the shift is zero by definition and has no uncertainty.
        phase_px = scale.u_phase_px if self.u_px > 0.0 else 0.0
        return _in_mm(scale, moved_px, hypot(relative * moved_px, phase_px), self.u_px, phase_px, relative)


@dataclass(frozen=True, slots=True)
class Angle:
    """Direction of a line, or rotation of an object since the first frame.

    Parameters
    ----------
    point_px : (float, float)
        Middle of the line or object.
    angle_rad : float
        Angle from the x axis towards the y axis, which is clockwise on the screen.
    u_rad : float
        Standard uncertainty from the fit.
    is_turn : bool
        Whether the angle is a rotation since the first frame, rather than a direction.
    """

    point_px: Point
    angle_rad: float
    u_rad: float
    is_turn: bool = False

    @property
    def points_px(self) -> tuple[Point, ...]:
        """Two points along the direction; for a rotation, two more along the x axis."""
        return (*_ends(self.point_px, self.angle_rad), *(_ends(self.point_px, 0.0) if self.is_turn else ()))

    def in_pixels(self) -> Cell:
        """Angle in the picture."""
        return Cell(1e3 * self.angle_rad, 1e3 * self.u_rad, "mrad", 1e3 * self.u_rad)

    def on_plane(self, flat: tuple[Point, ...], scale: PlaneScale) -> Cell:
        """The angle in the object plane, with the same number of full turns as in the picture."""
        found = _between(*flat[:2]) - (_between(*flat[2:]) if self.is_turn else 0.0)
        turned = found - self.angle_rad
        value = self.angle_rad + (turned + pi) % (2.0 * pi) - pi
        shared = scale.u_angle_rad * (abs(sin(self.angle_rad)) if self.is_turn else 1.0)
        u_random = 1e3 * self.u_rad
        return Cell(1e3 * value, hypot(u_random, 1e3 * shared), "mrad", u_random, relative_u=scale.u_angle_rad)


def _in_mm(
    scale: PlaneScale, value_px: float, shared_px: float, u_random_px: float, phase_px: float, relative: float
) -> Cell:
    size, u_px = scale.px_per_mm, hypot(shared_px, u_random_px)
    return Cell(value_px / size, u_px / size, "mm", u_random_px / size, phase_px / size, relative)


def _ends(middle: Point, angle_rad: float) -> tuple[Point, Point]:
    x, y = ANGLE_REACH_PX * cos(angle_rad), ANGLE_REACH_PX * sin(angle_rad)
    return (middle[0] - x, middle[1] - y), (middle[0] + x, middle[1] + y)


def _between(first: Point, second: Point) -> float:
    return atan2(second[1] - first[1], second[0] - first[0])
