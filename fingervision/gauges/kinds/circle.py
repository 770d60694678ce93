"""Centre and diameter of a disc or hole."""

from dataclasses import dataclass
from math import ceil, hypot, sqrt
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.field import Field
from fingervision.gauges.common_keys import REACH_PX, Placed, Reach
from fingervision.gauges.picture import Picture
from fingervision.gauges.quantities import Distance, Position
from fingervision.gauges.reading import GaugeStatus, Mark, Reading
from fingervision.gauges.similar_objects import GUARD, Followed, Seen, seen_alike
from fingervision.gauges.straight_edge import (
    CONTRAST_FLOOR,
    LARGEST_BLUR_PX,
    LEAST_OF_KNOWN,
    LEAST_PIECE,
    LEAST_SURE_PX,
    MOST_NOISE,
    MOST_OF_KNOWN,
)
from fingervision.vision.circle_fit import Circle, NoCircleFitError, fit_circle
from fingervision.vision.response_shift import u_edge_px
from fingervision.vision.straight_edge_fit import reach_px
from fingervision.vision.template_search import BEYOND_PX, Template

QUANTITIES = (("x", "length"), ("y", "length"), ("diameter", "length"))
POLARITIES = {"any": 0, "light": 1, "dark": -1}
SMALLEST_PX, LARGEST_PX = 5.0, 5000.0
# Radius of a disc in the reduced picture in which it is searched; the fit then starts within about a pixel.
SEARCH_RADIUS_PX = 8.0
# Diameters that are tried in the first frame, as shares of the stated diameter. Limits of the fitted diameter, also as
# shares; largest relative change from frame to frame.
TRIED = (0.8, 0.9, 1.0, 1.1, 1.25)
LEAST_STATED, MOST_STATED, MOST_GROWTH = 0.7, 1.4, 0.1
# Smallest correlation of a disc with its template, and width of the template's surroundings as a share of the radius.
LEAST_CORRELATION, SURROUNDINGS = 0.6, 0.5
# Largest deviation of a sixteenth of the outline from the circle, as a share of the radius.
MOST_UNROUND = 0.05


@dataclass(frozen=True, slots=True)
class CircleSpec(Placed):
    """Settings of a circle gauge: centre and diameter in the first frame, largest motion, and dark or light."""

    diameter_px: Annotated[float, Field("diameter of a `circle`", "px", low=SMALLEST_PX, high=LARGEST_PX)]
    reach_px: Reach = REACH_PX
    polarity: Annotated[str, Field("of a `circle`: `any` (the default), `light` or `dark`", of=tuple(POLARITIES))] = (
        "any"
    )

    def follower(self) -> "FollowedCircle":
        """Return a new follower, for the first frame of a recording."""
        return FollowedCircle(self)


SPEC = CircleSpec


