"""One reading of an instrument: its value, its time on the instrument's clock, and bounds of its time."""

from dataclasses import dataclass


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
