"""How far damage reaches in a coded video: from the broken packet to the next key frame."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from itertools import count

import av

Picture = tuple[int | None, av.VideoFrame | str]


class DamageTrail:
    """Follows packets into a decoder and pictures out of it.

    A picture that is coded as a difference hangs on those before it. After a packet that could not be decoded the
    decoder goes on with a guess, and pictures look whole and are wrong; so everything that was coded after the broken
    packet is damaged until a key frame. Packets and pictures are matched by their presentation times, because pictures
    leave in another order than packets enter.
    """

    def __init__(self) -> None:
        self._numbers = count()
        self._entered: list[tuple[int, int]] = []  # (tick, number in coded order) of packets whose picture is awaited
        self._last = -1
        self._broken_from: int | None = None
        self._why = ""
        self._given_up: set[int] = set()  # ticks of lost pictures since the damage

    def enters(self, packet: av.Packet[av.VideoStream]) -> None:
        """Note a packet that goes into the decoder."""
        self._last = next(self._numbers)
        if packet.is_corrupt:
            self.breaks("It is incomplete in the file.")
        if packet.pts is not None and not packet.is_discard:
            heapq.heappush(self._entered, (packet.pts, self._last))

    def breaks(self, why: str) -> None:
        """Note that the packet that went in last could not be decoded."""
        if self._broken_from is None:
            self._broken_from, self._why = self._last, why

    def leaves(self, picture: av.VideoFrame) -> Iterator[Picture]:
        """Give the picture that came out, after the lost ones that should have come before it."""
        tick = picture.pts
        if tick in self._given_up:
            return  # behind damage pictures may leave too late; its place is taken
        number = self._last
        while tick is not None and self._entered and self._entered[0][0] <= tick:
            early, early_number = heapq.heappop(self._entered)
            if early == tick:
                number = early_number
                break
            if self._broken_from is not None:
                self._given_up.add(early)
                yield early, self._words(early_number)
        if picture.is_corrupt and self._broken_from is None:
            self._broken_from, self._why = number, "It was decoded with errors."
        if (
            picture.key_frame
            and not picture.is_corrupt
            and self._broken_from is not None
            and number > self._broken_from
        ):
            self._broken_from = None
            self._given_up.clear()
        if self._hangs_on_damage(number):
            yield tick, self._words(number)
        else:
            yield tick, picture

    def rest(self) -> Iterator[Picture]:
        """Give what was still awaited behind damage when the recording ended."""
        while self._entered:
            tick, number = heapq.heappop(self._entered)
            if self._broken_from is not None:
                yield tick, self._words(number)

    def _hangs_on_damage(self, number: int) -> bool:
        return self._broken_from is not None and number >= self._broken_from

    def _words(self, number: int) -> str:
        if self._broken_from is None or number <= self._broken_from:
            return self._why
        return "It is coded as a difference to a frame that is damaged."
