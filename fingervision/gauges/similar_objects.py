"""Objects like the one that a gauge follows: which of those in a picture is its own, or that this cannot be told.

An own object may be covered or out of view, and may have moved meanwhile, so that the only object within reach can be a
similar one beside it. Each place at which the own object may be is therefore compared with the whole arrangement of
similar objects: those that the picture shows, and those that lay beside the own one when it was seen last.
"""

from dataclasses import dataclass
from math import ceil, hypot

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.gauges.picture import Picture
from fingervision.gauges.reading import GaugeStatus
from fingervision.vision.template_search import ALIKE_SHARE, BEYOND_PX, Template

Floats = NDArray[np.float64]

# No similar object may lie within this multiple of reach_px; a motion may then exceed reach_px by half without a
# confusion with a neighbouring object.
GUARD = 1.5
# Largest multiple of reach_px within which an object is searched after frames without a value.
MOST_TIMES = 4
# Distance (pixels) below which two places are the same; candidates are accurate to half a pixel, or one.
SAME_PX = 2.0
# What is alike to this share of the limit is not called absent, because noise may have moved it below the limit.
PRESENT_SHARE = 0.75


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """Objects like a gauge's own one in one picture.

    Parameters
    ----------
    places_px : ndarray of float, shape (n, 2)
        Places, relative to that at which the own object was seen last.
    is_alike : ndarray of bool, shape (n,)
        Whether the object may be the own one; the others only are not called absent.
    low_px, high_px : ndarray of float, shape (2,)
        Limits of the area in which every object would be seen.
    """

    places_px: Floats
    is_alike: NDArray[np.bool_]
    low_px: Floats
    high_px: Floats

    def lacks(self, places_px: Floats) -> NDArray[np.intp]:
        """Number of places in view, along the last axis but one, at which there is no object."""
        in_view = np.all((places_px >= self.low_px) & (places_px <= self.high_px), axis=-1)
        away = np.linalg.norm(places_px[..., None, :] - self.places_px, axis=-1)
        return np.asarray(np.sum(in_view & ~np.any(away <= SAME_PX, axis=-1), axis=-1))


def own_place(before: Seen, now: Seen, reach_px: float) -> Floats | GaugeStatus:
    """Place of the own object, or the status if none is seen or another one explains the picture as well.

    Parameters
    ----------
    before, now : Seen
        The picture in which the own object was seen last, at (0, 0), and the present picture.
    reach_px : float
        Largest distance by which the own object may have moved.
    """
    beside, seen = before.places_px[before.is_alike], now.places_px[now.is_alike]
    beside = np.concatenate((np.zeros((1, 2)), beside[np.linalg.norm(beside, axis=1) > SAME_PX]))
    places = (seen[:, None] - beside).reshape(-1, 2)
    places = places[np.linalg.norm(places, axis=1) <= reach_px]
    if not places.size:
        is_whole = now.low_px.max() <= -reach_px and now.high_px.min() >= reach_px
        return GaugeStatus.NOT_FOUND if is_whole else GaugeStatus.OUT_OF_VIEW
    # The own object may be covered: that it is not seen somewhere tells nothing. What else is missing or new does.
    doubts = now.lacks(places[:, None] + beside[1:]) + before.lacks(seen - places[:, None])
    best = places[np.argmin(doubts)]
    is_other = np.linalg.norm(places - best, axis=1) > SAME_PX
    away = np.linalg.norm(seen - best, axis=1)
    if np.any(doubts[is_other] <= doubts.min()) or away.min() > SAME_PX:
        return GaugeStatus.AMBIGUOUS
    return np.asarray(seen[np.argmin(away)])


