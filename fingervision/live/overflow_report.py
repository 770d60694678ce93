"""Frames that came faster than they could be measured: counted by the capture, and said now and then."""

from collections.abc import Callable
from time import monotonic

from fingervision.live.capture import Capture

SAID_EVERY_S = 10.0


class OverflowReport:
    """Says how many frames were lost since it was said last.

    Parameters
    ----------
    capture : Capture
        Counts them.
    tell : callable
        Takes a name and a sentence.
    """

    def __init__(self, capture: Capture, tell: Callable[[str, str], None]) -> None:
        self._capture, self._tell = capture, tell
        self._told, self._told_at_s = 0, float("-inf")

    def say(self) -> None:
        """Report frames that were lost since the last report, if that report is long enough ago."""
        lost, now_s = self._capture.overflowed, monotonic()
        if lost > self._told and now_s - self._told_at_s >= SAID_EVERY_S:
            self._told_at_s = now_s
            more, self._told = lost - self._told, lost
            self._tell("overflowed", f"{more} frames came faster than they could be measured, and are lost.")
