"""Refuse the measurement of a frame that the frames before and after it contradict.

A finger is a body: between two frames it moves, rotates and bends a little, at any speed, but it keeps its width and
its outline, and where it has gone, the ground is seen. Both fingers are held by one frame, so that along their own
direction neither moves without the other by more than it moves across. Wrong content in a picture (a page of memory
that was not written again, a lost packet that no checksum covers, an object that passes) has other outlines, or tears
the picture between two rows. A jump of the measuring points alone proves nothing, because stages make steps and springs
vibrate; nor does another outline alone, because parts come and go. A measurement is refused if its measuring points
jump, the fingers there have not the outlines that they have in the last frame, and the next frames do not confirm the
change.

Method: the outlines of a finger are followed from the measuring point towards its root, on the inner and on the outer
side, as the places where the grey level is half-way between finger and ground. Relative to that next to the measuring
point, and apart from a rotation, they must agree between two frames. Symmetric blur from motion or defocus, and a
change of the light, leave these places where they are. Where the fingers touch, or nearly do, no ground is seen between
them: their inner sides there are compared in no frame, and the measuring points themselves take their place.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from math import floor, hypot
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import FingerEdge, GapMeasurement, NoGap
from fingervision.domain.status import Status
from fingervision.measuring.finger_motion import JUMP_U, Place, jumps, place
from fingervision.vision.grey import to_grey

Outcome = GapMeasurement | NoGap | LostFrame
Judged = tuple[Frame | LostFrame, Outcome]
Floats = NDArray[np.float64]

# Number of successive frames with a gap that may all be unlike one another: more of them are no faults, but fingers
# that cannot be compared. Number of frames, with those without a gap, that may wait for one that confirms or refutes.
MOST_UNLIKE, MOST_WAITING = 4, 12
# Height of the bands of rows in which the outlines are compared; number of bands from the measuring point towards the
# root, and beyond the tip; and change of the share of finger-like pixels there that is no noise.
BAND_PX, BELOW, BEYOND, COVERED_SHARE = 8, 12, 6, 0.2
# Permitted difference between the outlines of one finger in two frames: for coarse coding (pixels), and for bending, as
# a share of the finger's displacement, up to a limit (pixels).
CODED_PX, BENT_SHARE, MOST_BENT_PX = 0.2, 0.1, 1.0
# Distance from an edge, in standard deviations of its blur, at which the levels of finger and ground are taken.
LEVEL_IN_BLURS = 3.0
# Standard deviation of a pixel's own width, the least blur of a picture.
PIXEL_PX = 12.0**-0.5
# Distance (pixels) within which the outline in a band is searched from the finger's straight side.
SEARCH_PX = 40
# Largest share of the bands that may differ, because a part between the fingers may hide most of the inner sides; and
# least number of bands for a judgement.
MOST_DIFFERENT, FEWEST_BANDS = 0.4, 4
# A finger is torn if this number of bands have its width (within a share), but stand elsewhere.
FEWEST_TORN, SAME_WIDTH = 2, 0.1
# A decoder that loses its place in a row shows all that follows elsewhere, and at other levels: a picture is torn if
# over one row more of its width changes, by this share, than over any row of the other picture. A change of a level
# counts from this share of the fingers' contrast.
TORN_SHARE, LEAST_STEP = 0.25, 0.08

TOUCH = NoGap(Status.TOUCHING, "The fingers touch: no gap is seen between them.")
WORDS = (
    "The fingers would have jumped in this frame alone, and their outlines are not those of the frames before and "
    "after it: the picture is damaged, or something passed in front of the fingers."
)


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """How a finger looks in a frame.

    Parameters
    ----------
    across_px : float
        Measuring point across the fingers.
    sides_px : ndarray, shape (2, bands)
        Inner and outer side across the fingers, in bands from the measuring point towards the root; NaN where unseen.
    beyond : ndarray, shape (bands beyond the tip,)
        Share of the pixels straight beyond the tip that look like the finger, in bands from the tip outwards.
    level : float
        Grey level of the edge.
    ends_px : tuple of int
        First pixel across the finger, and that behind its last; equal if the finger is not followed.
    """

    across_px: float
    sides_px: Floats
    beyond: Floats
    level: float
    ends_px: tuple[int, int]

    @property
    def is_comparable(self) -> bool:
        """Whether enough bands of the finger are in view for a judgement."""
        return bool(np.count_nonzero(np.isfinite(self.sides_px).any(axis=0)) >= FEWEST_BANDS)


class _Seen:
    """A frame with its gap, and how its two fingers look."""

    def __init__(self, frame: Frame, gap: GapMeasurement) -> None:
        self.frame, self.gap = frame, gap
        self.fingers = (gap.left, gap.right)

    @cached_property
    def looks(self) -> tuple[_Look, _Look]:
        """How the left and the right finger look, computed when first asked for."""
        return _look(self, self.gap.left, is_left=True), _look(self, self.gap.right, is_left=False)

    @cached_property
    def torn_share(self) -> float:
        """Largest share of the picture's width over which the grey level changes from a row to the next."""
        grey = to_grey(self.frame.pixels)
        least = LEAST_STEP * min(abs(one.contrast) for one in self.fingers)
        is_step = cv2.threshold(cv2.absdiff(grey[1:], grey[:-1]), least, 1.0, cv2.THRESH_BINARY)[1]
        kind = cv2.CV_32S if grey.dtype == np.uint8 else cv2.CV_64F
        steps: NDArray[Any] = cv2.reduce(is_step, 1, cv2.REDUCE_SUM, dtype=kind)
        return float(steps.max() / grey.shape[1])

    @cached_property
    def place(self) -> Place:
        """Edges and tips of both fingers."""
        return place(self.frame.index, self.gap)


