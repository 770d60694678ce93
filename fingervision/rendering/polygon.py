"""A solid polygon whose corners may be rounded."""

from collections.abc import Iterable, Sequence
from itertools import combinations, pairwise
from math import acos, atan2, cos, hypot, pi, sin, sqrt, tan

import numpy as np

from fingervision.domain.errors import DataError
from fingervision.rendering.outline import SAME_POINT_PX, Arc, Line, Outline, Piece, bridged

Place = tuple[float, float]
"""A point in the picture: x and y (px)."""

# Outline of the union of several solids; two touching fingers, for example, are one object.


def union(outlines: tuple[Outline, ...]) -> tuple[Outline, ...]:
    """Boundary of the region that lies inside at least one of the outlines.

    Pieces are divided where outlines cross; a part is kept if it does not lie inside another outline.

    Parameters
    ----------
    outlines : tuple of Outline
        Solids without holes. Of coinciding edges only one edge is kept, and no edge if the solids lie on opposite
        sides.

    Returns
    -------
    tuple of Outline
        Solids that do not overlap (and holes, if outlines enclose one). If no solids overlap, the input is returned.
    """
    if not any(_boxes_meet(a, b) for a, b in combinations(outlines, 2)):
        return outlines
    kept: list[Piece] = []
    for i, outline in enumerate(outlines):
        others = {j: other for j, other in enumerate(outlines) if j != i and _boxes_meet(outline, other)}
        parts = [part for piece in outline.pieces for part in _parts(piece, others.values())]
        middles = np.array([part.points(np.array(0.5)) for part in parts])
        hidden = np.zeros(len(parts), dtype=bool)
        for j, other in others.items():
            # On a common edge the winding number depends on rounding; the rule for common edges therefore has priority.
            inside = other.winding(middles) > 0.0
            for k, part in enumerate(parts):
                sense = _shared(part, other)
                hidden[k] |= inside[k] if sense is None else sense < 0.0 or j < i
        kept += [part for part, gone in zip(parts, hidden.tolist(), strict=True) if not gone]
    return _chained(kept)


def _shared(part: Piece, other: Outline) -> float | None:
    """Direction of a piece relative to the edge of another outline on which it lies; None if it lies on no edge.

    Positive: same direction; negative: opposite direction.
    """
    x, y = part.points(np.array(0.5)).tolist()
    for edge in other.pieces:
        if not _may_cross(part, edge) or not _same_track(part, edge):
            continue
        t = _fraction(edge, (x, y))
        if t is not None:
            return cos(edge.heading_rad(t) - part.heading_rad(0.5))
    return None


def _same_track(a: Piece, b: Piece) -> bool:
    """Whether two pieces lie on the same straight line or on the same circle."""
    if isinstance(a, Line) and isinstance(b, Line):
        ux, uy = (a.x1_px - a.x0_px) / a.length_px, (a.y1_px - a.y0_px) / a.length_px
        return all(abs((x - a.x0_px) * uy - (y - a.y0_px) * ux) <= SAME_POINT_PX for x, y in (b.start, b.end))
    if isinstance(a, Arc) and isinstance(b, Arc):
        apart = hypot(a.x_px - b.x_px, a.y_px - b.y_px)
        return apart + abs(abs(a.radius_px) - abs(b.radius_px)) <= SAME_POINT_PX
    return False


def _parts(piece: Piece, others: Iterable[Outline]) -> list[Piece]:
    """Divide a piece where other outlines cross it."""
    cuts = {0.0, 1.0}
    for other in others:
        for edge in other.pieces:
            if _may_cross(piece, edge):
                cuts.update(_crossings(piece, edge))
    places = sorted(cuts)
    if len(places) == 2:
        return [piece]
    return [piece.part(t0, t1) for t0, t1 in pairwise(places) if (t1 - t0) * piece.length_px > SAME_POINT_PX]


def _may_cross(a: Piece, b: Piece) -> bool:
    """Whether two pieces can meet: neither extends further from its start than its length."""
    reach = a.length_px + b.length_px
    return abs(a.start[0] - b.start[0]) <= reach and abs(a.start[1] - b.start[1]) <= reach