class FollowedCircle(Followed):
    """Tracks one disc or hole through the frames of one recording."""

    def __init__(self, spec: CircleSpec) -> None:
        super().__init__(spec.reach_px)
        self._spec = spec
        self._at = (*spec.middle_px, 0.5 * spec.diameter_px)
        self._known: Circle | None = None

    def _zone(self) -> Mark:
        x, y, radius = self._at
        half = radius + self._spec.reach_px
        return Mark(tuple((x + a * half, y + b * half) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))))

    def measured(self, picture: Picture) -> Reading:
        """Measure the next frame."""
        zone = self._zone()
        found = self._found(picture)
        if not isinstance(found, Circle):
            self.lost()
            status, words = found
            return Reading(status, zone=zone, words=words)
        self.kept(picture)
        self._known, self._at = found, (found.x_px, found.y_px, found.radius_px)
        displaced = _displaced_px(picture, found)
        u_x, u_y, u_radius = (hypot(sqrt(float(found.covariance[i, i])), displaced) for i in range(3))
        centre, radius = (found.x_px, found.y_px), found.radius_px
        ends = ((centre[0] - radius, centre[1]), (centre[0] + radius, centre[1]))
        quantities = (
            Position(centre, 0.0, u_x),
            Position(centre, 0.5 * np.pi, u_y),
            Distance(*ends, 2.0 * u_radius, 1 if found.contrast > 0.0 else -1, _u_response(picture, found)),
        )
        turn = np.linspace(0.0, 2.0 * np.pi, 61)
        outline = tuple((centre[0] + radius * float(np.cos(a)), centre[1] + radius * float(np.sin(a))) for a in turn)
        return Reading(GaugeStatus.OK, quantities, (Mark(outline), Mark((centre,))), zone)

    def _found(self, picture: Picture) -> Circle | tuple[GaugeStatus, str]:
        x, y, _ = self._at
        start = self._start(picture)
        if isinstance(start[0], GaugeStatus):
            return start[0], str(start[1])
        at_x, at_y, at_radius, slack = start
        blur = self._known.blur_px if self._known is not None else 1.2
        wide = hypot(blur, slack)
        half = ceil(at_radius + reach_px(wide) + 2.0)
        levels, origin = picture.part(round(at_x) - half, round(at_y) - half, 2 * half + 1, 2 * half + 1)
        try:
            found = fit_circle(levels, origin, (at_x, at_y, at_radius), wide, picture.edge_shared_pixels)
        except (NoCircleFitError, np.linalg.LinAlgError) as why:
            return GaugeStatus.NOT_FOUND, str(why)
        refused = self._refused(picture, found)
        if refused is not None:
            return refused
        reach = self.reach_px * (self.times if self._known is not None else 1)
        if hypot(found.x_px - x, found.y_px - y) > reach + 1.0:
            return GaugeStatus.NOT_FOUND, "the disc is farther away than reach_px permits"
        return found

    def _refused(self, picture: Picture, found: Circle) -> tuple[GaugeStatus, str] | None:
        radius, stated = found.radius_px, 0.5 * self._spec.diameter_px
        band = radius + reach_px(found.blur_px) - 2.0
        if not picture.holds(found.x_px - band, found.y_px - band, 2.0 * band, 2.0 * band):
            return GaugeStatus.OUT_OF_VIEW, ""
        if found.blur_px >= LARGEST_BLUR_PX:
            return GaugeStatus.BLURRED, ""
        if abs(found.contrast) < CONTRAST_FLOOR * picture.top or found.noise > MOST_NOISE * abs(found.contrast):
            return GaugeStatus.NOT_FOUND, "the outline has too little contrast"
        if POLARITIES[self._spec.polarity] * found.contrast < 0.0:
            return GaugeStatus.NOT_FOUND, "the disc has the opposite polarity"
        if found.least_piece < LEAST_PIECE or found.unround_px > MOST_UNROUND * radius:
            return GaugeStatus.NOT_FOUND, "the outline is not a complete circle"
        if not LEAST_STATED * stated <= radius <= MOST_STATED * stated:
            return GaugeStatus.NOT_FOUND, "the diameter is too far from diameter_px"
        known = self._known
        if known is not None and not (
            abs(radius / known.radius_px - 1.0) < MOST_GROWTH
            and LEAST_OF_KNOWN <= found.contrast / known.contrast <= MOST_OF_KNOWN
        ):
            return GaugeStatus.NOT_FOUND, "diameter or contrast differ too much from those in the previous frame"
        if not 0.0 < float(np.max(np.diag(found.covariance))) < LEAST_SURE_PX**2:
            return GaugeStatus.LOW_CONTRAST, ""
        return None

    def similar(self, picture: Picture) -> Seen:
        """Discs like the own one around its last place."""
        (x, y, radius), sign = self._at, 1 if self._known is None or self._known.contrast > 0.0 else -1
        return seen_alike(picture, Template(sign * _disc(radius)), (x, y), self.wide_px, LEAST_CORRELATION)

    def _start(self, picture: Picture) -> tuple[float, float, float, float] | tuple[GaugeStatus, str]:
        """Initial estimates of centre and radius in the next frame, with their uncertainties."""
        x, y, radius = self._at
        if self._known is None or not self.missed:
            found = self._only_disc(picture)
            if self._known is None or isinstance(found[0], GaugeStatus):
                return found
            if not self.is_doubtful(hypot(found[0] - x, float(found[1]) - y)):
                return found
        place = self.own_place(picture)
        return (place, "") if isinstance(place, GaugeStatus) else (x + place[0], y + place[1], radius, 0.6)

    def _only_disc(self, picture: Picture) -> tuple[float, float, float, float] | tuple[GaugeStatus, str]:
        x, y, radius = self._at
        tried = TRIED if self._known is None else (1.0,)
        by = max(1, int(radius / SEARCH_RADIUS_PX))
        reach = GUARD * self.reach_px * self.times
        half = ceil((radius * max(tried) * (1.0 + SURROUNDINGS) + reach) / by) + BEYOND_PX + 2
        side = (2 * half + 1) * by
        left, top = round(x) - side // 2, round(y) - side // 2
        levels, origin = picture.part(left, top, side, side)
        if levels.shape != (side, side):
            if min(levels.shape) < 2:
                return GaugeStatus.OUT_OF_VIEW, ""
            before = (origin[0] - left, origin[1] - top)
            after = (side - levels.shape[1] - before[0], side - levels.shape[0] - before[1])
            levels = np.pad(levels, ((before[1], after[1]), (before[0], after[0])), mode="edge")
        small = levels.reshape(2 * half + 1, by, 2 * half + 1, by).mean(axis=(1, 3)).astype(np.float32)
        sign = POLARITIES[self._spec.polarity] if self._known is None else (1 if self._known.contrast > 0.0 else -1)
        best = None
        for share in tried:
            template = _disc(share * radius / by)
            places = half - template.shape[0] // 2 - ceil(reach / by)
            beyond = max(min(places, half - template.shape[0] // 2 - 1), 1)
            for tone in (1, -1) if sign == 0 else (sign,):
                match = Template(tone * template).best_match(small, beyond)
                if best is None or match.correlation > best[0].correlation:
                    best = (match, share)
        assert best is not None  # noqa: S101 - there are diameters to try
        match, share = best
        if match.correlation < LEAST_CORRELATION:
            return GaugeStatus.NOT_FOUND, ""
        if not match.is_alone:
            return GaugeStatus.AMBIGUOUS, "another disc lies within 1.5 times reach_px"
        at_x, at_y = (corner + (place + 0.5) * by - 0.5 for corner, place in ((left, match.x_px), (top, match.y_px)))
        slack = 0.3 * by + (0.05 * radius if self._known is None else 0.0)
        return at_x, at_y, share * radius, min(slack, 2.5)


def _disc(radius: float) -> NDArray[np.float32]:
    """Template of a disc: a picture of its soft edge and its surroundings."""
    half = ceil(radius * (1.0 + SURROUNDINGS)) + 1
    y, x = np.mgrid[-half : half + 1, -half : half + 1]
    disc = np.clip(radius + 0.5 - np.hypot(x, y), 0.0, 1.0).astype(np.float32)
    return np.asarray(cv2.GaussianBlur(disc, (0, 0), 0.7), dtype=np.float32)


def _displaced_px(picture: Picture, found: Circle) -> float:
    """Uncertainty of centre and radius (px) due to codec errors that all pixels on one side of the outline share."""
    half = found.radius_px + reach_px(found.blur_px)
    # The fit's levels are not kept; an outline of this contrast in the middle of the scale stands for it.
    inside = 0.5 * (picture.top - found.contrast)
    return picture.displaced_px((found.x_px, found.y_px), (half, half), inside, found.contrast) / sqrt(2.0)


def _u_response(picture: Picture, found: Circle) -> float:
    """Uncertainty of the outline's position due to an unknown camera response."""
    # The fit's levels are not kept; an outline of this contrast in the middle of the scale stands for it.
    share = min(abs(found.contrast) / picture.top, 1.0)
    levels = (0.5 - 0.5 * share, 0.5 + 0.5 * share)
    return u_edge_px(picture.settings.camera.response, *levels, found.blur_px)