def seen_alike(picture: Picture, template: Template, at_px: tuple[float, float], reach_px: float, least: float) -> Seen:
    """Objects like a template around a place.

    Parameters
    ----------
    picture : Picture
        The picture.
    template : Template
        The object.
    at_px : (float, float)
        Place at which the own object was seen last.
    reach_px : float
        How far around this place objects are sought.
    least : float
        Least correlation of an object with the template.
    """
    size = np.array(template.levels.shape[::-1])
    half = size // 2 + ceil(reach_px)
    corner = np.rint(at_px).astype(int) - half
    levels, origin = picture.part(*corner.tolist(), *(2 * half + 1).tolist())
    first = np.array(origin) - np.array(at_px) + 0.5 * (size - 1)
    last = first + levels.shape[::-1] - size
    if np.any(last < first):
        return Seen(np.zeros((0, 2)), np.zeros(0, dtype=bool), first, last)
    found = cv2.matchTemplate(levels.astype(np.float32), template.levels, cv2.TM_CCOEFF_NORMED)
    likeness = np.nan_to_num(found, posinf=0.0, neginf=0.0)
    limit = max(ALIKE_SHARE * float(likeness.max()), least)
    is_peak = likeness == cv2.dilate(likeness, np.ones(size[::-1] // 2 | 1, dtype=np.uint8))
    row, column = np.nonzero(is_peak & (likeness >= PRESENT_SHARE * limit))
    places, is_alike = np.stack((column, row), axis=1) + first, likeness[row, column] >= limit
    # A maximum at the border of the picture is none: what looks like the object continues beyond.
    is_whole = np.all((places > first + 0.5) & (places < last - 0.5), axis=1)
    return Seen(places[is_whole], is_alike[is_whole], first + SAME_PX, last - SAME_PX)


def only_place(
    picture: Picture, template: Template, at_px: tuple[float, float], reach_px: float, least: float
) -> tuple[float, float] | GaugeStatus:
    """The only place within reach that looks like a template, or the reason why there is none; as for `seen_alike`."""
    size = np.array(template.levels.shape[::-1])
    half = size // 2 + ceil(reach_px) + BEYOND_PX
    levels, (left, top) = picture.part(*(np.rint(at_px).astype(int) - half).tolist(), *(2 * half + 1).tolist())
    match = template.best_match(levels.astype(np.float32))
    if match.is_alone and match.correlation >= least:
        return left + match.x_px, top + match.y_px
    if levels.size < np.prod(2 * half + 1):
        return GaugeStatus.OUT_OF_VIEW
    return GaugeStatus.AMBIGUOUS if match.correlation >= least else GaugeStatus.NOT_FOUND


class Followed:
    """How long ago a gauge's own object was seen, and in which picture: what every kind of gauge keeps.

    Parameters
    ----------
    reach_px : float
        Largest distance by which the object may move from frame to frame.
    """

    def __init__(self, reach_px: float) -> None:
        self.reach_px, self.missed = reach_px, 0
        self.last: Picture | None = None

    @property
    def times(self) -> int:
        """Multiple of `reach_px` by which the object may have moved since it was seen last."""
        return min(1 + self.missed, MOST_TIMES)

    @property
    def wide_px(self) -> float:
        """Half width of the area in which similar objects are sought."""
        return GUARD * MOST_TIMES * self.reach_px

    def lost(self) -> None:
        """Note that the object was not seen in a frame, or that the frame was not read."""
        self.missed += 1

    def kept(self, picture: Picture) -> None:
        """Note the picture in which the object was seen."""
        self.last, self.missed = picture, 0

    def similar(self, picture: Picture) -> Seen:
        """Objects like the own one around the place at which it was seen last."""
        raise NotImplementedError

    def is_doubtful(self, away_px: float) -> bool:
        """Whether the only object in the zone may have come from beyond the zone, while the own one was covered."""
        return self.missed > 0 or abs(away_px) > (GUARD - 1.0) * self.reach_px

    def own_place(self, picture: Picture) -> Floats | GaugeStatus:
        """Place of the own object relative to that at which it was seen last, or the reason why it is not told."""
        if self.last is None:
            return GaugeStatus.NOT_FOUND
        return own_place(self.similar(self.last), self.similar(picture), GUARD * self.reach_px * self.times)

    def place_of(
        self, picture: Picture, template: Template, at_px: tuple[float, float], least: float
    ) -> tuple[float, float] | GaugeStatus:
        """Place of the own object in the picture, or the reason why it is not told; as for `seen_alike`."""
        if not self.missed:
            found = only_place(picture, template, at_px, GUARD * self.reach_px, least)
            if isinstance(found, GaugeStatus) or not self.is_doubtful(hypot(found[0] - at_px[0], found[1] - at_px[1])):
                return found
        place = self.own_place(picture)
        return place if isinstance(place, GaugeStatus) else (at_px[0] + float(place[0]), at_px[1] + float(place[1]))
