"""Part of a recording: the frames from one number to another, with their numbers and times in the whole recording."""

from collections.abc import Iterable, Iterator

from fingervision.domain.frame import Frame, LostFrame


def frame_range(frames: Iterable[Frame | LostFrame], first: int, last: int) -> Iterator[Frame | LostFrame]:
    """Yield the frames of a part of a recording.

    Parameters
    ----------
    frames : iterable of Frame or LostFrame
        The recording; it is read from its start, because frames depend on earlier frames, up to the end of the range.
    first, last : int
        Numbers of the first and the last frame, from 0, both included.

    Yields
    ------
    Frame or LostFrame
        The frames of the range, with their numbers and times in the whole recording.
    """
    for item in frames:
        if item.index > last:
            return
        if item.index >= first:
            yield item
            if item.index == last:
                return
