"""Protocol of a bed's camera: frames, each with the time at which it was exposed."""

from dataclasses import dataclass
from typing import Protocol

from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.source import Description


class Shot(Protocol):
    """One frame as it came."""

    @property
    def index(self) -> int:
        """Place in the camera's stream, from 0 without holes."""
        ...

    @property
    def device_s(self) -> float:
        """Time of its exposure on the camera's own clock."""
        ...

    @property
    def arrived_s(self) -> float:
        """When the host had it, on the bed's clock."""
        ...

    def item(self) -> Frame | LostFrame:
        """Give the picture; a simulated one is drawn when it is asked for. `time_s` is `device_s`."""
        ...


@dataclass(frozen=True, slots=True)
class Latency:
    """What is known of the time from exposure to arrival: least value and its standard uncertainty.

    Parameters
    ----------
    least_s, u_s : float
        No frame arrives sooner after its exposure than this; arrivals alone cannot tell it, it must be stated.
    """

    least_s: float
    u_s: float


class BedCamera(Protocol):
    """A camera that looks at the fingers."""

    @property
    def description(self) -> Description:
        """Description of its frames: size, rate, coding."""
        ...

    @property
    def latency(self) -> Latency:
        """From exposure to arrival, as far as it is known."""
        ...

    def next(self) -> Shot:
        """Wait for the next frame.

        Raises
        ------
        FingervisionError
            The camera is stale: no frame came within its patience; or it was cut off.
        """
        ...

    def close(self) -> None:
        """Let go of the camera; closing twice is allowed."""
        ...
