"""A closed curve of straight lines and circular arcs: the exact geometry of every rendered object.

The direction of a solid's curve is such that its area, the integral of x dy, is positive; a hole's curve has the
opposite direction.
"""

from dataclasses import dataclass
from math import hypot, pi, sin, tan

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError
from fingervision.rendering.arc import Arc
from fingervision.rendering.line import Line
from fingervision.rendering.plane import SAME_POINT_PX, Motion, Points

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
                msg = (
                    f"An outline must be closed, but a piece ends {hole_px:.3g} px away from the start of the next "
                    "piece: "
                    "give the pieces in their order along the outline."
                )
                raise DataError(msg)

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
        msg = f"radius_px of a disc must be positive, but is {radius_px:g}."
        raise DataError(msg)
    return Outline((Arc(x_px, y_px, radius_px, 0.0, 2 * pi),))
