"""Extent of damage in a coded video, from the broken packet to the next key frame; damage that time stamps show."""

from __future__ import annotations

import heapq
from collections import Counter, deque
from collections.abc import Iterable, Iterator
from itertools import count

import av

Picture = tuple[int | None, av.VideoFrame | str]


class DamageTrail:
    """Follower of packets into a decoder and of pictures out of it, which marks the damaged pictures.

    A picture that is coded as a difference depends on earlier pictures. After a packet that could not be decoded, the
    decoder continues with substituted content, and its pictures look undamaged but are wrong. Every picture coded after
    a broken packet is therefore damaged, until a key frame that is not itself broken. Pictures leave the decoder in
    another order than their packets enter, so that every packet's number is passed through the decoder (FFmpeg's
    `copy_opaque`, see `prepare`).
    """

    def __init__(self) -> None:
        self._numbers = count()
        # (tick, number in coded order) of packets whose pictures have not left the decoder.
        self._entered: list[tuple[int, int]] = []
        self._last = -1
        # Reason for the damage, by number in coded order, until an undamaged key frame follows.
        self._broken: dict[float, str] = {}
        self._stated_keys: set[int] = set()  # numbers of packets that are key frames according to the container
        self._recoveries: dict[int, int] = {}  # packet that completes a recovery: packet that began it
        self._given_up: set[int] = set()  # ticks of pictures that were lost since the damage

    @staticmethod
    def prepare(codec: av.CodecContext) -> None:
        """Set up a decoder, before its first packet, to pass the numbers of packets on to their pictures."""
        codec.copy_opaque = True

    def enters(self, packet: av.Packet[av.VideoStream], *, is_shown: bool = True) -> None:
        """Record that a packet enters the decoder, and whether a picture is expected from it."""
        self._last = next(self._numbers)
        packet.opaque = self._last
        if packet.is_keyframe and self._broken:
            self._stated_keys.add(self._last)
        if packet.is_corrupt:
            self.breaks("The frame is incomplete in the file.")
        if packet.pts is not None and not packet.is_discard and is_shown:
            heapq.heappush(self._entered, (packet.pts, self._last))

    @property
    def is_broken(self) -> bool:
        """Whether damage has been recorded that no key frame has ended."""
        return bool(self._broken)

    def breaks(self, why: str) -> None:
        """Record that the last packet could not be decoded or was incomplete."""
        self._broken.setdefault(self._last, why)

    def recovers(self, over: int) -> None:
        """Record that the last picture does not depend on packets more than `over` positions earlier.

        Streams without key frames are refreshed part by part: once every part has been refreshed, pictures no longer
        depend on those before the refresh.
        """
        if self._broken:
            self._recoveries[self._last] = self._last - over

    def fails(self, why: str) -> Iterator[Picture]:
        """Record that the last packet, which depends on no other packet, gives no picture, and yield a lost frame."""
        self.breaks(why)
        own = [entry for entry in self._entered if entry[1] == self._last]
        for entry in own:
            self._entered.remove(entry)
            heapq.heapify(self._entered)
        yield own[0][0] if own else None, why

    def hole(self, why: str) -> None:
        """Record a hole in the stream after the last packet; the end of this packet may be damaged, too."""
        self.breaks(why)
        self.missing(why)

    def missing(self, why: str) -> None:
        """Record that a whole picture is missing after the last packet, which itself is undamaged."""
        self._last = next(self._numbers)
        self._broken[self._last] = why

    def lacks(self, why: str) -> None:
        """Record that a whole picture is missing before the last packet, which itself is undamaged."""
        self._broken.setdefault(self._last - 0.5, why)

    def lost(self, tick: int, why: str) -> None:
        """Record a missing frame; it is yielded as a lost frame at its place in the order."""
        self.hole(why)
        heapq.heappush(self._entered, (tick, self._last))

    def leaves(self, picture: av.VideoFrame) -> Iterator[Picture]:
        """Yield a picture that left the decoder, and before it the lost frames that belong there."""
        tick = picture.pts
        if tick in self._given_up:
            return  # after damage, a picture may leave too late: a lost frame has been yielded in its place
        number = picture.opaque if isinstance(picture.opaque, int) else self._last
        while tick is not None and self._entered and self._entered[0][0] <= tick:
            early, early_number = heapq.heappop(self._entered)
            if early == tick:
                break
            if self._broken:
                self._given_up.add(early)
                yield early, self._words(early_number)
        if picture.is_corrupt:
            self._broken.setdefault(number, "The frame was decoded with errors.")
        # A single flipped bit can mark a picture as a key frame, so that the container must mark it as well.
        since = number if picture.key_frame and number in self._stated_keys else self._recoveries.get(number)
        if since is not None and not any(since <= broken <= number for broken in self._broken):
            self._broken = {broken: why for broken, why in self._broken.items() if broken > number}
        if not self._broken:
            self._given_up.clear()
            self._stated_keys.clear()
            self._recoveries.clear()
        yield tick, self._words(number) if self._hangs_on_damage(number) else picture

    def rest(self) -> Iterator[Picture]:
        """Yield the damaged frames that were still expected when the recording ended."""
        while self._entered:
            tick, number = heapq.heappop(self._entered)
            if self._broken:
                yield tick, self._words(number)

    def _hangs_on_damage(self, number: int) -> bool:
        return any(broken <= number for broken in self._broken)

    def _words(self, number: int) -> str:
        own = self._broken.get(number)
        if own is not None:
            return own
        if self._hangs_on_damage(number):
            return "The frame is coded as a difference to a damaged frame."
        return "The frame was lost at a damaged place of the recording."


# Detect damage from time stamps: times that decrease, isolated jumps in a damaged file, missing frames.

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


def _usual(steps: deque[int]) -> float | None:
    """Time step of a regular series of times; None if the series is irregular."""
    if len(steps) < EVEN_STEPS:
        return None
    usual = sum(steps) / len(steps)
    even = usual > 0.0 and all(abs(step - usual) <= TICKS for step in steps)
    return usual if even else None


def _out_of_row(steps: deque[int], to_it: int, from_it: int) -> bool:
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
