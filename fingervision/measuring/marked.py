"""Insert markers for frames that were lost while the recording was made."""

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.status import Status
from fingervision.storage.recorded_video import TICKS_PER_S

# Tolerance in ticks: a packet with the time of the previous packet is written one tick later, because times in a file
# must increase.
TICKS_AFTER = 3


def marked(source: Iterable[Frame | LostFrame], marks: Sequence[LostFrame]) -> Iterator[Frame | LostFrame]:
    """Insert lost frames into a recording, according to their times.

    Parameters
    ----------
    source : iterable of Frame or LostFrame
        The recording.
    marks : sequence of LostFrame
        Lost frames with times, in order.

    Yields
    ------
    Frame or LostFrame
        Frames and lost frames in order, numbered again.
    """
    waiting = deque(marks)
    index = 0
    for item in source:
        tick = None if item.time_s is None else _tick(item.time_s)
        taken = False
        while waiting and tick is not None and not taken:
            mark = waiting[0]
            behind = tick - _tick(mark.time_s or 0.0)
            repeats = mark.status is Status.DUPLICATE
            if behind < 0 or (behind == 0 and repeats):
                break
            yield replace(waiting.popleft(), index=index)
            index += 1
            taken = behind <= TICKS_AFTER if repeats else behind == 0
        if not taken:
            yield replace(item, index=index)
            index += 1
    for mark in waiting:
        yield replace(mark, index=index)
        index += 1


def _tick(time_s: float) -> int:
    return round(time_s * TICKS_PER_S)
