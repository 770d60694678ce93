"""Protocol of a test bed's camera: frames, each with the time of its exposure."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.source import Description


class Shot(Protocol):
    """One frame as delivered by the camera."""

    @property
    def index(self) -> int:
        """Frame number in the camera's stream, from 0 without gaps."""
        ...

    @property
    def device_s(self) -> float:
        """Time of the exposure on the camera's own clock."""
        ...

    @property
    def arrived_s(self) -> float:
        """Arrival time at the computer, on the test bed's clock."""
        ...

    def item(self) -> Frame | LostFrame:
        """Return the picture; a simulated picture is rendered by this call. Its `time_s` is `device_s`."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Taken:
    """A `Shot` whose picture is made by a function, once it is wanted."""

    index: int
    device_s: float
    arrived_s: float
    picture: Callable[[], Frame | LostFrame]

    def item(self) -> Frame | LostFrame:
        """Return the picture."""
        return self.picture()


@dataclass(frozen=True, slots=True)
class Latency:
    """Smallest latency from exposure to arrival of a frame (s), with its standard uncertainty.

    Parameters
    ----------
    least_s, u_s : float
        Smallest latency and its standard uncertainty; it cannot be determined from arrival times alone and must be
        stated.
    """

    least_s: float
    u_s: float


class BedCamera(Protocol):
    """A camera that views the fingers."""

    @property
    def description(self) -> Description:
        """Description of the camera's frames: size, rate, coding."""
        ...

    @property
    def latency(self) -> Latency:
        """Smallest latency from exposure to arrival, as stated in the configuration."""
        ...

    def next(self) -> Shot:
        """Wait for the camera's next frame and return it.

        Raises
        ------
        DeviceError
            No frame arrived within the camera's time limit, or the camera was disconnected.
        """
        ...

    def close(self) -> None:
        """Release the camera; closing twice is allowed."""
        ...
