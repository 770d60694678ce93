"""Status of a video frame: the frame has a gap, or the status states the reason why not."""

from enum import StrEnum


class Status(StrEnum):
    """Status of a video frame; the reasons are tested in this order, and the first that applies is stated.

    Examples
    --------
    >>> import fingervision as fv
    >>> row = fv.measure("sample_frames/table1/frame_00.png", px_per_mm=34.0)[0]
    >>> row.status == fv.Status.OK
    True
    """

    OK = "ok"
    DAMAGED = "damaged"
    DUPLICATE = "duplicate"
    NOT_ASKED = "not_asked"
    SATURATED = "saturated"
    LOW_CONTRAST = "low_contrast"
    NO_FINGERS = "no_fingers"
    ONE_FINGER = "one_finger"
    TIP_OUT_OF_VIEW = "tip_out_of_view"
    BLURRED = "blurred"
    TOUCHING = "touching"
    GRIPPING = "gripping"
