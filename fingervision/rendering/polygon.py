"""A solid polygon whose corners may be rounded."""

from math import atan2, cos, hypot, pi, sin, tan

from fingervision.domain.errors import DataError
from fingervision.rendering.arc import Arc
from fingervision.rendering.line import Line
from fingervision.rendering.outline import Outline, Piece
from fingervision.rendering.plane import SAME_POINT_PX


def polygon(corners: tuple[tuple[float, float], ...], radii_px: tuple[float, ...] | None = None) -> Outline:
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
        msg = f"A polygon must have at least 3 corners, but has {len(corners)}."
        raise DataError(msg)
    sides_px = [hypot(x - corners[i - 1][0], y - corners[i - 1][1]) for i, (x, y) in enumerate(corners)]
    if not min(sides_px) > SAME_POINT_PX:
        msg = f"A polygon's sides must have a length, but the shortest has {min(sides_px):.3g} px."
        raise DataError(msg)
    radii = (0.0,) * len(corners) if radii_px is None else radii_px
    if not min(radii) >= 0.0:
        msg = f"A corner's radius must be 0 or more, but is {min(radii):g} px."
        raise DataError(msg)
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
            raise DataError(msg)
        if along > SAME_POINT_PX:
            pieces.append(Line(x0, y0, x1, y1))
    outline = Outline(tuple(pieces))
    return outline if outline.area_px2 > 0.0 else outline.backwards()
