"""One reading of an instrument: its value, its time on the instrument's clock, and two bounds in host time."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Reading:
    """The answer of an instrument to one request.

    Parameters
    ----------
    device_s : float
        When the value was taken, on the instrument's own clock.
    asked_s, got_s : float
        When the host asked and when the answer was there, on the bed's clock (`Clock.now_s`); the value was taken in
        between. An instrument that streams states for `asked_s` the earliest time that is possible (that of the
        answer before), and one without a clock of its own gives the middle as `device_s`.
    value : float
        Position in mm, or force in N.
    moving : bool or None
        For a position: whether a motion was under way (the controller's BUSY line); None where that is not known.
    """

    device_s: float
    asked_s: float
    got_s: float
    value: float
    moving: bool | None = None
