"""Reading of one gauge in one frame."""

from dataclasses import dataclass, field
from enum import StrEnum

from fingervision.domain.status import Status
from fingervision.gauges.quantities import Quantity

# Status of a gauge in a frame: it has a value, or a reason why it has none.


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
    GaugeStatus.AMBIGUOUS: "more than one matching object lies in the searched zone, or a similar one may have come "
    "from beside it: reduce reach_px, state the polarity, or move the gauge",
    GaugeStatus.LOW_CONTRAST: "the object has too little contrast or texture to be measured",
    GaugeStatus.SATURATED: "the flank of the edge is clipped at the end of the scale",
    GaugeStatus.BLURRED: "the blur of the edge exceeds 5 px (standard deviation)",
    GaugeStatus.TOUCHING: "the two edges are too near each other to be distinguished",
}


@dataclass(frozen=True, slots=True)
class Mark:
    """A shape to be drawn: a polyline of two or more points, or a cross at one point.

    Parameters
    ----------
    points_px : tuple of (float, float)
        Points of the shape, in the picture's pixels.
    """

    points_px: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Reading:
    """Result of one gauge in one frame.

    Parameters
    ----------
    status : GaugeStatus
        Whether the gauge has values, or the reason why it has none.
    quantities : tuple of Quantity
        Values in the order of the kind's names; empty if there are none.
    marks : tuple of Mark
        Shapes that show the result in the picture.
    zone : Mark
        Shape of the searched zone in the picture.
    words : str
        Reason why there is no value, if the reason is more specific than the status.
    """

    status: GaugeStatus
    quantities: tuple[Quantity, ...] = ()
    marks: tuple[Mark, ...] = ()
    zone: Mark | None = field(default=None)
    words: str = ""