class FrameSequence:
    """Judges the frames of one recording in order; at most `MOST_WAITING` frames wait for those behind them."""

    def __init__(self) -> None:
        self._sound: list[_Seen] = []
        self._waiting: list[Judged] = []
        self._suspects: list[_Seen] = []

    def add(self, item: Frame | LostFrame, outcome: Outcome) -> list[Judged]:
        """Take the next frame with its result, and return the frames on which the judgement is complete."""
        if (
            isinstance(item, Frame)
            and isinstance(outcome, NoGap)
            and outcome.status is Status.ONE_FINGER
            and item.time_s is not None
            and self._sound
            and _is_closed(self._sound[-1], item)
        ):
            outcome = TOUCH
        self._waiting.append((item, outcome))
        suspects = self._suspects
        # Pictures without times are not known to be successive.
        if isinstance(item, Frame) and isinstance(outcome, GapMeasurement) and item.time_s is not None:
            now = _Seen(item, outcome)
            suspects.append(now)
            if self._sound and (
                not jumps([one.place for one in self._sound], now.place) or _is_alike(self._sound[-1], now)
            ):
                return self._released(now)
            if len(suspects) > 1 and _is_alike(suspects[-2], now):
                return self._released(now)
            if len(suspects) > MOST_UNLIKE:
                return self._released(None)
        return self.finish() if not suspects or len(self._waiting) > MOST_WAITING else []

    def finish(self) -> list[Judged]:
        """Return the frames that wait, judged by the last sound frame, because no frame behind them can."""
        return self._released(self._sound[-1] if self._sound else None)

    def _released(self, judge: _Seen | None) -> list[Judged]:
        """Return the frames that wait, and refuse those unlike the judge; without one, none is refused."""
        suspects, self._suspects = self._suspects, []
        sound = [one for one in suspects if judge is None or one.frame is judge.frame or _is_alike(judge, one)]
        refused = {one.frame.index for one in suspects} - {one.frame.index for one in sound}
        waiting, self._waiting = self._waiting, []
        self._sound = (self._sound + sound)[-3:]
        return [
            (item, LostFrame(item.index, item.time_s, Status.DAMAGED, WORDS) if item.index in refused else outcome)
            for item, outcome in waiting
        ]


def in_sequence(judged: Iterable[Judged]) -> Iterator[Judged]:
    """Yield the frames of a recording in order, after they have been compared with those before and after them."""
    sequence = FrameSequence()
    for item, outcome in judged:
        yield from sequence.add(item, outcome)
    yield from sequence.finish()


