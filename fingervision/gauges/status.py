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
    GaugeStatus.OUT_OF_VIEW: "the measured object, or a necessary part of it, lies outside the picture",
    GaugeStatus.NO_EDGE: "no straight edge with this polarity and contrast lies in the searched zone",
    GaugeStatus.NOT_FOUND: "no matching object lies in the searched zone",
    GaugeStatus.AMBIGUOUS: "more than one matching object lies in the searched zone: reduce reach_px, state the "
    "polarity, or move the gauge",
    GaugeStatus.LOW_CONTRAST: "the object has too little contrast or texture to be measured",
    GaugeStatus.SATURATED: "the flank of the edge is clipped at the end of the scale",
    GaugeStatus.BLURRED: "the blur of the edge exceeds 5 px (standard deviation)",
    GaugeStatus.TOUCHING: "the two edges are too near each other to be distinguished",
}
