"""Position of a printed mark: a dot, a cross, or a corner of a chessboard."""

from dataclasses import dataclass
from math import ceil, hypot, sqrt
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.field import Field
from fingervision.gauges.common_keys import REACH_PX, Placed, Reach
from fingervision.gauges.picture import Picture
from fingervision.gauges.quantities import Position
from fingervision.gauges.reading import GaugeStatus, Mark, Reading
from fingervision.gauges.similar_objects import GUARD, Followed, Seen, only_place, seen_alike
from fingervision.gauges.straight_edge import CONTRAST_FLOOR
from fingervision.vision.symmetry_fit import BEYOND_PX as WINDOW_BEYOND_PX
from fingervision.vision.symmetry_fit import NoSymmetryError, Symmetric, fit_symmetry
from fingervision.vision.template_search import Template

QUANTITIES = (("x", "length"), ("y", "length"))
SHAPES = ("dot", "cross", "corner")
SMALLEST_PX, LARGEST_PX = 7.0, 301.0
# Smallest correlation of a mark with itself after half a turn; noise of a third of the mark's standard deviation gives
# this value.
LEAST_SYMMETRY = 0.9
# Limits of the correlations that distinguish shapes: a dot is the same after any rotation, a cross only after a quarter
# turn, and the corner of a chessboard becomes its negative after a quarter turn.
LEAST_ROUND, LEAST_QUARTER = 0.9, 0.75
# Largest distance, as a share of the mark's size, between the stated centre and the centre in the first frame.
NEAR = 0.35
# Smallest zero-normalised cross-correlation of a mark with its template from the first frame (the same limit as for
# patches).
LEAST_CORRELATION = 0.7
# Largest decrease, since the first frame, of a mark's correlation with itself after a quarter turn, and factor by which
# the decrease due to noise may grow. An object that covers a tenth of a dot's diameter displaces the centre by 0.3 px
# and reduces the correlation by 0.02.
MOST_SHAPE_LOSS, MOST_NOISE_LOSS = 0.01, 2.0
# Largest standard uncertainty of an accepted centre (pixels).
LEAST_SURE_PX = 0.5


@dataclass(frozen=True, slots=True)
class MarkerSpec(Placed):
    """Settings of a marker gauge: centre in the first frame, window size, shape, and how far the mark may move."""

    size_px: Annotated[
        float, Field("side of a window that contains a `marker`", "px", low=SMALLEST_PX, high=LARGEST_PX)
    ]
    shape: Annotated[str, Field("of a `marker`: `dot`, `cross` or `corner`", of=SHAPES)]
    reach_px: Reach = REACH_PX

    def follower(self) -> "FollowedMarker":
        """Return a new follower, for the first frame of a recording."""
        return FollowedMarker(self)


SPEC = MarkerSpec


