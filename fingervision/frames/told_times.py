"""Detect damage from time stamps: times that decrease, isolated jumps in a damaged file, missing frames."""

from collections import Counter, deque
from collections.abc import Iterable, Iterator

import av

from fingervision.frames.damage import Picture

# Number of consecutive equal steps after which times are regarded as equidistant; times of cameras with a variable rate
# never agree to one tick.
EVEN_STEPS = 8
# Permitted deviation of a step (ticks): containers round both times of a step to a tick.
TICKS = 1.01

BACKWARDS = (
    "The frame's time is not later than that of the previous frame: one of the two times is damaged in the file."
)
OUT_OF_ROW = (
    "The frame's time does not fit between those of its neighbours, which are equidistant, and a checksum of the file "
    "is wrong."
)


def believable(pictures: Iterable[Picture], *, is_damaged: bool) -> Iterator[Picture]:
    """Yield pictures in order of presentation, with lost frames in place of pictures whose time is impossible.

    Pictures leave a decoder in the order of presentation. If a time is earlier than the previous time, one of the two
    times is wrong, but it is not known which one. Two pictures with contradicting times count as lost, and so do all
    following pictures until times are later than both times. A repeated time is left unchanged, because it means a
    duplicate frame.

    A single time that deviates from an otherwise regular series counts as wrong only in a file that is known to be
    damaged: in a sound file it is the camera's. A camera that is late by some milliseconds in one frame of hundreds is
    common, and one flipped bit that meets the two bytes of a time is rare.

    Parameters
    ----------
    pictures : iterable of (int or None, VideoFrame or str)
        Ticks with pictures, or with the reason why there is no picture. One item is read in advance.
    is_damaged : bool
        Whether the bytes that state the times may be damaged: a checksum over them is wrong.

    Yields
    ------
    (int or None, VideoFrame or str)
        Items of the same kind, in the same order.
    """
    steps: deque[int] = deque(maxlen=EVEN_STEPS)
    before: int | None = None  # time of the last picture that was passed on
    latest: int | None = None
    held: Picture | None = None
    for picture in pictures:
        tick, held_tick = picture[0], None if held is None else held[0]
        if held is None or held_tick is None or tick is None:
            if held is not None:
                before = before if held_tick is None else held_tick
                yield held
            held = picture
            continue
        if is_damaged and before is not None and _out_of_row(steps, held_tick - before, tick - held_tick):
            yield _lost(held, OUT_OF_ROW)
            held = picture
            continue
        latest = held_tick if latest is None else max(latest, held_tick)
        if tick < latest:
            # The latest time is kept, so that following pictures must be later than this time.
            yield held if tick >= held_tick else _lost(held, BACKWARDS)
            held, before = _lost(picture, BACKWARDS), None
            steps.clear()
            continue
        if before is not None:
            steps.append(held_tick - before)
        before = held_tick
        yield held
        held = picture
    if held is not None:
        yield held


class EvenRow:
    """Detects missing frames in a regular series of times, in decoding order.

    The class is used for broadcast formats (MPEG-TS): their encoders keep a constant rate, so that a missing frame was
    lost in transmission.

    Parameters
    ----------
    stated_step : float or None
        Ticks between two frames, if the stream states a rate; used from the first step that agrees with it.
    """

    def __init__(self, stated_step: float | None = None) -> None:
        self._steps: deque[int] = deque(maxlen=EVEN_STEPS)
        self._stated = stated_step
        self._last: int | None = None

    def leaps(self, tick: int) -> bool:
        """Whether frames are missing between the previous tick and `tick`."""
        step = None if self._last is None else tick - self._last
        self._last = tick
        if step is None:
            return False
        usual, often = Counter(self._steps).most_common(1)[0] if self._steps else (0, 0)
        self._steps.append(step)
        if often < EVEN_STEPS // 2 and self._stated is not None and abs(usual - self._stated) <= TICKS:
            often = EVEN_STEPS
        # A missing frame leaves at least two steps; a time that jitters is no missing frame.
        return often >= EVEN_STEPS // 2 and step > 1.5 * usual + TICKS


def _usual(steps: "deque[int]") -> float | None:
    """Time step of a regular series of times; None if the series is irregular."""
    if len(steps) < EVEN_STEPS:
        return None
    usual = sum(steps) / len(steps)
    even = usual > 0.0 and all(abs(step - usual) <= TICKS for step in steps)
    return usual if even else None


def _out_of_row(steps: "deque[int]", to_it: int, from_it: int) -> bool:
    # A time step that is one of the usual steps is in the row; this quick test decides nearly all frames.
    if to_it in steps and to_it > 2.0 * TICKS:
        return False
    usual = _usual(steps)
    if usual is None:
        return False
    frames = round((to_it + from_it) / usual)
    together_fit = frames >= 2 and abs(to_it + from_it - frames * usual) <= TICKS
    on_row = round(to_it / usual)
    return together_fit and (on_row < 1 or abs(to_it - on_row * usual) > TICKS)


def _lost(picture: Picture, words: str) -> Picture:
    tick, found = picture
    return (tick, words) if isinstance(found, av.VideoFrame) else picture
