"""Protocol of a force sensor."""

from typing import Protocol

from fingervision.testbed.reading import Reading


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