def _boxes_meet(a: Outline, b: Outline) -> bool:
    (ax0, ay0, ax1, ay1), (bx0, by0, bx1, by1) = a.box_px, b.box_px
    return ax0 <= bx1 and bx0 <= ax1 and ay0 <= by1 and by0 <= ay1


def _crossings(piece: Piece, edge: Piece) -> list[float]:
    """Fractions of `piece` at which `edge` crosses it."""
    points: Sequence[Place]
    if _same_track(piece, edge):
        points = (edge.start, edge.end)
    elif isinstance(piece, Line) and isinstance(edge, Line):
        return _line_line(piece, edge)
    elif isinstance(piece, Line):
        points = _line_circle(piece, edge)  # type: ignore[arg-type]
    elif isinstance(edge, Line):
        points = _line_circle(edge, piece)
    else:
        points = _circle_circle(piece, edge)
    return [
        t for point in points for t in [_fraction(piece, point)] if t is not None and _fraction(edge, point) is not None
    ]


def _line_line(a: Line, b: Line) -> list[float]:
    ux, uy = a.x1_px - a.x0_px, a.y1_px - a.y0_px
    vx, vy = b.x1_px - b.x0_px, b.y1_px - b.y0_px
    cross = ux * vy - uy * vx
    if abs(cross) <= 1e-12 * a.length_px * b.length_px:
        return []
    wx, wy = b.x0_px - a.x0_px, b.y0_px - a.y0_px
    t, s = (wx * vy - wy * vx) / cross, (wx * uy - wy * ux) / cross
    return [min(max(t, 0.0), 1.0)] if _on(t, a) and _on(s, b) else []


def _on(t: float, piece: Piece) -> bool:
    """Whether a fraction lies on a piece; its ends are included despite rounding, so that no crossing is missed."""
    margin = SAME_POINT_PX / piece.length_px
    return -margin <= t <= 1.0 + margin


def _line_circle(line: Line, arc: Arc) -> list[Place]:
    length = line.length_px
    ux, uy = (line.x1_px - line.x0_px) / length, (line.y1_px - line.y0_px) / length
    wx, wy = arc.x_px - line.x0_px, arc.y_px - line.y0_px
    along, off = wx * ux + wy * uy, wx * uy - wy * ux
    if abs(off) >= abs(arc.radius_px):
        return []
    half = sqrt(arc.radius_px**2 - off**2)
    return [(line.x0_px + s * ux, line.y0_px + s * uy) for s in (along - half, along + half)]


def _circle_circle(a: Arc, b: Arc) -> list[Place]:
    distance = hypot(b.x_px - a.x_px, b.y_px - a.y_px)
    ra, rb = abs(a.radius_px), abs(b.radius_px)
    if distance == 0.0 or not abs(ra - rb) < distance < ra + rb:
        return []
    half_angle = acos((distance**2 + ra**2 - rb**2) / (2 * distance * ra))
    towards = atan2(b.y_px - a.y_px, b.x_px - a.x_px)
    return [
        (
            a.x_px + ra * float(np.cos(towards + side * half_angle)),
            a.y_px + ra * float(np.sin(towards + side * half_angle)),
        )
        for side in (-1.0, 1.0)
    ]


def _fraction(piece: Piece, point: Place) -> float | None:
    """Fraction of the piece at which a point lies; None beyond the piece's ends."""
    x, y = point
    if isinstance(piece, Line):
        ux, uy = piece.x1_px - piece.x0_px, piece.y1_px - piece.y0_px
        t = ((x - piece.x0_px) * ux + (y - piece.y0_px) * uy) / (ux * ux + uy * uy)
    else:
        sense = 1.0 if piece.sweep_rad > 0.0 else -1.0
        flip = pi if piece.radius_px < 0.0 else 0.0
        turned = sense * (atan2(y - piece.y_px, x - piece.x_px) + flip - piece.start_rad) % (2 * pi)
        t = turned / abs(piece.sweep_rad)
        before_start = (turned - 2 * pi) / abs(piece.sweep_rad)
        if not _on(t, piece) and _on(before_start, piece):
            t = before_start
    return min(max(t, 0.0), 1.0) if _on(t, piece) else None


