"""Checks that need no other stage motion and tell one effect from another; how an effect changes the picture."""

from dataclasses import dataclass
from enum import Enum


class FurtherCheck(Enum):
    """A check that needs no other motion of the stage, with the sentence that advises it.

    An effect states, for the checks that concern it, whether it is visible in the check (True) or not (False). A check
    distinguishes two effects when one of them is visible in it and the other is not.
    """

    SLOT = "measure a slot of known width in the fingers' place: what the camera adds shows in it, the gripper does not"
    """Shows: it moves the edges of a slot at rest in the middle of the picture as it moves the fingers."""
    TURN = "turn the part by 180 degrees in the picture: what the part does turns with it, what the camera does stays"
    """Shows: it turns with the part."""
    SHIFT = "shift the picture: what the lens adds depends on the place in it, what the part does goes along"
    """Shows: it depends on the place in the picture."""
    REZERO = "re-zero the stage: an offset that came from its zeroing changes with it, the rest gap stays"
    """Shows: a new reference of the zero takes it away."""
    TRAVEL = "measure the stage's travel with a gauge: the input's scale shows in it, the lever's ratio does not"
    """Shows: the stage itself travels otherwise."""
    LIGHT = (
        "let the camera see a light that is switched with the drive: a late picture shows it late, a late drive in time"
    )
    """Shows: the picture is late."""
    FORCE = "measure the force, or look at the fingers where the motion ends: fingers that meet press on each other"
    """Shows: the fingers press on each other."""


@dataclass(frozen=True, slots=True)
class PictureForm:
    """How a camera effect changes the picture, beyond moving the two measuring points.

    Parameters
    ----------
    radial_per_mm2 : float
        k of x (1 + k r^2), radial about the image centre.
    keystone_per_mm : float
        k of x / (1 + k x).
    late_s : float
        The frame shows what was so long before its stamp.
    """

    radial_per_mm2: float = 0.0
    keystone_per_mm: float = 0.0
    late_s: float = 0.0
