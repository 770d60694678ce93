"""Whether a frame gave a number, and if not, why."""

from enum import StrEnum


class Status(StrEnum):
    """The state of one frame, in the order in which reasons are looked for: the first that applies is given."""

    OK = "ok"
    DAMAGED = "damaged"
    DUPLICATE = "duplicate"
    SATURATED = "saturated"
    LOW_CONTRAST = "low_contrast"
    NO_FINGERS = "no_fingers"
    ONE_FINGER = "one_finger"
    TIP_OUT_OF_VIEW = "tip_out_of_view"
    BLURRED = "blurred"
    TOUCHING = "touching"
    GRIPPING = "gripping"
