"""Choose the frames of a recording or camera that are inspected: a limited number from its first seconds."""

from collections.abc import Iterator
from time import monotonic

from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.source import FrameSource

# Largest number of frames; more frames from a fast camera would not improve the findings.
MOST_FRAMES = 150


def frames_to_look_at(source: FrameSource, seconds: float, most: int = MOST_FRAMES) -> Iterator[Frame | LostFrame]:
    """Yield the frames of the first seconds, by their own times, or by the computer's clock if they have none.

    Parameters
    ----------
    source : FrameSource
        The recording or camera.
    seconds : float
        Duration of the inspected part.
    most : int
        Largest number of frames.
    """
    first_s: float | None = None
    is_live = not source.description.files
    began = monotonic()
    for number, item in enumerate(source):
        if first_s is None:
            first_s = item.time_s
        elif item.time_s is not None and item.time_s - first_s > seconds:
            return
        yield item
        if number + 1 >= most or (is_live and monotonic() - began > seconds):
            return
