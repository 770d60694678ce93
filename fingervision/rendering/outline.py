"""A closed curve of straight lines and circular arcs: the geometric truth of everything that is drawn.

Coordinates are those of the picture: x right, y down, the centre of the first pixel is (0, 0), lengths in pixels.
A curve runs so that its area, the integral of x dy, is positive; a hole runs the other way.
"""

from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin, tan

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError

Points = NDArray[np.float64]
"""Points in the picture, shape (..., 2): x and y."""

# Ends that are nearer than this are the same point: far below every tolerance, far above rounding at 4K.
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
        """Turn about the origin, from x towards y (clockwise to the eye, because y points down)."""
        return Motion(cos(angle_rad), -sin(angle_rad), sin(angle_rad), cos(angle_rad))

    @property
    def mirrors(self) -> bool:
        """Whether left and right hands are exchanged."""
        return self.xx * self.yy - self.xy * self.yx < 0.0

    def place(self, x_px: float, y_px: float) -> tuple[float, float]:
        """Where a point comes to lie."""
        return (self.xx * x_px + self.xy * y_px + self.x_px, self.yx * x_px + self.yy * y_px + self.y_px)


@dataclass(frozen=True, slots=True)
class Line:
    """A straight piece from (x0, y0) to (x1, y1)."""

    x0_px: float
    y0_px: float
    x1_px: float
    y1_px: float

    @property
    def start(self) -> tuple[float, float]:
        """First point."""
        return (self.x0_px, self.y0_px)

    @property
    def end(self) -> tuple[float, float]:
        """Last point."""
        return (self.x1_px, self.y1_px)

    @property
    def length_px(self) -> float:
        """Length."""
        return hypot(self.x1_px - self.x0_px, self.y1_px - self.y0_px)

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
        """Cut out the piece between two fractions of the length."""
        (x0, y0), (x1, y1) = self.points(np.array([t0, t1])).tolist()
        return Line(x0, y0, x1, y1)

    def backwards(self) -> "Line":
        """Run the same piece from its end."""
        return Line(self.x1_px, self.y1_px, self.x0_px, self.y0_px)

    def moved(self, motion: Motion) -> "Line":
        """Place the piece by a rigid motion."""
        return Line(*motion.place(*self.start), *motion.place(*self.end))

    def grown(self, by_px: float) -> "Line":
        """Shift the piece parallel to itself, `by_px` further out than its outline now lies."""
        heading = self.heading_rad(0.0)
        out_x, out_y = by_px * sin(heading), -by_px * cos(heading)
        return Line(self.x0_px + out_x, self.y0_px + out_y, self.x1_px + out_x, self.y1_px + out_y)


@dataclass(frozen=True, slots=True)
class Arc:
    """A circular piece about (x, y), from the angle `start_rad` on by `sweep_rad` (positive from x towards y)."""

    x_px: float
    y_px: float
    radius_px: float
    start_rad: float
    sweep_rad: float

    @property
    def start(self) -> tuple[float, float]:
        """First point."""
        return self._at(0.0)

    @property
    def end(self) -> tuple[float, float]:
        """Last point."""
        return self._at(1.0)

    def _at(self, t: float) -> tuple[float, float]:
        angle = self.start_rad + t * self.sweep_rad
        return (self.x_px + self.radius_px * cos(angle), self.y_px + self.radius_px * sin(angle))

    @property
    def length_px(self) -> float:
        """Length along the arc."""
        return abs(self.radius_px * self.sweep_rad)

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
        """Cut out the piece between two fractions of the length."""
        start = self.start_rad + t0 * self.sweep_rad
        return Arc(self.x_px, self.y_px, self.radius_px, start, (t1 - t0) * self.sweep_rad)

    def backwards(self) -> "Arc":
        """Run the same piece from its end."""
        return Arc(self.x_px, self.y_px, self.radius_px, self.start_rad + self.sweep_rad, -self.sweep_rad)

    def moved(self, motion: Motion) -> "Arc":
        """Place the piece by a rigid motion."""
        x, y = motion.place(self.x_px, self.y_px)
        first_x, first_y = motion.place(*self.start)
        sweep = -self.sweep_rad if motion.mirrors else self.sweep_rad
        return Arc(x, y, self.radius_px, atan2(first_y - y, first_x - x), sweep)

    def grown(self, by_px: float) -> "Arc":
        """Shift the piece parallel to itself, `by_px` further out than its outline now lies."""
        outwards = 1.0 if self.sweep_rad >= 0.0 else -1.0
        return Arc(self.x_px, self.y_px, self.radius_px + outwards * by_px, self.start_rad, self.sweep_rad)


