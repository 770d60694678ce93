"""Objects of known size for calibration: bars, slots, discs, chessboards."""

from math import radians

from fingervision.domain.errors import DataError
from fingervision.rendering.outline import Motion, Outline, disc
from fingervision.rendering.polygon import polygon

__all__ = ["bar", "chessboard", "disc", "slot"]

# A plate that extends beyond the frame ends at this distance outside.
BEYOND_FRAME_PX = 200.0


def bar(size_px: float, length_px: float, *, x_px: float, y_px: float, turn_deg: float = 0.0) -> tuple[Outline]:
    """Bar or pin: a rectangle `size_px` wide and `length_px` long about (x, y).

    Parameters
    ----------
    size_px : float
        The known size (width); along x if `turn_deg` is 0.
    length_px : float
        Length of the bar.
    x_px, y_px : float
        Middle of the bar.
    turn_deg : float
        Rotation about the middle, from x towards y.

    Returns
    -------
    tuple of Outline
        One solid.
    """
    _must_be_positive(size_px=size_px, length_px=length_px)
    across, along = size_px / 2, length_px / 2
    shape = polygon(((-across, -along), (across, -along), (across, along), (-across, along)))
    return (shape.moved(Motion.turn(radians(turn_deg))).moved(Motion(x_px=x_px, y_px=y_px)),)


def slot(
    size_px: float,
    length_px: float,
    *,
    x_px: float,
    y_px: float,
    turn_deg: float = 0.0,
    frame: tuple[int, int] = (640, 480),
) -> tuple[Outline, Outline]:
    """Slot in a plate that fills the frame: parameters as in `bar`; `frame` is the frame's width and height.

    Returns
    -------
    tuple of Outline
        The plate and the hole in it.
    """
    (hole,) = bar(size_px, length_px, x_px=x_px, y_px=y_px, turn_deg=turn_deg)
    left = top = -BEYOND_FRAME_PX
    right, low = frame[0] + BEYOND_FRAME_PX, frame[1] + BEYOND_FRAME_PX
    least_x, least_y, greatest_x, greatest_y = hole.box_px
    if least_x <= left or least_y <= top or greatest_x >= right or greatest_y >= low:
        raise DataError(
            f"A slot must lie inside its plate, which ends {BEYOND_FRAME_PX:g} px beyond the frame, but reaches from "
            f"({least_x:g}, {least_y:g}) to ({greatest_x:g}, {greatest_y:g}): choose a shorter slot."
        )
    return polygon(((left, top), (right, top), (right, low), (left, low))), hole.backwards()


def chessboard(
    corners: tuple[int, int], square_px: float, *, x_px: float, y_px: float, turn_deg: float = 0.0
) -> tuple[Outline, ...]:
    """Dark squares of a chessboard pattern.

    Parameters
    ----------
    corners : (int, int)
        Number of inner corners along x and y: (9, 6) is a board of 10 x 7 squares.
    square_px : float
        Side of a square.
    x_px, y_px : float
        Middle of the board.
    turn_deg : float
        Rotation about the middle, from x towards y.

    Returns
    -------
    tuple of Outline
        One solid per dark square; the first square, with the smallest x and y before the rotation, is dark.
    """
    _must_be_positive(corners_x=corners[0], corners_y=corners[1], square_px=square_px)
    columns, rows = corners[0] + 1, corners[1] + 1
    board = Motion.turn(radians(turn_deg))
    squares = []
    for row in range(rows):
        for column in range(row % 2, columns, 2):
            left, top = (column - columns / 2) * square_px, (row - rows / 2) * square_px
            right, low = left + square_px, top + square_px
            square = polygon(((left, top), (right, top), (right, low), (left, low)))
            squares.append(square.moved(board).moved(Motion(x_px=x_px, y_px=y_px)))
    return tuple(squares)


def _must_be_positive(**sizes: float) -> None:
    for name, size in sizes.items():
        if not size > 0.0:
            raise DataError(f"{name} must be positive, but is {size:g}.")
