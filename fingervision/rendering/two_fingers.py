"""The standard scene: two fingers with a given gap at the measuring height."""

from math import sqrt

import numpy as np

from fingervision.domain.direction import Direction
from fingervision.domain.errors import DataError
from fingervision.rendering.finger import AXES, Finger, Highlight, SquareTip, Tip, finger_shape, highlight_shape
from fingervision.rendering.outline import Motion
from fingervision.rendering.scene import EVEN_LIGHT, Light, Patch, Rim, Scene
from fingervision.rendering.truth import measuring_point

# A finger that extends beyond the frame ends at this distance outside; neither blur nor lens distortion brings this end
# into the frame.
BEYOND_FRAME_PX = 200.0


def two_fingers(
    gap_px: float,
    *,
    below_tip_px: float = 10.2,
    direction: Direction = Direction.UP,
    width_px: float = 102.0,
    radius_px: float = 0.0,
    tip: Tip | None = None,
    tilt_deg: float | tuple[float, float] = 0.0,
    tip_at_px: float | None = None,
    tip_step_px: float = 0.0,
    centre_px: float = 0.0,
    length_px: float | None = None,
    frame: tuple[int, int] = (640, 480),
    light: Light | None = None,
    behind: tuple[Patch, ...] = (),
    before: tuple[Patch, ...] = (),
    rim: Rim | None = None,
    highlight: Highlight | None = None,
) -> Scene:
    """Two fingers whose true gap, `below_tip_px` below their tips, is `gap_px`.

    Parameters
    ----------
    gap_px : float
        Distance between the two measuring points in the ideal picture; negative lets the fingers overlap there.
    below_tip_px : float
        Distance of the measuring points from the tips, along the image axis; 0.3 mm at 34 px/mm by default.
    direction : Direction
        Direction in which the tips point.
    width_px : float
        Width of each finger; 3 mm at 34 px/mm by default.
    radius_px : float
        Radius of the tips' corners, up to half the width; not used where `tip` is given.
    tip : SquareTip or EllipticTip, optional
        Another shape of the tips. A slant is mirrored on the right finger.
    tilt_deg : float or (float, float)
        Tilt of both fingers, or of left and right; positive if the tip leans towards the greater coordinate across.
    tip_at_px : float, optional
        The left tip's coordinate along the fingers' axis; by default a quarter of the frame from the border.
    tip_step_px : float
        Distance by which the right tip extends beyond the left tip.
    centre_px : float
        Position of the middle of the gap across the fingers, relative to the frame's centre.
    length_px : float, optional
        Length of the fingers; by default, the fingers extend beyond the frame at their root.
    frame : (int, int)
        Width and height of the frame.
    light, behind, before, rim
        See `Scene`.
    highlight : Highlight, optional
        A bright stripe in each finger.

    Returns
    -------
    Scene
        Scene with two fingers, left and right (or upper and lower).

    Raises
    ------
    DataError
        A size is not a number, the step between the tips is greater than the gap, or a finger does not extend to the
        measuring height.
    """
    numbers = (gap_px, below_tip_px, width_px, radius_px, tip_step_px, centre_px, *np.atleast_1d(tilt_deg))
    if not np.isfinite(numbers).all():
        raise DataError(
            f"Every size and tilt of two fingers must be a finite number, but they are {[float(x) for x in numbers]}."
        )
    axes = AXES[direction]
    across_size, along_size = frame if direction.is_vertical else frame[::-1]
    shape = tip if tip is not None else SquareTip(radius_px)
    mirrored = SquareTip(shape.radius_px, -shape.slant_deg) if isinstance(shape, SquareTip) else shape
    tilts = tilt_deg if isinstance(tilt_deg, tuple) else (tilt_deg, tilt_deg)

    outwards_positive = direction in (Direction.DOWN, Direction.RIGHT)
    default = 0.75 * (along_size - 1) if outwards_positive else 0.25 * (along_size - 1)
    tip_px = default if tip_at_px is None else tip_at_px
    root_side = -tip_px if outwards_positive else tip_px
    border = 0.0 if outwards_positive else along_size - 1.0
    reach = length_px if length_px is not None else border - root_side + width_px + abs(tip_step_px) + BEYOND_FRAME_PX
    tips_along = (root_side, root_side - tip_step_px)

    if not abs(gap_px) >= abs(tip_step_px):
        raise DataError(
            f"gap_px must be at least the step between the tips ({abs(tip_step_px):g} px), but is {gap_px:g}."
        )
    component = sqrt(gap_px**2 - tip_step_px**2) * (1.0 if gap_px >= 0.0 else -1.0)
    middle = (across_size - 1) / 2 + centre_px
    fingers = []
    stripes: list[Patch] = []
    for side, form, tilt, along in zip((-1, 1), (shape, mirrored), tilts, tips_along, strict=True):
        own = finger_shape(width_px, reach, form, tilt)
        across, tip_along = measuring_point(own, below_tip_px, side)
        shift = Motion(x_px=middle + side * component / 2 - across, y_px=along - tip_along)
        fingers.append(Finger(own.moved(shift).moved(axes), direction))
        if highlight is not None:
            stripe = highlight_shape(highlight, tilt).moved(shift).moved(axes)
            stripes.append(Patch((stripe,), highlight.level))
    return Scene(tuple(fingers), frame[0], frame[1], light or EVEN_LIGHT, behind, (*stripes, *before), rim)
