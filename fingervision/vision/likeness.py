"""Test whether two objects can be the fingers of one gripper: similar height and width, and parallel.

A camera that is turned relative to the gripper shows the two tips at different heights and both fingers tilted by the
same angle; a wire, a housing or the edge of a table beside a finger has another width.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.flanks import across_by_row
from fingervision.vision.tops import Top

Floats = NDArray[np.float64]

# Largest ratio of the widths of two fingers of one gripper (printed jaws and their counterparts). A finger at the
# picture's border may be wider than its visible part, so that only a larger visible part is limited, by the second
# ratio.
MOST_TIMES_WIDER, MOST_TIMES_CUT = 2.5, 1.2
# Largest difference in height of the two tips, as a multiple of the measuring height, and largest rotation of the
# camera (slope; 14 degrees).
STEP_HEIGHTS, MOST_TURNED = 4.0, 0.25
# The same multiple if the border cuts off one finger only, so that only the heights show that the fingers belong
# together.
STEP_HEIGHTS_CUT = 1.0
# If the tilt of both fingers agrees with the line through their tips within the first slope, the camera may be rotated
# by up to the second slope, a little more than 25 degrees; beyond it, rows cross the flanks at too small an angle.
LEANS_ALIKE, FARTHEST_TURNED = 0.2, 0.49
# Tilt (slope) below which the rotation is negligible.
LEAST_TURN = 0.05
# Number of rows in which width and tilt are measured, range of these rows as shares of the finger's height (without tip
# and root), and least number of rows.
ROWS, FROM_SHARE, TO_SHARE, FEWEST_ROWS = 24, 0.4, 0.9, 4

_build = loop("likeness_build")


@dataclass(frozen=True, slots=True)
class Build:
    """Width and tilt of an object that may be a finger.

    Parameters
    ----------
    width_px : float
        Median width of the visible part below the tip; 0 if too little is visible.
    lean : float
        Tilt: displacement across per pixel towards the root.
    is_cut : bool
        Whether the picture's border cuts off the outer side.
    """

    width_px: float
    lean: float
    is_cut: bool


def build(top: Top, inner_sign: int, across_size: int) -> Build:
    """Width and tilt of the object below a tip, down to where both its sides end.

    The sign of `inner_sign` is the direction across in which the inner side lies.
    """
    first, second = (across_by_row(top.outline, top.index, step) for step in (-1, 1))
    inner, outer = (second, first) if inner_sign * (second[-1] - first[-1]) > 0 else (first, second)
    width, lean, cut = _build(inner, outer, across_size)
    return Build(width, lean, cut)


def are_alike(first: Build, second: Build) -> bool:
    """Whether two objects have about the same width, as far as they are in view."""
    narrow, wide = sorted((first, second), key=lambda one: one.width_px)
    if narrow.width_px <= 0.0 or (narrow.is_cut and wide.is_cut):
        return True
    times = MOST_TIMES_CUT if wide.is_cut else MOST_TIMES_WIDER
    return narrow.is_cut or wide.width_px <= times * narrow.width_px


def end_alike(step_px: float, apart_px: float, below_tip_px: float, builds: tuple[Build, Build] | None = None) -> bool:
    """Whether two tips are at about the same height, as those of one gripper, even if the camera is rotated.

    Parameters
    ----------
    step_px : float
        Height of the right tip minus that of the left tip, along the axis towards the roots.
    apart_px : float
        Distance between the tips across the fingers, positive.
    below_tip_px : float
        Distance of the measuring point below the tip.
    builds : (Build, Build), optional
        Width and tilt of the left and of the right object; without them every camera angle is allowed.
    """
    heights, turned = STEP_HEIGHTS, MOST_TURNED
    if builds is None:
        turned = FARTHEST_TURNED
    elif builds[0].is_cut != builds[1].is_cut:
        heights = STEP_HEIGHTS_CUT
    if abs(step_px) <= heights * below_tip_px + turned * apart_px:
        return True
    if builds is None or abs(step_px) > heights * below_tip_px + FARTHEST_TURNED * apart_px:
        return False
    turn = -step_px / max(apart_px, 1.0)
    return all(abs(one.lean - turn) <= LEANS_ALIKE for one in builds)


def lie_level(step_px: float, apart_px: float, below_tip_px: float, builds: tuple[Build, Build]) -> bool:
    """Whether two objects that lie wholly in view end at the same height, if the camera is turned by their mean tilt.

    Two objects that extend from the picture's border are likely to be fingers of one gripper, however the camera is
    turned. Two bars that lie wholly in view are less likely to be fingers; the difference in height between their ends
    must therefore agree with a camera that is turned by the mean tilt of both bars.

    Parameters
    ----------
    step_px, apart_px, below_tip_px : float
        As in `end_alike`.
    builds : (Build, Build)
        Width and tilt of the left and of the right object.
    """
    turn = 0.5 * (builds[0].lean + builds[1].lean)
    return abs(step_px + turn * apart_px) <= STEP_HEIGHTS * below_tip_px


def common_turn(leans: Sequence[float]) -> float:
    """Common tilt of both fingers, as a slope; 0 if their tilts differ or are negligible."""
    turn = 0.5 * sum(leans)
    return turn if abs(leans[0] - leans[1]) <= LEANS_ALIKE and abs(turn) > LEAST_TURN else 0.0