Piece = Line | Arc


@dataclass(frozen=True, slots=True)
class Outline:
    """A closed curve; each piece begins where the one before ends.

    Parameters
    ----------
    pieces : tuple of Line or Arc
        In the order of travel.

    Raises
    ------
    FingervisionError
        The pieces leave a hole in the curve.
    """

    pieces: tuple[Piece, ...]

    def __post_init__(self) -> None:
        for piece, follower in zip(self.pieces, self.pieces[1:] + self.pieces[:1], strict=True):
            hole_px = hypot(follower.start[0] - piece.end[0], follower.start[1] - piece.end[1])
            if hole_px > SAME_POINT_PX:
                msg = (
                    f"An outline must be closed, but a piece ends {hole_px:.3g} px away from the start of the next: "
                    "give the pieces in the order of travel."
                )
                raise FingervisionError(msg)

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
        """A rectangle that holds the curve: least x, least y, greatest x, greatest y."""
        x: list[float] = []
        y: list[float] = []
        for piece in self.pieces:
            if isinstance(piece, Line):
                x += [piece.x0_px, piece.x1_px]
                y += [piece.y0_px, piece.y1_px]
            else:
                reach = abs(piece.radius_px)
                x += [piece.x_px - reach, piece.x_px + reach]
                y += [piece.y_px - reach, piece.y_px + reach]
        return (min(x), min(y), max(x), max(y))

    def backwards(self) -> "Outline":
        """Run the curve the other way: a solid becomes a hole."""
        return Outline(tuple(piece.backwards() for piece in reversed(self.pieces)))

    def moved(self, motion: Motion) -> "Outline":
        """Place the curve by a rigid motion; a solid stays a solid."""
        moved = tuple(piece.moved(motion) for piece in self.pieces)
        return Outline(tuple(piece.backwards() for piece in reversed(moved))) if motion.mirrors else Outline(moved)

    def grown(self, by_px: float) -> "Outline":
        """Shift every edge parallel to itself, `by_px` further out (negative: further in).

        Corners that open are closed by an arc about the corner, corners that close are cut where the parallels meet.
        """
        if by_px == 0.0:
            return self
        turns = [
            (follower.heading_rad(0.0) - piece.heading_rad(1.0) + pi) % (2 * pi) - pi
            for piece, follower in zip(self.pieces, self.pieces[1:] + self.pieces[:1], strict=True)
        ]
        grown: list[Piece] = []
        for i, piece in enumerate(self.pieces):
            moved = piece.grown(by_px)
            if moved.length_px <= SAME_POINT_PX:
                continue
            cut_start = max(0.0, -by_px * tan(turns[i - 1] / 2)) / moved.length_px
            cut_end = max(0.0, -by_px * tan(turns[i] / 2)) / moved.length_px
            if cut_start + cut_end < 1.0:
                grown.append(moved.part(cut_start, 1.0 - cut_end))
            if by_px * turns[i] > 0.0:
                x, y = piece.end
                outwards = piece.heading_rad(1.0) - pi / 2
                grown.append(Arc(x, y, by_px, outwards, turns[i]))
        return Outline(bridged(grown))

    def winding(self, points: Points) -> NDArray[np.float64]:
        """How often the curve runs round each point: 1 inside a solid, 0 outside; shape (n,).

        The sum of the angles that the pieces' chords subtend, and a full turn for each arc that bulges past the point.
        """
        x, y = points[..., 0], points[..., 1]
        angle = np.zeros(x.shape)
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
    """Arcs in parts of at most a quarter turn, so that each lies on one side of its chord."""
    if isinstance(piece, Line):
        return (piece,)
    count = max(1, int(np.ceil(abs(piece.sweep_rad) / (pi / 2))))
    return tuple(piece.part(i / count, (i + 1) / count) for i in range(count))


