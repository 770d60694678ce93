"""One finger: a bar with a tip of a given shape, placed along an image axis and tilted."""

from dataclasses import dataclass
from itertools import pairwise
from math import atan2, cos, hypot, pi, radians, sin, tan

from fingervision.domain.direction import Direction
from fingervision.domain.errors import FingervisionError
from fingervision.rendering.outline import Arc, Line, Motion, Outline, Piece, polygon

# A half ellipse is drawn as this many circular arcs; they, not the ellipse, are the truth (they differ by 1e-4 px).
ELLIPSE_ARCS = 48


@dataclass(frozen=True, slots=True)
class SquareTip:
    """Flat tip with equal corners.

    Parameters
    ----------
    radius_px : float
        Radius of both corners: 0 is sharp, half the finger's width a half circle.
    slant_deg : float
        Slant of the flat; positive if the finger is longer on the side of the greater coordinate across.
    """

    radius_px: float = 0.0
    slant_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class EllipticTip:
    """Half an ellipse across the finger's width.

    Parameters
    ----------
    height_px : float
        Semi-axis along the finger.
    """

    height_px: float


Tip = SquareTip | EllipticTip


@dataclass(frozen=True, slots=True)
class Finger:
    """A finger as a closed outline.

    Parameters
    ----------
    outline : Outline
        Where it lies in the ideal picture.
    direction : Direction
        The image axis in which it points.
    """

    outline: Outline
    direction: Direction


def axis_motion(direction: Direction) -> Motion:
    """From (across, towards the root) to (x, y): across is x to the right or y downwards."""
    match direction:
        case Direction.UP:
            return Motion()
        case Direction.DOWN:
            return Motion(yy=-1.0)
        case Direction.LEFT:
            return Motion(0.0, 1.0, 1.0, 0.0)
        case Direction.RIGHT:
            return Motion(0.0, -1.0, 1.0, 0.0)


def finger_shape(width_px: float, length_px: float, tip: Tip, tilt_deg: float = 0.0) -> Outline:
    """Outline of a finger in its own coordinates: x across, y towards the root, the untilted tip's middle at (0, 0).

    Parameters
    ----------
    width_px, length_px : float
        Width, and length from tip to root.
    tip : SquareTip or EllipticTip
        Shape of the tip.
    tilt_deg : float
        Tilt about the tip; positive if the tip leans towards the greater coordinate across.

    Returns
    -------
    Outline
        The whole finger, its root square.

    Raises
    ------
    FingervisionError
        The tip does not fit on the finger.
    """
    half = width_px / 2
    if width_px <= 0.0 or length_px <= 0.0:
        msg = f"A finger's width and length must be positive, but are {width_px:g} px and {length_px:g} px."
        raise FingervisionError(msg)
    if isinstance(tip, SquareTip):
        rise = half * tan(radians(tip.slant_deg))
        corners = ((half, length_px), (-half, length_px), (-half, rise), (half, -rise))
        shape = polygon(corners, (0.0, 0.0, tip.radius_px, tip.radius_px))
    else:
        if not 0.0 < tip.height_px < length_px:
            msg = f"An elliptic tip's height must lie between 0 and the finger's length, but is {tip.height_px:g} px."
            raise FingervisionError(msg)
        pieces: list[Piece] = list(half_ellipse(half, tip.height_px))
        pieces.append(Line(half, tip.height_px, half, length_px))
        pieces.append(Line(half, length_px, -half, length_px))
        pieces.append(Line(-half, length_px, -half, tip.height_px))
        shape = Outline(tuple(pieces))
    return shape.moved(Motion.turn(radians(tilt_deg)))


def half_ellipse(half_width_px: float, height_px: float) -> tuple[Arc, ...]:
    """Half an ellipse from (-half_width, height) over (0, 0) to (half_width, height), as circular arcs.

    Neighbouring arcs share their tangent: each pair is a biarc between two points of the ellipse with its tangents
    there (Bolton, Biarc curves, Computer-Aided Design 7, 1975).
    """
    pairs = ELLIPSE_ARCS // 2
    knots = []
    for i in range(pairs + 1):
        angle = pi * i / pairs
        x, y = -half_width_px * cos(angle), height_px * (1.0 - sin(angle))
        tx, ty = half_width_px * sin(angle), -height_px * cos(angle)
        size = hypot(tx, ty)
        knots.append((x, y, tx / size, ty / size))
    arcs: list[Arc] = []
    for (x0, y0, tx0, ty0), (x1, y1, tx1, ty1) in pairwise(knots):
        # Equal handles d: |chord|^2 - 2 d chord.(t0 + t1) + 2 d^2 (t0.t1 - 1) = 0.
        vx, vy = x1 - x0, y1 - y0
        a = 2 * (1 - (tx0 * tx1 + ty0 * ty1))
        b = 2 * (vx * (tx0 + tx1) + vy * (ty0 + ty1))
        c = vx * vx + vy * vy
        handle = 2 * c / (b + (b * b + 4 * a * c) ** 0.5)
        mx = (x0 + handle * tx0 + x1 - handle * tx1) / 2
        my = (y0 + handle * ty0 + y1 - handle * ty1) / 2
        for ax, ay, tx, ty, bx, by in ((x0, y0, tx0, ty0, mx, my), (x1, y1, -tx1, -ty1, mx, my)):
            nx, ny = -ty, tx
            dx, dy = bx - ax, by - ay
            radius = (dx * dx + dy * dy) / (2 * (nx * dx + ny * dy))
            cx, cy = ax + radius * nx, ay + radius * ny
            start, stop = atan2(ay - cy, ax - cx), atan2(by - cy, bx - cx)
            arc = Arc(cx, cy, abs(radius), start, (stop - start + pi) % (2 * pi) - pi)
            arcs.append(arc if (tx, ty) == (tx0, ty0) else arc.backwards())
    return tuple(arcs)
