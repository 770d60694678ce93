"""Open a source by name; cameras and streams are opened again after an interruption, files are not."""

from collections.abc import Iterator
from threading import Event
from time import monotonic
from typing import cast

import av

from fingervision.domain.errors import UsageError
from fingervision.frames import camera
from fingervision.frames.network_stream import without_password
from fingervision.frames.source import CameraWish, Description, FrameSource, LiveSource, Received, Wish
from fingervision.frames.source_kinds import open_source
from fingervision.live.capture import Capture

# Playback of a recording in real time, as if the frames came from a camera.


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


def opened(name: str, wish: Wish) -> Capture:
    """Open a source for a live view.

    Raises
    ------
    DataError, DeviceError, InputFileError
        The source cannot be opened.
    UsageError
        Camera settings are given for a source that is not a camera of this machine.
    """
    if wish.camera != CameraWish() and not camera.accepts(name):
        raise UsageError(
            "--format, --exposure-ms, --gain, --focus and --white-balance-k are for cameras of this computer, but "
            f"{without_password(name)} is not one: leave them out."
        )
    source = open_source(name, wish)
    if not hasattr(source, "received"):
        if wish.size_px is not None:
            raise UsageError(f"--size is for cameras, but {name} is a recording: leave it out.")
        return Capture(PacedRecording(source), again=None)
    return Capture(cast("LiveSource", source), again=lambda: cast("LiveSource", open_source(name, wish)))
