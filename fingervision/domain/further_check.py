"""Checks that distinguish effects without another motion of the stage; changes of the picture by camera effects."""

from dataclasses import dataclass
from enum import Enum


class FurtherCheck(Enum):
    """A check that needs no other motion of the stage; its value is the sentence that advises the check.

    An effect states, for the checks that concern it, whether it is visible in the check (True) or not (False). A check
    distinguishes two effects when one of them is visible in it and the other is not.
    """

    SLOT = (
        "measure a slot of known width in place of the fingers: an error of the camera changes the measured width, an "
        "error of the gripper does not"
    )
    """Visible: an effect that moves the edges of a resting slot in the picture's middle as it moves the fingers."""
    TURN = (
        "turn the part by 180 degrees in the picture: an error of the part turns with it, an error of the camera "
        "does not"
    )
    """Visible: an effect that turns with the part."""
    SHIFT = "shift the part in the picture: an error of the lens changes with the place, an error of the part does not"
    """Visible: an effect that depends on the position in the picture."""
    REZERO = "re-zero the stage: an offset of its zero changes, the rest gap does not"
    """Visible: an effect that disappears when the stage's zero is set anew."""
    TRAVEL = (
        "measure the stage's travel with a gauge: an error of the input's scale shows, an error of the lever "
        "ratio does not"
    )
    """Visible: an effect that changes the travel of the stage itself."""
    LIGHT = (
        "film a light that is switched with the drive: if the camera is late, the light appears late; if the drive "
        "lags, it does not"
    )
    """Visible: an effect by which the picture is late."""
    FORCE = "measure the force, or look at the fingers where the motion ends: fingers that touch press on each other"
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
