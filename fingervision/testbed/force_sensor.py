"""Protocol of a force sensor, and one reading of any instrument with its time."""

from dataclasses import dataclass
from typing import Protocol

# One reading of an instrument: its value, its time on the instrument's clock, and bounds of its time.


@dataclass(frozen=True, slots=True)
class Reading:
    """Response of an instrument to one request.

    Parameters
    ----------
    device_s : float
        Time at which the value was taken, on the instrument's own clock.
    asked_s, got_s : float
        Times of the request and of the response, on the test bed's clock (`Clock.now_s`); the value was taken between
        them. For an instrument that sends values continuously, `asked_s` is the earliest possible time (that of the
        preceding value); for one without its own clock, `device_s` is the middle.
    value : float
        Position in mm, or force in N.
    moving : bool or None
        For a position: whether a motion was in progress (the controller's BUSY line); None if not known.
    """

    device_s: float
    asked_s: float
    got_s: float
    value: float
    moving: bool | None = None


class ForceSensor(Protocol):
    """Force at the drive.

    Every method raises `FingervisionError` with a sentence if the connection is lost.
    """

    @property
    def name(self) -> str:
        """Kind and name of the sensor, as run.json records it."""
        ...

    @property
    def full_scale_n(self) -> float:
        """Largest force that the sensor can measure (N)."""
        ...

    def readings(self) -> tuple[Reading, ...]:
        """Forces (N) since the last call, the oldest first; the last force is read by this call."""
        ...

    def close(self) -> None:
        """Release the hardware; closing twice is allowed."""
        ...
