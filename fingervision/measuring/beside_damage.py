"""Refuse a frame beside damaged ones if the motion in the rest of the recording does not lead to where its fingers are.

Where a file is damaged, a decoder may show a whole older picture: its fingers are sound, only not of this moment. In a
sound part of a recording such a jump is a motion; next to damage it is more likely that the picture is old. A body
between two frames moves no faster, and changes its speed no more, than it does elsewhere in the recording.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import LostFrame
from fingervision.domain.gap import GapMeasurement
from fingervision.domain.status import Status
from fingervision.measuring.finger_motion import JUMP_U, LEAST_JUMP_PX, Place, beside_path, place
from fingervision.measuring.frame_sequence import MOST_WAITING, Judged

# What the rest of the recording shows of speed and acceleration is a sample: the largest may be this much larger.
REST = 1.5
WORDS = (
    "Beside damaged frames, the fingers would have moved in this frame as nowhere else in the recording: the picture "
    "is likely an older one."
)


@dataclass(slots=True, eq=False)
class _Motion:
    """Largest speed and acceleration that frames apart from damage have shown so far, and the last two of these."""

    last: list[Place] = field(default_factory=list)
    speed_px_s: NDArray[np.float64] = field(default_factory=lambda: np.zeros(4))
    acceleration_px_s2: NDArray[np.float64] = field(default_factory=lambda: np.zeros(4))
    is_known: bool = False

    def add(self, here: Place) -> None:
        """Take the next frame apart from damage."""
        if self.last:
            speed_px_s = np.abs(here.px - self.last[-1].px) / (here.at - self.last[-1].at)
            self.speed_px_s = np.maximum(self.speed_px_s, speed_px_s)
        if len(self.last) == 2:
            off_px, _, square_s2 = _off(self.last, here)
            self.acceleration_px_s2 = np.maximum(self.acceleration_px_s2, np.abs(off_px) / square_s2)
            self.is_known = True
        self.last = [*self.last, here][-2:]

    def leads_to(self, here: Place, after: list[Place]) -> bool:
        """Whether the fingers can come from the last frames apart from damage to a place, and on to the next ones."""
        if not self.is_known:
            return True
        for near in [*self.last[-1:], *after[:1]]:
            reach_px = REST * self.speed_px_s * abs(here.at - near.at)
            noise_px = JUMP_U * np.hypot(here.u_px, near.u_px) + LEAST_JUMP_PX
            if np.any(np.abs(here.px - near.px) > reach_px + noise_px):
                return False
        sides = [pair for pair in (self.last, after[1::-1]) if len(pair) == 2]
        return not sides or any(self._foretells(pair, here) for pair in sides)

    def _foretells(self, pair: list[Place], here: Place) -> bool:
        off_px, u_px, square_s2 = _off(pair, here)
        # At least, the fingers may turn round between two frames.
        turned_px = 2.0 * self.speed_px_s * abs(here.at - pair[1].at)
        allowed_px = np.maximum(REST * self.acceleration_px_s2 * square_s2, turned_px) + JUMP_U * u_px + LEAST_JUMP_PX
        return bool(np.all(np.abs(off_px) <= allowed_px))


def confirmed_beside_damage(judged: Iterable[Judged]) -> Iterator[Judged]:
    """Yield the frames of a recording in order, after those beside damaged ones are compared with the others.

    A frame waits for two frames apart from damage behind it, and at most for `MOST_WAITING` frames.
    """
    motion, waiting, was_damaged = _Motion(), list[Judged](), False
    for one in chain(judged, [None]):
        waiting += [] if one is None else [one]
        while waiting and (known := _decided(motion, waiting, was_damaged, is_end=one is None)):
            was_damaged = _is_damaged(waiting.pop(0))
            yield known


def _decided(motion: _Motion, waiting: list[Judged], was_damaged: bool, *, is_end: bool) -> Judged | None:
    """The first waiting frame with its result, or None if it must wait."""
    item, outcome = waiting[0]
    if (here := _place(waiting[0])) is None:
        return waiting[0]
    if len(waiting) == 1 and not is_end:
        return None
    if not was_damaged and not (len(waiting) > 1 and _is_damaged(waiting[1])):
        motion.add(here)
        return item, outcome
    after = _apart(waiting, is_end=is_end)
    if len(after) < 2 and len(waiting) <= MOST_WAITING and not is_end:
        return None
    if motion.leads_to(here, after):
        return item, outcome
    return item, LostFrame(item.index, item.time_s, Status.DAMAGED, WORDS)


def _apart(waiting: list[Judged], *, is_end: bool) -> list[Place]:
    """The next two frames behind the first that have a gap and stand apart from damage."""
    found = list[Place]()
    for k in range(1, len(waiting) - (not is_end)):
        beside = waiting[k - 1 : k] + waiting[k + 1 : k + 2]
        if (there := _place(waiting[k])) is not None and not any(map(_is_damaged, beside)):
            found.append(there)
    return found[:2]


def _place(one: Judged) -> Place | None:
    item, outcome = one
    if not isinstance(outcome, GapMeasurement) or item.time_s is None:
        return None
    return place(item.time_s, outcome)


def _is_damaged(one: Judged) -> bool:
    outcome = one[1]
    return isinstance(outcome, LostFrame) and outcome.status is Status.DAMAGED


def _off(pair: list[Place], here: Place) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Distance from the straight line through two places, its u, and the square of time with which it grows."""
    return *beside_path(pair, here), abs((here.at - pair[1].at) * (here.at - pair[0].at)) / 2.0
