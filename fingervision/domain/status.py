"""The status of a frame: it has a gap, or a reason why it has none."""

from enum import StrEnum


class Status(StrEnum):
    """Status of a frame, in the order in which the reasons are tested; the first that applies is given."""

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
