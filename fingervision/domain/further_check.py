"""Checks that distinguish effects without another motion of the stage; changes of the picture by camera effects."""

from dataclasses import dataclass
from enum import Enum


class FurtherCheck(Enum):
    """A check that needs no other motion of the stage; its value is the sentence that advises the check.

    An effect states, for the checks that concern it, whether it is visible in the check (True) or not (False). A check
    distinguishes two effects when one of them is visible in it and the other is not.
    """

    SLOT = "measure a slot of known width in the fingers' place: what the camera adds shows in it, the gripper does not"
    """Visible: an effect that moves the edges of a resting slot in the picture's middle as it moves the fingers."""
    TURN = "turn the part by 180 degrees in the picture: what the part does turns with it, what the camera does stays"
    """Visible: an effect that turns with the part."""
    SHIFT = "shift the picture: what the lens adds depends on the place in it, what the part does goes along"
    """Visible: an effect that depends on the position in the picture."""
    REZERO = "re-zero the stage: an offset that came from its zeroing changes with it, the rest gap stays"
    """Visible: an effect that disappears when the stage's zero is set anew."""
    TRAVEL = "measure the stage's travel with a gauge: the input's scale shows in it, the lever's ratio does not"
    """Visible: an effect that changes the travel of the stage itself."""
    LIGHT = (
        "let the camera see a light that is switched with the drive: a late picture shows it late, a late drive in time"
    )
    """Visible: an effect by which the picture is late."""
    FORCE = "measure the force, or look at the fingers where the motion ends: fingers that meet press on each other"
    """Visible: an effect by which the fingers press on each other."""


@dataclass(frozen=True, slots=True)
class PictureForm:
    """Change of the whole picture by a camera effect, beyond a displacement of the two measuring points.

    Parameters
    ----------
    radial_per_mm2 : float
        Coefficient k of the radial distortion x (1 + k r^2) about the image centre.
    keystone_per_mm : float
        Coefficient k of the keystone distortion x / (1 + k x).
    late_s : float
        Delay in s by which the content of the frame is older than its time stamp.
    """

    radial_per_mm2: float = 0.0
    keystone_per_mm: float = 0.0
    late_s: float = 0.0
