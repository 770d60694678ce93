"""Random access to a frame by its time, for display only; a series is never measured by random access."""

from pathlib import Path
from typing import Protocol

import av

from fingervision.domain.frame import Coding, Frame
from fingervision.frames import image_folder, video_file
from fingervision.frames.decoded_picture import EXPORTED, StepTrail, luma
from fingervision.frames.file_pictures import picture_times_s
from fingervision.frames.open_container import open_container
from fingervision.frames.video_file import upright, upright_steps

# Largest number of frames that are decoded from a key frame to the wanted frame; beyond it, frames are counted from the
# recording's start.
MOST_FRAMES_TO_DECODE = 600


class Seeking(Protocol):
    """A recording whose single frames can be accessed directly."""

    def frame(self, index: int, time_s: float) -> Frame | None:
        """Return the frame with exactly the given time; None if it does not exist or cannot be decoded alone."""
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
        self._tick: int | None = None

    def frame(self, index: int, time_s: float) -> Frame | None:
        """Return the frame with exactly the given time; None if it does not exist or cannot be decoded alone."""
        try:
            return self._found(index, time_s)
        except (av.FFmpegError, OSError, ValueError):
            self._close()
            return None

    def _found(self, index: int, time_s: float) -> Frame | None:
        if self._container is None:
            self._container = open_container(self._name)
            self._container.streams.video[0].codec_context.options = EXPORTED
        stream = self._container.streams.video[0]
        if stream.time_base is None:
            return None
        wanted = round(time_s / float(stream.time_base))
        self._container.seek(wanted, stream=stream, backward=True)
        trail = StepTrail()
        for number, picture in enumerate(self._container.decode(stream)):
            steps = trail.of(picture)
            if picture.pts == wanted and not picture.is_corrupt:
                hangs = self._coding is Coding.INTERFRAME and not picture.key_frame
                pixels = upright(luma(picture), picture.rotation)
                return Frame(pixels, index, time_s, self._coding, hangs, upright_steps(steps, picture))
            if number > MOST_FRAMES_TO_DECODE or picture.pts is None or picture.pts > wanted:
                return None
        return None

    def _close(self) -> None:
        if self._container is not None:
            self._container.close()
        self._container = None
