"""Status of a gauge in a frame: it has a value, or a reason why it has none."""

from enum import StrEnum

from fingervision.domain.status import Status


class GaugeStatus(StrEnum):
    """The status of one gauge in one frame; statuses that also occur in gaps.csv have the same meaning here."""

    OK = Status.OK.value
    DAMAGED = Status.DAMAGED.value
    DUPLICATE = Status.DUPLICATE.value
    SATURATED = Status.SATURATED.value
    LOW_CONTRAST = Status.LOW_CONTRAST.value
    NO_FINGERS = Status.NO_FINGERS.value
    ONE_FINGER = Status.ONE_FINGER.value
    TIP_OUT_OF_VIEW = Status.TIP_OUT_OF_VIEW.value
    BLURRED = Status.BLURRED.value
    TOUCHING = Status.TOUCHING.value
    GRIPPING = Status.GRIPPING.value
    OUT_OF_VIEW = "out_of_view"
    NO_EDGE = "no_edge"
    NOT_FOUND = "not_found"
    AMBIGUOUS = "ambiguous"


MEANING = {
    GaugeStatus.OUT_OF_VIEW: "the measured object, or a part that the fit needs, lies outside the picture",
    GaugeStatus.NO_EDGE: "there is no straight edge of this polarity and contrast within reach_px",
    GaugeStatus.NOT_FOUND: "nothing similar to the object lies within reach_px",
    GaugeStatus.AMBIGUOUS: "several similar objects lie within reach_px: lower reach_px, state the "
    "polarity, or move the gauge",
    GaugeStatus.LOW_CONTRAST: "too little contrast to measure",
    GaugeStatus.SATURATED: "the flank of an edge is clipped at full scale",
    GaugeStatus.BLURRED: "an edge is spread by more than 5 px (standard deviation)",
    GaugeStatus.TOUCHING: "the two edges are too close together to be distinguished",
}