def _is_alike(first: _Seen, second: _Seen) -> bool:
    """Whether both fingers have the same outlines in two frames, as far as these can be followed."""
    if first.gap.direction is not second.gap.direction or first.frame.pixels.shape != second.frame.pixels.shape:
        return False
    moved_px = np.abs(second.place.px - first.place.px)
    is_closed = _is_closed_in_bands(first, second)
    for k, (one, other) in enumerate(zip(first.fingers, second.fingers, strict=True)):
        bent_px = min(MOST_BENT_PX, BENT_SHARE * max(moved_px[k], moved_px[k + 2]))
        tolerance_px = JUMP_U * hypot(one.u_across_px, other.u_across_px) + CODED_PX + bent_px
        if not _agree(first.looks[k], second.looks[k], is_closed, tolerance_px):
            return False
    along_px = np.diff(second.place.px - first.place.px)[2]
    u_along_px = hypot(*first.place.u_px[2:], *second.place.u_px[2:])
    if abs(along_px) > JUMP_U * u_along_px + MOST_BENT_PX + max(moved_px[:2]):
        return False
    return not (
        abs(first.torn_share - second.torn_share) > TORN_SHARE
        or _shows_two_places(first, second)
        or _shows_two_places(second, first)
    )


def _is_closed_in_bands(*pair: _Seen) -> NDArray[np.bool_]:
    """Bands in which the gap of a frame is a few blurs at most, as seen there or as the other frame leads to expect."""
    count = min(look.sides_px.shape[1] for seen in pair for look in seen.looks)
    apart_px = np.array(
        [right.sides_px[0, :count] - left.sides_px[0, :count] for left, right in (s.looks for s in pair)]
    )
    gap_px = np.array([[seen.gap.gap_px] for seen in pair])
    # What stands on the other side of the other finger is no inner side.
    apart_px = np.where(apart_px > 0.0, apart_px, (apart_px - gap_px)[::-1] + gap_px)
    blur_px = max(PIXEL_PX, *(end.blur_px for seen in pair for end in seen.fingers))
    return np.asarray((apart_px < LEVEL_IN_BLURS * blur_px).any(axis=0))


def _shows_two_places(now: _Seen, other: _Seen) -> bool:
    """Whether a picture shows, beside its own fingers, a tip where a finger has it in another picture."""
    upright = other.gap.direction.is_vertical
    pixels = now.frame.pixels if upright else now.frame.pixels.swapaxes(0, 1)
    for finger, look in zip(other.fingers, other.looks, strict=True):
        columns = np.arange(*look.ends_px)
        for own in now.looks:
            columns = columns[(columns < own.ends_px[0] - BAND_PX) | (columns > own.ends_px[1] + BAND_PX)]
        towards_root = (finger.y_px if upright else finger.x_px) > finger.tip_px
        first = round(finger.tip_px) - (0 if towards_root else BAND_PX)
        tip = pixels[max(0, first) : first + BAND_PX, columns]
        if columns.size >= BAND_PX and tip.size and np.mean(_is_like(tip, now.gap, now.looks[0].level)) > 0.5:
            return True
    return False


def _is_closed(last: _Seen, frame: Frame) -> bool:
    """Whether what is seen at the measuring height is as wide as the two fingers of an earlier frame together."""
    upright = last.gap.direction.is_vertical
    pixels = frame.pixels if upright else frame.pixels.swapaxes(0, 1)
    if frame.pixels.shape != last.frame.pixels.shape:
        return False
    finger = last.fingers[0]
    along_px = finger.y_px if upright else finger.x_px
    first = max(0, round(along_px) - (0 if along_px > finger.tip_px else BAND_PX))
    covered = _is_like(pixels[first : first + BAND_PX], last.gap, last.looks[0].level).mean(axis=0) > 0.5
    # One finger alone is narrower, and what fills the gap leaves the outer sides where they were.
    unseen_px = max(0.5 * last.gap.gap_px, LEVEL_IN_BLURS * finger.blur_px)
    ground = np.flatnonzero(~covered) - last.place.px[:2].mean()
    before, behind = ground[ground < -0.5 * unseen_px], ground[ground > 0.5 * unseen_px]
    if not before.size or not behind.size:
        return False
    seen_px = float(behind[0] - before[-1] - 1.0)
    widths_px = [ends[1] - ends[0] for ends in (look.ends_px for look in last.looks)]
    return 0.5 * (sum(widths_px) + max(widths_px)) < seen_px < sum(widths_px) + unseen_px


