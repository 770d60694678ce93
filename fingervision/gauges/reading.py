"""Reading of one gauge in one frame."""

from dataclasses import dataclass, field

from fingervision.domain.frame import LostFrame
from fingervision.domain.status import Status
from fingervision.gauges.quantities import Quantity
from fingervision.gauges.status import GaugeStatus


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


def unread(frame: object, status: Status, gauges: int) -> list[Reading]:
    """Readings of all gauges in a frame whose picture is lost or rejected: no values, with the frame's reason.

    Parameters
    ----------
    frame : Frame or LostFrame
        The frame; a lost frame states its reason.
    status : Status
        Status of the frame.
    gauges : int
        Number of gauges.
    """
    words = frame.words if isinstance(frame, LostFrame) else ""
    return [Reading(GaugeStatus(status.value), words=words)] * gauges