def bridged(pieces: list[Piece]) -> tuple[Piece, ...]:
    """Close what is left open between neighbours by straight lines."""
    closed: list[Piece] = []
    for piece, follower in zip(pieces, pieces[1:] + pieces[:1], strict=True):
        closed.append(piece)
        if hypot(follower.start[0] - piece.end[0], follower.start[1] - piece.end[1]) > SAME_POINT_PX:
            closed.append(Line(*piece.end, *follower.start))
    return tuple(closed)


def polygon(corners: tuple[tuple[float, float], ...], radii_px: tuple[float, ...] | None = None) -> Outline:
    """Solid polygon with rounded corners.

    Parameters
    ----------
    corners : tuple of (x, y)
        Corners in order, either sense.
    radii_px : tuple of float, optional
        Radius of each corner; sharp where 0.

    Returns
    -------
    Outline
        Each corner's arc touches both of its sides.

    Raises
    ------
    FingervisionError
        A radius is negative or does not fit between its neighbours.
    """
    radii = (0.0,) * len(corners) if radii_px is None else radii_px
    if min(radii) < 0.0:
        msg = f"A corner's radius must be 0 or more, but is {min(radii):g} px."
        raise FingervisionError(msg)
    pieces: list[Piece] = []
    entries: list[tuple[float, float]] = []
    arcs: list[Arc | None] = []
    exits: list[tuple[float, float]] = []
    for i, (x, y) in enumerate(corners):
        before, after = corners[i - 1], corners[(i + 1) % len(corners)]
        arrive = atan2(y - before[1], x - before[0])
        turn = (atan2(after[1] - y, after[0] - x) - arrive + pi) % (2 * pi) - pi
        reach = radii[i] * tan(abs(turn) / 2)
        side = 1.0 if turn > 0.0 else -1.0
        entry = (x - reach * cos(arrive), y - reach * sin(arrive))
        leave = (x + reach * cos(arrive + turn), y + reach * sin(arrive + turn))
        entries.append(entry)
        exits.append(leave)
        if radii[i] > 0.0 and turn != 0.0:
            centre_x = entry[0] - side * radii[i] * sin(arrive)
            centre_y = entry[1] + side * radii[i] * cos(arrive)
            arcs.append(Arc(centre_x, centre_y, radii[i], arrive - side * pi / 2, turn))
        else:
            arcs.append(None)
    for i, arc in enumerate(arcs):
        follower = (i + 1) % len(corners)
        if arc is not None:
            pieces.append(arc)
        (x0, y0), (x1, y1) = exits[i], entries[follower]
        side_x, side_y = corners[follower][0] - corners[i][0], corners[follower][1] - corners[i][1]
        along = ((x1 - x0) * side_x + (y1 - y0) * side_y) / hypot(side_x, side_y)
        if along < -SAME_POINT_PX:
            msg = (
                f"The corners' radii must fit on the side between them, but overlap by {-along:.3g} px: "
                "choose smaller radii (at most half the width)."
            )
            raise FingervisionError(msg)
        if along > SAME_POINT_PX:
            pieces.append(Line(x0, y0, x1, y1))
    outline = Outline(tuple(pieces))
    return outline if outline.area_px2 > 0.0 else outline.backwards()


def disc(x_px: float, y_px: float, radius_px: float) -> Outline:
    """Solid disc about (x, y)."""
    return Outline((Arc(x_px, y_px, radius_px, 0.0, 2 * pi),))
