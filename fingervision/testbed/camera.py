"""Protocol of a bed's camera: frames, each with the time of its exposure."""

from dataclasses import dataclass
from typing import Protocol

from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.source import Description


class Shot(Protocol):
    """One frame as delivered by the camera."""

    @property
    def index(self) -> int:
        """Frame number in the camera's stream, from 0 without holes."""
        ...

    @property
    def device_s(self) -> float:
        """Time of its exposure on the camera's own clock."""
        ...

    @property
    def arrived_s(self) -> float:
        """Arrival time at the host, on the bed's clock."""
        ...

    def item(self) -> Frame | LostFrame:
        """Return the picture; a simulated one is drawn at this call. `time_s` is `device_s`."""
        ...


@dataclass(frozen=True, slots=True)
class Latency:
    """Latency from exposure to arrival: its least value, and that value's standard uncertainty.

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
        """Description of the camera's frames: size, rate, coding."""
        ...

    @property
    def latency(self) -> Latency:
        """Latency from exposure to arrival, as far as it is known."""
        ...

    def next(self) -> Shot:
        """Wait for the next frame.

        Raises
        ------
        DeviceError
            The camera is stale: no frame came within its patience; or it was cut off.
        """
        ...

    def close(self) -> None:
        """Release the camera; closing twice is allowed."""
        ...
