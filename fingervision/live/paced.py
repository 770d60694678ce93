"""Playback of a recording in real time, as if the frames came from a camera."""

from collections.abc import Iterator
from threading import Event
from time import monotonic

import av

from fingervision.frames.received import Received
from fingervision.frames.source import Description, FrameSource


class PacedRecording:
    """Yields each frame of a recording at its time; frames without times are yielded as fast as they are measured.

    Parameters
    ----------
    source : FrameSource
        The recording.
    """

    has_own_clock = True
    template: av.VideoStream | None = None

    def __init__(self, source: FrameSource) -> None:
        self._source = source
        self._closed = Event()

    @property
    def description(self) -> Description:
        """Description of the recording."""
        return self._source.description

    def received(self) -> Iterator[Received]:
        """Yield the frames, from the first to the last, at their times."""
        started_s = monotonic()
        first_s: float | None = None
        for item in self._source:
            if item.time_s is not None:
                first_s = item.time_s if first_s is None else first_s
                if self._closed.wait(max(0.0, started_s + item.time_s - first_s - monotonic())):
                    return
            if self._closed.is_set():
                return
            yield Received(item, monotonic())

    def close(self) -> None:
        """End the iteration over frames."""
        self._closed.set()
