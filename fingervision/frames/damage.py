"""Extent of damage in a coded video: from the broken packet to the next key frame."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
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
