"""Reading of one gauge in one frame."""

from dataclasses import dataclass, field

from fingervision.domain.frame import LostFrame
from fingervision.domain.status import Status
from fingervision.gauges.quantities import Quantity
from fingervision.gauges.status import GaugeStatus


@dataclass(frozen=True, slots=True)
class Mark:
    """A shape to draw: a polyline of two or more points, or a cross at one point.

    Parameters
    ----------
    points_px : tuple of (float, float)
        In the picture's pixels.
    """

    points_px: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Reading:
    """Result of one gauge in one frame.

    Parameters
    ----------
    status : GaugeStatus
        Whether there are numbers.
    quantities : tuple of Quantity
        The numbers, in the order of the kind's names; empty where there are none.
    marks : tuple of Mark
        What was found, to be drawn.
    zone : Mark
        Where it was looked for, to be drawn.
    words : str
        Why there is no number, where more is known than the status says.
    """

    status: GaugeStatus
    quantities: tuple[Quantity, ...] = ()
    marks: tuple[Mark, ...] = ()
    zone: Mark | None = field(default=None)
    words: str = ""


def unread(frame: object, status: Status, gauges: int) -> list[Reading]:
    """Readings of all gauges in a frame whose picture is lost, or not believed: no number, with the frame's reason.

    Parameters
    ----------
    frame : Frame or LostFrame
        What came; a lost frame states its reason in words.
    status : Status
        Of the frame.
    gauges : int
        How many gauges there are.
    """
    words = frame.words if isinstance(frame, LostFrame) else ""
    return [Reading(GaugeStatus(status.value), words=words)] * gauges