def _chained(pieces: list[Piece]) -> tuple[Outline, ...]:
    """Join unordered pieces to closed curves: each piece is followed by the piece whose start is nearest to its end."""
    left = list(pieces)
    curves = []
    while left:
        chain = [left.pop(0)]
        while True:
            x, y = chain[-1].end
            to_close = hypot(chain[0].start[0] - x, chain[0].start[1] - y)
            distances = [hypot(piece.start[0] - x, piece.start[1] - y) for piece in left]
            if not distances or min(distances) >= to_close:
                break
            chain.append(left.pop(int(np.argmin(distances))))
        curves.append(Outline(bridged(chain)))
    return tuple(curves)


def polygon(corners: tuple[Place, ...], radii_px: tuple[float, ...] | None = None) -> Outline:
    """Solid polygon with rounded corners.

    Parameters
    ----------
    corners : tuple of (x, y)
        Corners in order, clockwise or anticlockwise.
    radii_px : tuple of float, optional
        Radius of each corner; 0 for a sharp corner.

    Returns
    -------
    Outline
        The polygon; each corner's arc is tangent to both of its sides.

    Raises
    ------
    DataError
        If there are fewer than three corners, neighbours coincide, or a radius is negative or does not fit between its
        neighbours.
    """
    if len(corners) < 3:
        raise DataError(f"A polygon must have at least 3 corners, but has {len(corners)}.")
    sides_px = [hypot(x - corners[i - 1][0], y - corners[i - 1][1]) for i, (x, y) in enumerate(corners)]
    if not min(sides_px) > SAME_POINT_PX:
        raise DataError(f"A polygon's sides must have a length, but the shortest has {min(sides_px):.3g} px.")
    radii = (0.0,) * len(corners) if radii_px is None else radii_px
    if not min(radii) >= 0.0:
        raise DataError(f"A corner's radius must be 0 or more, but is {min(radii):g} px.")
    followers = (*corners[1:], corners[0])
    rounded = [
        _rounded(before, corner, after, radius)
        for before, corner, after, radius in zip((corners[-1], *corners), corners, followers, radii, strict=False)
    ]
    pieces: list[Piece] = []
    for (_, arcs, (x0, y0)), ((x1, y1), _, _), corner, follower in zip(
        rounded, rounded[1:] + rounded[:1], corners, followers, strict=True
    ):
        pieces += arcs
        side_x, side_y = follower[0] - corner[0], follower[1] - corner[1]
        along = ((x1 - x0) * side_x + (y1 - y0) * side_y) / hypot(side_x, side_y)
        if along < -SAME_POINT_PX:
            raise DataError(
                f"The corners' radii must fit on the side between them, but overlap by {-along:.3g} px: "
                "choose smaller radii (at most half the width)."
            )
        if along > SAME_POINT_PX:
            pieces.append(Line(x0, y0, x1, y1))
    outline = Outline(tuple(pieces))
    return outline if outline.area_px2 > 0.0 else outline.backwards()


def _rounded(before: Place, corner: Place, after: Place, radius_px: float) -> tuple[Place, list[Arc], Place]:
    """Where the rounding of a corner begins, its arc (none for a sharp corner), and where it ends."""
    x, y = corner
    arrive = atan2(y - before[1], x - before[0])
    turn = (atan2(after[1] - y, after[0] - x) - arrive + pi) % (2 * pi) - pi
    reach = radius_px * tan(abs(turn) / 2)
    entry = (x - reach * cos(arrive), y - reach * sin(arrive))
    leave = (x + reach * cos(arrive + turn), y + reach * sin(arrive + turn))
    if radius_px == 0.0 or turn == 0.0:
        return entry, [], leave
    side = 1.0 if turn > 0.0 else -1.0
    centre = (entry[0] - side * radius_px * sin(arrive), entry[1] + side * radius_px * cos(arrive))
    return entry, [Arc(*centre, radius_px, arrive - side * pi / 2, turn)], leave
