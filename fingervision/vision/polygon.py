"""A finger's end as a convex chain of straight sides with rounded corners: positions of its tip and inner edge."""

from math import cos, pi, sin, sqrt, tan
from typing import NamedTuple

# Least and largest change of direction between neighbouring sides (radians) of a convex chain.
LEAST_TURN, MOST_TURN = 0.03, 2.6
# Largest overlap of a side's two tangent points (pixels), which allows for errors of the radii.
OVERLAP_PX = 0.5


class Side(NamedTuple):
    """A straight side: a point on it, and the direction in which the chain passes it (radians, from x to y).

    x runs inwards across the finger, y towards the finger's root; the chain runs up the outer flank and down the inner
    flank.
    """

    x: float
    y: float
    angle: float

    def moved(self, px: float, radians: float) -> "Side":
        """Return the side displaced outwards by a distance, and rotated about the point by which it is given."""
        x, y = self.x + px * sin(self.angle), self.y - px * cos(self.angle)
        return Side(x, y, self.angle + radians)


class ReadOff(NamedTuple):
    """Result for a chain of sides: height of the tip, its position across, inner edge, and slope of the edge."""

    tip: float
    apex: float
    edge: float
    slope: float


class Corner(NamedTuple):
    """Corner of two sides: its vertex, the direction from the vertex into the finger, and the change of direction."""

    vertex: tuple[float, float]
    inwards: tuple[float, float]
    turn: float


class Polygon(NamedTuple):
    """Sides from the outer to the inner flank, radius of the corner after each side, and index of a level top side."""

    sides: list[Side]
    radii: list[float]
    level: int | None

    def corners(self) -> list[Corner] | None:
        """Corners between the sides; None if the chain is not convex."""
        found = []
        for one, two in zip(self.sides, self.sides[1:], strict=False):
            turn = (two.angle - one.angle + pi) % (2.0 * pi) - pi
            if not LEAST_TURN < turn < MOST_TURN:
                return None
            dx, dy = two.x - one.x, two.y - one.y
            way = (dx * sin(two.angle) - dy * cos(two.angle)) / sin(turn)
            vertex = one.x + way * cos(one.angle), one.y + way * sin(one.angle)
            middle = one.angle + 0.5 * turn
            found.append(Corner(vertex, (-sin(middle), cos(middle)), turn))
        return found

    def is_chain(self) -> bool:
        """Whether the chain is convex, and every side long enough for the fillets at its ends."""
        corners = self.corners()
        return corners is not None and _Ends.of(self.sides, corners, self.radii) is not None

    def read_off(self, below_tip_px: float) -> ReadOff | None:
        """Tip, and inner edge at the measuring height below the tip; None if the chain does not determine them."""
        corners = self.corners()
        if corners is None:
            return None
        ends = _Ends.of(self.sides, corners, self.radii)
        if ends is None:
            return None
        tip = self._tip(ends)
        if tip is None:
            return None
        height, apex, first = tip
        edge = self._edge(ends, height + below_tip_px, first)
        return None if edge is None else ReadOff(height, apex, *edge)

    def _tip(self, ends: "_Ends") -> tuple[float, float, int] | None:
        """Height of the tip, its position across, and the side where the inner edge begins."""
        if self.level is not None:
            (x0, y0), (x1, y1) = ends.first[self.level], ends.last[self.level]
            return 0.5 * (y0 + y1), 0.5 * (x0 + x1), self.level
        for k, (one, two) in enumerate(zip(self.sides, self.sides[1:], strict=False)):
            if sin(one.angle) <= 0.0 < sin(two.angle):
                x, y = ends.centres[k]
                return y - self.radii[k], x, k
        return None

    def _edge(self, ends: "_Ends", height: float, first: int) -> tuple[float, float] | None:
        """Position and slope of the inner side at a height."""
        for k in range(first, len(self.sides)):
            side, (_, y0), (_, y1) = self.sides[k], ends.first[k], ends.last[k]
            rise = sin(side.angle)
            if rise > 0.0 and y0 <= height <= y1:
                slope = cos(side.angle) / rise
                return side.x + slope * (height - side.y), slope
            if k < len(self.radii) and y1 < height < ends.first[k + 1][1]:
                x, y = ends.centres[k]
                up = height - y
                wide = sqrt(max(self.radii[k] ** 2 - up**2, 1e-12))
                return x + wide, -up / wide
        return None


class _Ends(NamedTuple):
    """End points of every side between the fillets of its corners, and the centres of the fillets."""

    first: list[tuple[float, float]]
    last: list[tuple[float, float]]
    centres: list[tuple[float, float]]

    @classmethod
    def of(cls, sides: list[Side], corners: list[Corner], radii: list[float]) -> "_Ends | None":
        """Compute end points from sides, corners and radii; None if two fillets overlap."""
        first, last, centres = [], [], []
        for k, side in enumerate(sides):
            c, s = cos(side.angle), sin(side.angle)
            begin = (side.x - 1e5 * c, side.y - 1e5 * s)
            end = (side.x + 1e5 * c, side.y + 1e5 * s)
            if k > 0:
                (x, y), _, turn = corners[k - 1]
                way = radii[k - 1] * tan(0.5 * turn)
                begin = (x + way * c, y + way * s)
            if k < len(corners):
                (x, y), (nx, ny), turn = corners[k]
                way = radii[k] * tan(0.5 * turn)
                end = (x - way * c, y - way * s)
                centres.append((x + nx * radii[k] / cos(0.5 * turn), y + ny * radii[k] / cos(0.5 * turn)))
            if (end[0] - begin[0]) * c + (end[1] - begin[1]) * s < -OVERLAP_PX:
                return None
            first.append(begin)
            last.append(end)
        return cls(first, last, centres)
