"""Decode ahead: the next frames are decoded on another core while the present one is measured."""

from collections.abc import Generator, Iterable
from dataclasses import dataclass
from queue import Empty, Full, Queue
from threading import Event, Thread

from fingervision.domain.frame import Frame, LostFrame

# Largest number of frames between decoder and measurement: enough to compensate for slow key frames, and few enough for
# the memory that 4K pictures need.
FRAMES_AHEAD = 8
# Interval of two checks: by the decoder, whether its frames are still wanted; by the reader, whether the decoder still
# runs.
PATIENCE_S = 0.2


@dataclass(frozen=True, slots=True)
class _End:
    """Marker for the end of the frames, with the exception that ended the reading, if any."""

    error: BaseException | None


def decoded_ahead(source: Iterable[Frame | LostFrame]) -> Generator[Frame | LostFrame, None, None]:
    """Yield the frames of a source, which a separate thread reads in advance.

    The decoders release Python's global lock while they work, so that decoding and measuring use two cores. At most
    `FRAMES_AHEAD` frames are kept in memory, however long the recording is.

    Parameters
    ----------
    source : iterable of Frame or LostFrame
        Source of frames; it is read from the other thread only.

    Yields
    ------
    Frame or LostFrame
        Frames in order; an exception of the source is raised here, after the frames that came before it.
    """
    waiting: Queue[Frame | LostFrame | _End] = Queue(FRAMES_AHEAD)
    unwanted = Event()
    reader = Thread(target=_read, args=(source, waiting, unwanted), name="decoder", daemon=True)
    reader.start()
    try:
        while True:
            item = waiting.get()
            if isinstance(item, _End):
                if item.error is not None:
                    raise item.error
                return
            yield item
    finally:
        unwanted.set()
        _emptied(waiting)
        reader.join()


def _read(source: Iterable[Frame | LostFrame], waiting: "Queue[Frame | LostFrame | _End]", unwanted: Event) -> None:
    error: BaseException | None = None
    try:
        for item in source:
            if not _put(waiting, item, unwanted):
                return
    except Exception as raised:
        error = raised
    _put(waiting, _End(error), unwanted)


def _put(waiting: "Queue[Frame | LostFrame | _End]", item: Frame | LostFrame | _End, unwanted: Event) -> bool:
    while not unwanted.is_set():
        try:
            waiting.put(item, timeout=PATIENCE_S)
        except Full:
            continue
        return True
    return False


def _emptied(waiting: "Queue[Frame | LostFrame | _End]") -> None:
    try:
        while True:
            waiting.get_nowait()
    except Empty:
        return
