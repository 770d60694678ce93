"""A closed curve of straight lines and circular arcs: the exact geometry of every rendered object.

The direction of a solid's curve is such that its area, the integral of x dy, is positive; a hole's curve has the
opposite direction.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import atan2, ceil, cos, floor, hypot, pi, sin, sqrt, tan

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fingervision.domain.errors import DataError

# The picture plane: its points and rigid motions.


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

    def before(self, points: Points | tuple[float, float]) -> Points:
        """Points, shape (..., 2), before this motion, which has no shift."""
        return np.asarray(points @ np.array([[self.xx, self.xy], [self.yx, self.yy]]))


# A straight piece of an outline.


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

    def points(self, t: ArrayLike) -> Points:
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


# A circular arc, as a piece of an outline.


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

    def points(self, t: ArrayLike) -> Points:
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


Piece = Line | Arc


@dataclass(frozen=True, slots=True)
class Outline:
    """A closed curve; each piece begins where the previous one ends.

    Parameters
    ----------
    pieces : tuple of Line or Arc
        Pieces in order.

    Raises
    ------
    FingervisionError
        If the curve is not closed.
    """

    pieces: tuple[Piece, ...]

    def __post_init__(self) -> None:
        for piece, follower in zip(self.pieces, self.pieces[1:] + self.pieces[:1], strict=True):
            hole_px = hypot(follower.start[0] - piece.end[0], follower.start[1] - piece.end[1])
            if hole_px > SAME_POINT_PX:
                raise DataError(
                    f"An outline must be closed, but a piece ends {hole_px:.3g} px away from the start of the next "
                    "piece: "
                    "give the pieces in their order along the outline."
                )

    @property
    def area_px2(self) -> float:
        """Signed area: positive for a solid, negative for a hole."""
        total = 0.0
        for piece in self.pieces:
            (x0, y0), (x1, y1) = piece.start, piece.end
            total += (x0 * y1 - x1 * y0) / 2
            if isinstance(piece, Arc):
                total += piece.radius_px**2 * (piece.sweep_rad - sin(piece.sweep_rad)) / 2
        return total

    @property
    def box_px(self) -> tuple[float, float, float, float]:
        """Bounding box of the curve: smallest x, smallest y, largest x, largest y."""
        boxes = [piece.box_px for piece in self.pieces]
        least_x, least_y, greatest_x, greatest_y = zip(*boxes, strict=True)
        return (min(least_x), min(least_y), max(greatest_x), max(greatest_y))

    def backwards(self) -> "Outline":
        """Reverse the direction of the curve: a solid becomes a hole."""
        return Outline(tuple(piece.backwards() for piece in reversed(self.pieces)))

    def moved(self, motion: Motion) -> "Outline":
        """Return the curve after a rigid motion; a reflection also reverses its direction, to keep solids solid."""
        moved = tuple(piece.moved(motion) for piece in self.pieces)
        return Outline(tuple(piece.backwards() for piece in reversed(moved))) if motion.mirrors else Outline(moved)

    def grown(self, by_px: float) -> "Outline":
        """Offset every edge parallel to itself by `by_px` outwards (negative: inwards).

        If the offset opens a corner, an arc about the corner is inserted; if the offset edges intersect, they are cut
        at the intersection. If nothing remains, the outline has no pieces.
        """
        if by_px == 0.0:
            return self
        turns = [
            (follower.heading_rad(0.0) - piece.heading_rad(1.0) + pi) % (2 * pi) - pi
            for piece, follower in zip(self.pieces, self.pieces[1:] + self.pieces[:1], strict=True)
        ]
        cuts_px = [max(0.0, -by_px * tan(turn / 2)) for turn in turns]
        if self._vanishes(by_px, turns, cuts_px):
            return Outline(())
        grown: list[Piece] = []
        for i, piece in enumerate(self.pieces):
            moved = piece.grown(by_px)
            if cuts_px[i - 1] + cuts_px[i] < moved.length_px:
                grown.append(moved.part(cuts_px[i - 1] / moved.length_px, 1.0 - cuts_px[i] / moved.length_px))
            if by_px * turns[i] > SAME_POINT_PX:
                x, y = piece.end
                outwards = piece.heading_rad(1.0) - pi / 2
                grown.append(Arc(x, y, by_px, outwards, turns[i]))
        return Outline(bridged(grown))

    def _vanishes(self, by_px: float, turns: list[float], cuts_px: list[float]) -> bool:
        """Whether an offset makes two sides meet: pieces vanish that together turn by 180 degrees or more."""
        used = []
        for i, piece in enumerate(self.pieces):
            if isinstance(piece, Arc):
                used.append(by_px * piece.sweep_rad < 0.0 and piece.radius_px <= abs(by_px))
            else:
                used.append(cuts_px[i - 1] + cuts_px[i] >= piece.length_px)
        if not any(used):
            return False
        if all(used):
            return True
        first = used.index(False)
        turned = 0.0
        for i in range(first - len(used), first):
            if not used[i]:
                turned = turns[i]
                continue
            piece = self.pieces[i]
            turned += turns[i] + (piece.sweep_rad if isinstance(piece, Arc) else 0.0)
            # The tolerance of a billionth allows for rounding.
            if -by_px * turned > 0.0 and abs(turned) > pi * (1.0 - 1e-9):
                return True
        return False

    def winding(self, points: Points) -> NDArray[np.float64]:
        """Winding number of the curve about each point: 1 inside a solid, 0 outside; shape (n,).

        The winding number is the sum of the angles that the pieces' chords subtend at the point, plus a full turn for
        each arc that has the point between itself and its chord.
        """
        x, y = points[..., 0], points[..., 1]
        angle = np.zeros(x.shape)
        least_x, least_y, greatest_x, greatest_y = self.box_px
        if not ((x >= least_x) & (x <= greatest_x) & (y >= least_y) & (y <= greatest_y)).any():
            return angle
        for whole in self.pieces:
            for piece in _short(whole):
                (x0, y0), (x1, y1) = piece.start, piece.end
                cross = (x0 - x) * (y1 - y) - (x1 - x) * (y0 - y)
                dot = (x0 - x) * (x1 - x) + (y0 - y) * (y1 - y)
                angle += np.arctan2(cross, dot)
                if isinstance(piece, Arc):
                    sense = 1.0 if piece.sweep_rad > 0.0 else -1.0
                    in_circle = (x - piece.x_px) ** 2 + (y - piece.y_px) ** 2 < piece.radius_px**2
                    angle += 2 * pi * sense * (in_circle & (sense * cross < 0.0))
        return np.round(angle / (2 * pi))


def _short(piece: Piece) -> tuple[Piece, ...]:
    """Divide arcs into parts of at most a quarter turn, so that each lies on one side of its chord."""
    if isinstance(piece, Line):
        return (piece,)
    count = max(1, int(np.ceil(abs(piece.sweep_rad) / (pi / 2))))
    return tuple(piece.part(i / count, (i + 1) / count) for i in range(count))


def bridged(pieces: list[Piece]) -> tuple[Piece, ...]:
    """Close the gaps between neighbouring pieces by straight lines."""
    closed: list[Piece] = []
    for piece, follower in zip(pieces, pieces[1:] + pieces[:1], strict=True):
        closed.append(piece)
        if hypot(follower.start[0] - piece.end[0], follower.start[1] - piece.end[1]) > SAME_POINT_PX:
            closed.append(Line(*piece.end, *follower.start))
    return tuple(closed)


def disc(x_px: float, y_px: float, radius_px: float) -> Outline:
    """Solid disc about (x, y).

    Raises
    ------
    DataError
        If the radius is not positive.
    """
    if not radius_px > 0.0:
        raise DataError(f"radius_px of a disc must be positive, but is {radius_px:g}.")
    return Outline((Arc(x_px, y_px, radius_px, 0.0, 2 * pi),))


# Approximation of a smooth curve by circular arcs: two between each pair of points, with a common tangent.


# An arc that deviates less than this from its chord becomes a line, because its centre would be too far away for the
# precision of the computation.
STRAIGHT_PX = 2e-8


def biarcs(points: Points, tangents: Points) -> tuple[Piece, ...]:
    """Lines and arcs through the points with the given directions of travel.

    Parameters
    ----------
    points, tangents : ndarray of float, shape (n, 2)
        Points of the curve, and vectors along it there, of any length.

    Returns
    -------
    tuple of Line or Arc
        Two pieces for each pair of neighbours.
    """
    pieces: list[Piece] = []
    knots = []
    for (x, y), (tx, ty) in zip(points.tolist(), tangents.tolist(), strict=True):
        size = hypot(tx, ty)
        knots.append((x, y, tx / size, ty / size))
    for (x0, y0, tx0, ty0), (x1, y1, tx1, ty1) in pairwise(knots):
        # The tangents of the two ends meet in the joint if each is followed over the length d, which solves
        # |chord|^2 - 2 d chord . (t0 + t1) - 2 d^2 (1 - t0 . t1) = 0.
        chord_x, chord_y = x1 - x0, y1 - y0
        a = 2 * (1 - (tx0 * tx1 + ty0 * ty1))
        b = 2 * (chord_x * (tx0 + tx1) + chord_y * (ty0 + ty1))
        c = chord_x * chord_x + chord_y * chord_y
        d = 2 * c / (b + sqrt(b * b + 4 * a * c))
        joint = ((x0 + d * tx0 + x1 - d * tx1) / 2, (y0 + d * ty0 + y1 - d * ty1) / 2)
        pieces.append(_arc((x0, y0), joint, (tx0, ty0)))
        pieces.append(_arc((x1, y1), joint, (-tx1, -ty1)).backwards())
    return tuple(pieces)


def _arc(start: tuple[float, float], end: tuple[float, float], tangent: tuple[float, float]) -> Piece:
    """Return the arc that starts at `start` in the direction of the unit vector `tangent` and ends at `end`."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    aside = tangent[0] * dy - tangent[1] * dx
    if abs(aside) < 4 * STRAIGHT_PX:
        return Line(*start, *end)
    radius = (dx * dx + dy * dy) / (2 * aside)
    x, y = start[0] - radius * tangent[1], start[1] + radius * tangent[0]
    first, last = atan2(start[1] - y, start[0] - x), atan2(end[1] - y, end[0] - x)
    return Arc(x, y, abs(radius), first, (last - first + pi) % (2 * pi) - pi)