class FollowedMarker(Followed):
    """Tracks one mark through the frames of one recording."""

    def __init__(self, spec: MarkerSpec) -> None:
        super().__init__(spec.reach_px)
        self._spec = spec
        self._half = max(int(spec.size_px) // 2, 3)
        self._at = spec.middle_px
        self._template: Template | None = None
        self._first: Symmetric | None = None

    def _zone(self) -> Mark:
        (x, y), half = self._at, self._half
        return Mark(tuple((x + a * half, y + b * half) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))))

    def measured(self, picture: Picture) -> Reading:
        """Measure the next frame."""
        zone = self._zone()
        found = self._found(picture)
        if isinstance(found[0], GaugeStatus):
            self.lost()
            status, words = found
            return Reading(status, zone=zone, words=words)
        (x, y), covariance = found
        self._at = (x, y)
        self.kept(picture)
        quantities = (
            Position((x, y), 0.0, sqrt(float(covariance[0, 0]))),
            Position((x, y), 0.5 * np.pi, sqrt(float(covariance[1, 1]))),
        )
        return Reading(GaugeStatus.OK, quantities, (Mark(((x, y),)),), zone)

    def _found(self, picture: Picture) -> tuple[tuple[float, float], NDArray[np.float64]] | tuple[GaugeStatus, str]:
        near = self._near(picture)
        if isinstance(near[0], GaugeStatus):
            return near[0], str(near[1])
        best: tuple[Symmetric, tuple[float, float]] | None = None
        status, words = GaugeStatus.NOT_FOUND, ""
        for start in near:
            fitted = self._fitted(picture, start)
            if isinstance(fitted[0], GaugeStatus):
                status, words = fitted[0], str(fitted[1])
            elif best is None or fitted[0].half_turn > best[0].half_turn:
                best = fitted
        if best is None:
            return status, words
        found, place = best
        away = hypot(place[0] - self._at[0], place[1] - self._at[1])
        first_reach = min(self._spec.reach_px, NEAR * self._spec.size_px)
        if away > (first_reach if self._template is None else self.reach_px * self.times) + 1.0:
            return GaugeStatus.NOT_FOUND, "the mark is farther away than reach_px permits"
        if self._template is None:
            refused = self._taken(picture, place)
            if refused is not None:
                return refused
            self._first = found
        if self._first is not None and _is_cut(found, self._first):
            return GaugeStatus.NOT_FOUND, "the mark has changed its shape: an object may cover a part of the mark"
        return place, found.covariance

    def _near(self, picture: Picture) -> list[tuple[float, float]] | tuple[GaugeStatus, str]:
        """Initial estimates of the mark's centre, or the reason why there are none."""
        x, y = self._at
        if self._template is None:
            step = max(NEAR * self._spec.size_px * 0.7, 1.0)
            reach = min(self._spec.reach_px, NEAR * self._spec.size_px)
            offsets = [0.0] if step > reach else [-step, 0.0, step]
            return [(x + across, y + down) for across in offsets for down in offsets]
        place = self.place_of(picture, self._template, (x, y), LEAST_CORRELATION)
        return (place, "") if isinstance(place, GaugeStatus) else [place]

    def similar(self, picture: Picture) -> Seen:
        """Marks like the own one around its last place."""
        template = self._template or Template(np.zeros((1, 1), dtype=np.float32))
        return seen_alike(picture, template, self._at, self.wide_px, LEAST_CORRELATION)

    def _fitted(
        self, picture: Picture, start: tuple[float, float]
    ) -> tuple[Symmetric, tuple[float, float]] | tuple[GaugeStatus, str]:
        half = self._half + WINDOW_BEYOND_PX + ceil(NEAR * self._spec.size_px)
        left, top = round(start[0]) - half, round(start[1]) - half
        levels, origin = picture.part(left, top, 2 * half + 1, 2 * half + 1)
        width, height = levels.shape[1], levels.shape[0]
        if min(width, height) < 2 * (self._half + 4):
            return GaugeStatus.OUT_OF_VIEW, ""
        try:
            found = fit_symmetry(
                levels.astype(np.float32), (start[0] - origin[0], start[1] - origin[1]), self._half,
                picture.shared_pixels,
            )  # fmt: skip
        except NoSymmetryError as why:
            is_cut = (width, height) != (2 * half + 1, 2 * half + 1)
            return (GaugeStatus.OUT_OF_VIEW if is_cut else GaugeStatus.NOT_FOUND), str(why)
        except np.linalg.LinAlgError:
            return GaugeStatus.LOW_CONTRAST, ""
        if found.spread < CONTRAST_FLOOR * picture.top:
            return GaugeStatus.LOW_CONTRAST, ""
        if found.half_turn < LEAST_SYMMETRY:
            return GaugeStatus.NOT_FOUND, "the mark is not symmetric under half a turn"
        if not self._has_shape(found):
            return GaugeStatus.NOT_FOUND, f"the shape of the mark is not a {self._spec.shape}"
        if not float(np.max(np.diag(found.covariance))) < LEAST_SURE_PX**2:
            return GaugeStatus.LOW_CONTRAST, "the mark does not determine its position in one direction"
        return found, (found.x_px + origin[0], found.y_px + origin[1])

    def _has_shape(self, found: Symmetric) -> bool:
        if self._spec.shape == "dot":
            return found.any_turn > LEAST_ROUND
        if self._spec.shape == "cross":
            return found.quarter_turn > LEAST_QUARTER and found.any_turn <= LEAST_ROUND
        return found.quarter_turn < -LEAST_QUARTER

    def _taken(self, picture: Picture, place: tuple[float, float]) -> tuple[GaugeStatus, str] | None:
        """Store the mark's picture as a template; return the reason if a similar mark is within reach."""
        x, y = round(place[0]), round(place[1])
        own, _ = picture.part(x - self._half, y - self._half, 2 * self._half + 1, 2 * self._half + 1)
        if own.shape != (2 * self._half + 1, 2 * self._half + 1):
            return GaugeStatus.OUT_OF_VIEW, ""
        template = Template(own.astype(np.float32))
        alone = only_place(picture, template, (x, y), GUARD * self.reach_px * self.times, LEAST_CORRELATION)
        if isinstance(alone, GaugeStatus):
            return GaugeStatus.AMBIGUOUS, "a similar mark lies within 1.5 times reach_px for each frame since the first"
        self._template = template
        return None


def _is_cut(found: Symmetric, first: Symmetric) -> bool:
    """Whether a mark is less symmetric than in the first frame by more than noise explains."""
    by_noise = (first.noise / max(found.spread, 1e-12)) ** 2
    allowed = MOST_SHAPE_LOSS + MOST_NOISE_LOSS * max(by_noise, 1.0 - abs(first.quarter_turn))
    return 1.0 - abs(found.quarter_turn) > allowed
