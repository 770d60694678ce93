"""Reading of one gauge in one frame."""

from dataclasses import dataclass, field

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
