"""Random access to a frame by its time, for display only; a series is never measured by random access."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

import av

from fingervision.domain.frame import Coding, Frame
from fingervision.domain.quantiser import Quantiser
from fingervision.frames import image_folder, video_file
from fingervision.frames.decoded_picture import EXPORTED, StepTrail, luma
from fingervision.frames.file_pictures import picture_times_s
from fingervision.frames.open_container import open_container
from fingervision.frames.video_file import upright, upright_steps

# Largest number of frames that are decoded from a key frame to the wanted frame; beyond it, frames are counted from the
# recording's start.
MOST_FRAMES_TO_DECODE = 600
# Number of a frame of which only the time is known.
UNNUMBERED = -1
# A frame at most this much later than the one before is reached by reading on.
READ_ON_S = 1


Passes = Callable[[Frame], None]


class Seeking(Protocol):
    """A recording whose single frames can be accessed directly."""

    def frame(self, index: int, time_s: float, passes: Passes | None = None) -> Frame | None:
        """Return the frame with exactly the given time; None if it does not exist or cannot be decoded alone.

        Parameters
        ----------
        index : int
            Number of the frame, from 0.
        time_s : float
            Its time (s).
        passes : callable, optional
            Called with each frame, without its number, that is decoded on the way from a key frame; what it raises ends
            the way.
        """
        ...


def seeking(name: str) -> Seeking | None:
    """Open a video file for random access; None for sources whose frames are accessed by number anyway.

    Parameters
    ----------
    name : str
        The recording.
    """
    if image_folder.accepts(name) or not video_file.accepts(name) or not Path(name).is_file():
        return None
    return VideoSeeking(name)


def frame_times_s(name: str) -> list[float]:
    """Times of all frames of a video file (s), read without decoding; empty if its packets do not tell them surely.

    Parameters
    ----------
    name : str
        The recording.
    """
    try:
        return [] if seeking(name) is None else picture_times_s(Path(name))
    except (av.FFmpegError, OSError, ValueError):
        return []


class VideoSeeking:
    """Random access to a video file; to read the following frame, the decoder continues from its present position.

    Parameters
    ----------
    name : str
        Path of the file.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._coding = video_file.VideoFile(name).description.coding
        self._container: av.container.InputContainer | None = None
        self._pictures: Iterator[tuple[av.VideoFrame, Quantiser | None]] | None = None
        self._wanted = 0

    def frame(self, index: int, time_s: float, passes: Passes | None = None) -> Frame | None:
        """Return the frame with exactly the given time; None if it does not exist or cannot be decoded alone."""
        try:
            found = self._found(index, time_s, passes)
        except (av.FFmpegError, OSError, ValueError):
            found = None
        if found is None:
            self._close()
        return found

    def _found(self, index: int, time_s: float, passes: Passes | None) -> Frame | None:
        if self._container is None:
            self._container, self._pictures = open_container(self._name), None
            codec = self._container.streams.video[0].codec_context
            # Without threads a picture is decoded from its own packet, which may be the last in a file that is written.
            codec.options, codec.thread_count = EXPORTED, 1
        stream = self._container.streams.video[0]
        if stream.time_base is None:
            return None
        before, self._wanted = self._wanted, round(time_s / float(stream.time_base))
        if self._pictures is None or not 0 < self._wanted - before < READ_ON_S / stream.time_base:
            self._container.seek(self._wanted, stream=stream, backward=True)
            self._pictures = self._decoded(self._container, stream)
        for number, (picture, steps) in enumerate(self._pictures):
            if number > MOST_FRAMES_TO_DECODE or picture.pts is None or picture.pts > self._wanted:
                return None
            if picture.is_corrupt or (passes is None and picture.pts != self._wanted):
                continue
            hangs = self._coding is Coding.INTERFRAME and not picture.key_frame
            pixels = upright(luma(picture), picture.rotation)
            if picture.pts == self._wanted:
                return Frame(pixels, index, time_s, self._coding, hangs, upright_steps(steps, picture))
            if passes is not None:
                at_s = float(picture.pts * stream.time_base)
                passes(Frame(pixels, UNNUMBERED, at_s, self._coding, hangs, upright_steps(steps, picture)))
        return None

    def _decoded(
        self, container: av.container.InputContainer, stream: av.VideoStream
    ) -> Iterator[tuple[av.VideoFrame, Quantiser | None]]:
        """Decode on, from the last key frame before the wanted one."""
        trail = StepTrail()
        group: list[av.packet.Packet[av.VideoStream]] = []
        for packet in container.demux(stream):
            if packet.is_keyframe:
                group.clear()
            group.append(packet)
            if packet.pts is not None and packet.pts < self._wanted:
                continue
            for each in group:
                for picture in each.decode():
                    yield picture, trail.of(picture)
            group.clear()

    def _close(self) -> None:
        if self._container is not None:
            self._container.close()
        self._container = None
