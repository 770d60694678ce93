"""One finger: a bar with a tip of a given shape, placed along an axis of the picture and tilted."""

from dataclasses import dataclass
from math import radians, tan

import numpy as np

from fingervision.domain.direction import Direction
from fingervision.domain.errors import DataError
from fingervision.rendering.outline import Line, Motion, Outline, Piece, biarcs
from fingervision.rendering.polygon import polygon

# A half ellipse is approximated by this number of circular arcs, with an error of 1e-4 px; the true gap is computed
# from the arcs.
ELLIPSE_ARCS = 48
# Largest tilt; a finger with a larger tilt would point along another image axis.
STEEPEST_DEG = 45.0


@dataclass(frozen=True, slots=True)
class SquareTip:
    """Flat tip with two equal corners.

    Parameters
    ----------
    radius_px : float
        Radius of both corners: 0 is sharp; half the finger's width gives a half circle.
    slant_deg : float
        Slant of the flat end; positive if the finger is longer on the side of the larger coordinate across.
    """

    radius_px: float = 0.0
    slant_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class EllipticTip:
    """Tip with the shape of half an ellipse across the finger's width.

    Parameters
    ----------
    height_px : float
        Semi-axis along the finger.
    """

    height_px: float


Tip = SquareTip | EllipticTip


@dataclass(frozen=True, slots=True)
class Highlight:
    """A bright stripe with round ends inside a finger, along its axis.

    Parameters
    ----------
    level : float
        Grey level 0..255.
    width_px, length_px : float
        Width and length of the stripe.
    below_tip_px : float
        Distance of the stripe's start from the tip, along the finger's own axis.
    off_axis_px : float
        Distance between the centre lines of stripe and finger; positive if the stripe lies towards the larger
        coordinate across.
    """

    level: float
    width_px: float = 8.0
    length_px: float = 120.0
    below_tip_px: float = 40.0
    off_axis_px: float = 0.0


@dataclass(frozen=True, slots=True)
class Finger:
    """A finger as a closed outline.

    Parameters
    ----------
    outline : Outline
        Outline in the ideal picture.
    direction : Direction
        Axis of the picture along which the finger points.
    """

    outline: Outline
    direction: Direction


AXES = {
    Direction.UP: Motion(),
    Direction.DOWN: Motion(yy=-1.0),
    Direction.LEFT: Motion(0.0, 1.0, 1.0, 0.0),
    Direction.RIGHT: Motion(0.0, -1.0, 1.0, 0.0),
}
"""Maps from (across, towards the root) to (x, y): across is x to the right or y downwards."""


def finger_shape(width_px: float, length_px: float, tip: Tip, tilt_deg: float = 0.0) -> Outline:
    """Outline of a finger in its own coordinates: x across, y towards the root.

    The middle of the untilted tip is at (0, 0).

    Parameters
    ----------
    width_px, length_px : float
        Width, and length from tip to root.
    tip : SquareTip or EllipticTip
        Shape of the tip.
    tilt_deg : float
        Tilt about the tip; positive if the tip leans towards the larger coordinate across.

    Returns
    -------
    Outline
        The whole finger, with a square root end.

    Raises
    ------
    DataError
        If the tip does not fit on the finger, or it is tilted or slanted by more than STEEPEST_DEG.
    """
    half = width_px / 2
    if not (width_px > 0.0 and length_px > 0.0):
        raise DataError(f"A finger's width and length must be positive, but are {width_px:g} px and {length_px:g} px.")
    if not abs(tilt_deg) <= STEEPEST_DEG:
        raise DataError(
            f"A finger's tilt must be at most {STEEPEST_DEG:g} degrees, but is {tilt_deg:g}: choose another direction."
        )
    if isinstance(tip, SquareTip):
        if not abs(tip.slant_deg) <= STEEPEST_DEG:
            raise DataError(f"A tip's slant must be at most {STEEPEST_DEG:g} degrees, but is {tip.slant_deg:g}.")
        rise = half * tan(radians(tip.slant_deg))
        corners = ((half, length_px), (-half, length_px), (-half, rise), (half, -rise))
        shape = polygon(corners, (0.0, 0.0, tip.radius_px, tip.radius_px))
    else:
        if not 0.0 < tip.height_px < length_px:
            raise DataError(
                f"An elliptic tip's height must lie between 0 and the finger's length, but is {tip.height_px:g} px."
            )
        sides: list[Piece] = [
            Line(half, tip.height_px, half, length_px),
            Line(half, length_px, -half, length_px),
            Line(-half, length_px, -half, tip.height_px),
        ]
        shape = Outline((*half_ellipse(half, tip.height_px), *sides))
    return shape.moved(Motion.turn(radians(tilt_deg)))


def highlight_shape(highlight: Highlight, tilt_deg: float) -> Outline:
    """Outline of a highlight in the coordinates of `finger_shape`."""
    left, top = highlight.off_axis_px - highlight.width_px / 2, highlight.below_tip_px
    right, low = left + highlight.width_px, top + highlight.length_px
    radius = min(highlight.width_px, highlight.length_px) / 2
    stripe = polygon(((right, low), (left, low), (left, top), (right, top)), (radius,) * 4)
    return stripe.moved(Motion.turn(radians(tilt_deg)))


def half_ellipse(half_width_px: float, height_px: float) -> tuple[Piece, ...]:
    """Half an ellipse from (-half_width, height) over (0, 0) to (half_width, height), composed of circular arcs."""
    angle = np.linspace(0.0, np.pi, ELLIPSE_ARCS // 2 + 1)
    points = np.stack([-half_width_px * np.cos(angle), height_px * (1.0 - np.sin(angle))], axis=-1)
    tangents = np.stack([half_width_px * np.sin(angle), -height_px * np.cos(angle)], axis=-1)
    return biarcs(points, tangents)