def _is_like(pixels: NDArray[Any], gap: GapMeasurement, level: float) -> NDArray[np.bool_]:
    """Which pixels have a finger's grey level rather than that of the ground."""
    grey = to_grey(np.ascontiguousarray(pixels))
    return np.asarray(grey < level if gap.light_gap else grey > level)


def _agree(one: _Look, other: _Look, is_closed: NDArray[np.bool_], tolerance_px: float) -> bool:
    """Whether two outlines of a finger differ by no more than a rotation and a tolerance, beneath the same ground."""
    if one.is_comparable is not other.is_comparable:
        return False
    count = is_closed.size
    sides_px = np.stack((one.sides_px[:, :count], other.sides_px[:, :count]))
    sides_px[:, 0, is_closed] = np.nan
    is_seen = np.isfinite(sides_px).any(axis=0)
    if np.count_nonzero(is_seen) < FEWEST_BANDS:
        return True
    # Relative to the outline itself: an edge that is moved in one frame alone, such as by glare beside it that is not
    # told in the next frame, is no other outline.
    start_px = sides_px[:, 0, 0]
    sides_px -= (start_px if np.isfinite(start_px).all() else np.array([one.across_px, other.across_px]))[:, None, None]
    change = sides_px[1] - sides_px[0]
    heights_px = BAND_PX * np.arange(count)
    lower, upper = _pairs(count)
    turns = ((change[:, upper] - change[:, lower]) / (heights_px[upper] - heights_px[lower])).ravel()
    turns = turns[np.isfinite(turns)]
    turn = float(np.median(turns)) if turns.size else 0.0
    # Also different is a side that is known in one frame only.
    differs = is_seen & ~(np.abs(change - turn * heights_px) <= tolerance_px)
    widths_px = np.abs(sides_px[:, 1] - sides_px[:, 0])
    is_finger = np.all(np.abs(widths_px / widths_px[:, :1] - 1.0) < SAME_WIDTH, axis=0)
    is_torn = np.count_nonzero(is_finger & differs.all(axis=0)) >= FEWEST_TORN
    beyond = min(one.beyond.size, other.beyond.size)
    is_covered = np.abs(one.beyond[:beyond] - other.beyond[:beyond]) > COVERED_SHARE
    return not (
        is_torn
        or np.count_nonzero(differs) > MOST_DIFFERENT * np.count_nonzero(is_seen)
        or np.count_nonzero(is_covered) > MOST_DIFFERENT * beyond
    )


