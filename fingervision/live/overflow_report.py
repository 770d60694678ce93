"""Report of frames that were lost because they arrived faster than they could be measured."""

from collections.abc import Callable
from time import monotonic

from fingervision.live.capture import Capture

SAID_EVERY_S = 10.0


class OverflowReport:
    """Reports, at intervals, the number of frames lost since the last report.

    Parameters
    ----------
    capture : Capture
        Capture that counts the lost frames.
    tell : callable
        Function that reports an event by a name and a sentence.
    """

    def __init__(self, capture: Capture, tell: Callable[[str, str], None]) -> None:
        self._capture, self._tell = capture, tell
        self._told, self._told_at_s = 0, float("-inf")

    def say(self) -> None:
        """Report lost frames, if frames were lost and the last report is long enough ago."""
        lost, now_s = self._capture.overflowed, monotonic()
        if lost > self._told and now_s - self._told_at_s >= SAID_EVERY_S:
            self._told_at_s = now_s
            more, self._told = lost - self._told, lost
            self._tell(
                "overflowed", f"{more} frames are lost, because they arrived faster than they could be measured."
            )