@cache
def _pairs(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    lower, upper = np.triu_indices(count, 1)
    return lower, upper


def _look(seen: _Seen, end: FingerEdge, is_left: bool) -> _Look:
    """Follow the outlines of a finger from its measuring point towards its root, and look beyond its tip."""
    vertical = seen.gap.direction.is_vertical
    upright: NDArray[Any] = seen.frame.pixels if vertical else seen.frame.pixels.swapaxes(0, 1)
    across_px, along_px = (end.x_px, end.y_px) if vertical else (end.y_px, end.x_px)
    tip_px = end.tip_px
    if along_px < tip_px:
        upright = upright[::-1]
        along_px, tip_px = upright.shape[0] - 1 - along_px, upright.shape[0] - 1 - tip_px
    first, tip = floor(along_px), max(0, round(tip_px) - BAND_PX)
    count = max(0, min(BELOW, (upright.shape[0] - 1 - first) // BAND_PX))
    if first < 0 or count == 0:
        return _Look(across_px, np.empty((2, 0)), np.empty(0), np.nan, (0, 0))
    # The levels are taken about the measuring height, where the gap is known: beside rounded tips it is another one
    # within half a band.
    reach = max(0, min(BAND_PX // 2, first, floor(along_px - tip_px)))
    rows = to_grey(np.ascontiguousarray(upright[first - reach : first + count * BAND_PX + 1])).astype(np.float32)
    middle, rows = rows[: 2 * reach + 1].mean(axis=0), rows[reach:]
    # The bands begin at the measuring height itself and not at a whole row: where the outline is curved, at a rounded
    # tip, a band half a row higher shows it at another place.
    rows = rows[:-1] + np.float32(along_px - first) * np.diff(rows, axis=0)
    size = (rows.shape[1], count)
    below = np.asarray(cv2.resize(rows, size, interpolation=cv2.INTER_AREA), dtype=np.float64)
    # The edge is measured at the measuring height, and the first band is centred half a band towards the root.
    inner_px = across_px + end.slope * 0.5 * (BAND_PX - 1)
    inwards = 1 if is_left else -1
    level = _half_level(middle, across_px, end.blur_px, inwards, seen.gap.gap_px)
    rises = (inwards > 0) is seen.gap.light_gap
    _, opposite = _crossings(below[:1], level, not rises)
    outside = opposite[inwards * (inner_px - opposite) > 0.0]
    outer_px = float(outside.max() if is_left else outside.min()) if outside.size else float("nan")
    sides = ((rises, inner_px), (not rises, outer_px))
    sides_px = np.array([_followed(below, level, *side, end.slope) for side in sides])
    ends = sorted((inner_px, inner_px - BAND_PX * inwards if np.isnan(outer_px) else outer_px))
    # The slope at a measuring point on the top of a tip leads out of the picture within a band.
    first_px, last_px = np.clip(ends, 0, rows.shape[1] - 1).astype(int).tolist()
    ends_px = first_px, last_px + 1
    bands = min(BEYOND, tip // BAND_PX)
    if not bands:
        return _Look(across_px, sides_px, np.empty(0), level, ends_px)
    over = _is_like(upright[tip - bands * BAND_PX : tip, slice(*ends_px)], seen.gap, level)
    return _Look(across_px, sides_px, over.reshape(bands, -1).mean(axis=1)[::-1], level, ends_px)


def _half_level(profile: Floats, edge_px: float, blur_px: float, inwards: int, gap_px: float) -> float:
    """Level half-way between finger and ground at an inner edge.

    Across a gap of a few blurs the level of the ground is nowhere reached; it follows from that in the gap's middle.
    """
    blur_px = max(blur_px, PIXEL_PX)
    apart_px = min(LEVEL_IN_BLURS * blur_px, 0.5 * gap_px)
    places = edge_px + inwards * np.array([-LEVEL_IN_BLURS * blur_px, apart_px])
    finger, between = np.interp(places, np.arange(profile.size), profile)
    reached = ndtr(apart_px / blur_px) - ndtr((apart_px - gap_px) / blur_px)
    return float(finger + 0.5 * (between - finger) / reached)


def _followed(bands: Floats, level: float, rises: bool, start_px: float, slope: float) -> Floats:
    """Places at which the profiles of the bands pass through a level, in each that next to a finger's straight side."""
    found = np.full(len(bands), np.nan)
    number, places = _crossings(bands, level, rises)
    apart = np.abs(places - (start_px + slope * BAND_PX * number))
    # Written from the farthest to the nearest, so that the nearest stays; none is near an unknown start.
    order = np.argsort(-apart)
    order = order[apart[order] < SEARCH_PX]
    found[number[order]] = places[order]
    return found


def _crossings(bands: Floats, level: float, rises: bool) -> tuple[NDArray[np.intp], Floats]:
    """Bands and places at which profiles pass through a level upwards (or downwards), linear between pixels."""
    above = bands > level
    number, at = np.nonzero(above[:, 1:] & ~above[:, :-1] if rises else above[:, :-1] & ~above[:, 1:])
    before = bands[number, at]
    return number, np.asarray(at + (level - before) / (bands[number, at + 1] - before))
