"""Displacement and rotation of a textured piece of surface since the first frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, cos, hypot, sin, sqrt
from typing import Annotated

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.field import Field
from fingervision.gauges.common_keys import REACH_PX, Placed, Reach
from fingervision.gauges.picture import Picture
from fingervision.gauges.quantities import Angle, Shift
from fingervision.gauges.reading import GaugeStatus, Mark, Reading
from fingervision.gauges.similar_objects import GUARD, Followed, Seen, seen_alike
from fingervision.vision.patch_covariance import reference_covariance
from fingervision.vision.patch_reference import MARGIN_PX, PatchReference, patch_reference
from fingervision.vision.patch_registration import register
from fingervision.vision.template_search import BEYOND_PX, Template, chance_correlation, high_pass_noise

QUANTITIES = (("shift_x", "length"), ("shift_y", "length"), ("rotation", "angle"))
SMALLEST_PX, LARGEST_PX = 9.0, 501.0
SIZE = "size of a `patch`"
# Smallest correlation of a patch with its template; noise of two thirds of the texture's standard deviation gives this
# value. A coarse texture needs a higher correlation than chance would give; if chance gives more than the second value,
# the patch is too small for its texture.
LEAST_CORRELATION, MOST_BY_CHANCE = 0.7, 0.9
# Share of this correlation that is enough before the registration, which then increases it.
NEARLY = 0.8
# Rotation of the patch relative to its template (radians) above which the template is rotated too; at a distance of 15
# px from the centre, this rotation is a displacement of 1.5 px.
TURN_AT = 0.1
# Largest standard uncertainty of an accepted position (pixels).
LEAST_SURE_PX = 0.3
# Largest standard deviation of the displacement (pixels, at the worst sub-pixel phase) by which texture too fine for
# the pixels may falsify a patch's position. Above this limit, thin lines jump from one column of pixels to the next:
# the intervals contained 96 to 99 % of the true values below the limit, and 90 % above (`python -m
# tests.benchmarks.gauges --only drawings photographs`, without optics).
MOST_ALIASED_PX = 0.04
# Least contrast per pixel (grey levels); less contrast is rounding.
LEAST_SPREAD = 1.0

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class PatchSpec(Placed):
    """Settings of a patch gauge: centre and size in the first frame, and how far the patch may move."""

    width_px: Annotated[float, Field(SIZE, "px", low=SMALLEST_PX, high=LARGEST_PX)]
    height_px: Annotated[float, Field(SIZE, "px", low=SMALLEST_PX, high=LARGEST_PX)]
    reach_px: Reach = REACH_PX

    def follower(self) -> "FollowedPatch":
        """Return a new follower, for the first frame of a recording."""
        return FollowedPatch(self)


SPEC = PatchSpec


class FollowedPatch(Followed):
    """Tracks one patch through the frames of one recording."""

    def __init__(self, spec: PatchSpec) -> None:
        super().__init__(spec.reach_px)
        self._spec = spec
        self.half = (max(int(spec.width_px) // 2, 4), max(int(spec.height_px) // 2, 4))
        self.reference: PatchReference | None = None
        self._around: Floats | None = None
        self._template: Template | None = None
        self._template_turn = 0.0
        self._least_correlation = LEAST_CORRELATION
        self._refused: Reading | None = None
        self._at = (*spec.middle_px, 0.0)

    def measured(self, picture: Picture) -> Reading:
        """Measure the next frame."""
        return FollowedPatch.measured_with([self], picture)[0]

    @staticmethod
    def measured_with(followers: Sequence["FollowedPatch"], picture: Picture) -> list[Reading]:
        """Measure several patches in the next frame; patches of the same size are registered together."""
        readings: dict[int, Reading] = {}
        waiting: dict[tuple[int, ...], list[tuple[int, Floats, tuple[int, int], NDArray[np.float64]]]] = {}
        for number, follower in enumerate(followers):
            if follower.reference is None:
                readings[number] = follower.begun(picture)
                continue
            sought = follower.sought(picture)
            if isinstance(sought, Reading):
                readings[number] = sought
                continue
            part, corner, start = sought
            waiting.setdefault((part.shape[0], part.shape[1], *follower.half), []).append((number, part, corner, start))
        for group in waiting.values():
            own = [followers[number] for number, _, _, _ in group]
            found = register(
                [follower.reference for follower in own if follower.reference is not None],
                [part for _, part, _, _ in group],
                np.array([corner for _, _, corner, _ in group], dtype=np.float64),
                np.array([start for _, _, _, start in group]),
                picture.shared_pixels,
            )
            for k, (number, _, _, _) in enumerate(group):
                place = (float(found.x_px[k]), float(found.y_px[k]), float(found.turn_rad[k]))
                readings[number] = own[k].taken(
                    place, found.covariance[k], float(found.correlation[k]), bool(found.settled[k]),
                    float(found.aliasing_px[k]), picture,
                )  # fmt: skip
        return [readings[number] for number in range(len(followers))]

    def _zone(self) -> Mark:
        x, y, turn = self._at
        a, b = self.half
        corners = ((-a, -b), (a, -b), (a, b), (-a, b), (-a, -b))
        return Mark(tuple((x + cos(turn) * u - sin(turn) * v, y + sin(turn) * u + cos(turn) * v) for u, v in corners))

    def _never(self, status: GaugeStatus, words: str) -> Reading:
        """Record that the first frame has no texture for the registration, so that no frame can give a value."""
        self._refused = Reading(status, zone=self._zone(), words=words)
        return self._refused

    def _failed(self, status: GaugeStatus, words: str = "") -> Reading:
        self.lost()
        return Reading(status, zone=self._zone(), words=words)

    def begun(self, picture: Picture) -> Reading:
        """Take the template from the first readable frame; a later template would change the zero of displacement."""
        if self._refused is not None:
            return self._refused
        (a, b), (x, y) = self.half, self._spec.middle_px
        column, row = round(x), round(y)
        if not picture.holds(column - a, row - b, 2 * a + 1, 2 * b + 1):
            return self._never(GaugeStatus.OUT_OF_VIEW, "a part of the patch lies outside the first frame")
        reach = ceil(GUARD * self._spec.reach_px) + BEYOND_PX + MARGIN_PX
        part = _padded(picture, column - a - reach, row - b - reach, 2 * (a + reach) + 1, 2 * (b + reach) + 1)
        reference = patch_reference(part, a + reach, b + reach, a, b)
        covariance = reference_covariance(reference, high_pass_noise(reference.template))
        spread = float(np.sqrt(np.mean(reference.levels.astype(np.float64) ** 2)))
        if spread < LEAST_SPREAD or not max(covariance[0, 0], covariance[1, 1]) < LEAST_SURE_PX**2:
            return self._never(
                GaugeStatus.LOW_CONTRAST, "in the first frame, the patch has too little texture to determine its motion"
            )
        template = Template(reference.template)
        if not template.best_match(part[MARGIN_PX:-MARGIN_PX, MARGIN_PX:-MARGIN_PX]).is_alone:
            return self._never(
                GaugeStatus.AMBIGUOUS, "the texture of the patch repeats within 1.5 times reach_px: reduce reach_px"
            )
        chance = chance_correlation(reference.template)
        if chance > MOST_BY_CHANCE:
            return self._never(
                GaugeStatus.LOW_CONTRAST, "the texture is too coarse for the size of the patch: enlarge the patch"
            )
        self._least_correlation = max(LEAST_CORRELATION, chance)
        self.reference = reference
        self._around, self._template = part, template
        self._at = (float(column), float(row), 0.0)
        self.kept(picture)
        zero = (Shift((x, y), (x, y), 0.0, 0.0), Shift((x, y), (x, y), 0.5 * np.pi, 0.0), Angle((x, y), 0.0, 0.0, True))
        return Reading(GaugeStatus.OK, zero, (Mark(((x, y),)),), self._zone())

    def similar(self, picture: Picture) -> Seen:
        """Textures like the patch around its last place."""
        x, y, turn = self._at
        return seen_alike(picture, self._turned(turn), (x, y), self.wide_px, NEARLY * self._least_correlation)

    def sought(self, picture: Picture) -> tuple[Floats, tuple[int, int], NDArray[np.float64]] | Reading:
        """Locate the patch roughly: return the part of the picture for the registration, and an initial estimate."""
        (a, b), (x, y, turn) = self.half, self._at
        found = self.place_of(picture, self._turned(turn), (x, y), NEARLY * self._least_correlation)
        if isinstance(found, GaugeStatus):
            return self._failed(found)
        if hypot(found[0] - x, found[1] - y) > self.reach_px * self.times + 1.0:
            return self._failed(GaugeStatus.NOT_FOUND)
        # Margin for the rotated patch, and for the interpolation.
        more = MARGIN_PX + 3 + ceil(max(a, b) * min(abs(sin(turn)) + 0.1, 1.0) * 0.5)
        middle = (round(found[0]), round(found[1]))
        corner = (middle[0] - a - more, middle[1] - b - more)
        part = _padded(picture, *corner, 2 * (a + more) + 1, 2 * (b + more) + 1)
        return part, corner, np.array([*found, turn])

    def _turned(self, turn: float) -> Template:
        """The template of the patch, rotated as the patch was in the previous frame."""
        assert self._template is not None  # noqa: S101 - there is a reference
        assert self._around is not None  # noqa: S101 - likewise
        if abs(turn - self._template_turn) > TURN_AT:
            (a, b), around = self.half, self._around
            middle = (0.5 * (around.shape[1] - 1), 0.5 * (around.shape[0] - 1))
            # A positive `turn` is clockwise on the screen, whereas OpenCV's angles are anticlockwise.
            turned = cv2.warpAffine(
                around, cv2.getRotationMatrix2D(middle, -np.degrees(turn), 1.0), around.shape[::-1],
                borderMode=cv2.BORDER_REFLECT_101,
            )  # fmt: skip
            row, column = int(middle[1]), int(middle[0])
            self._template = Template(np.ascontiguousarray(turned[row - b : row + b + 1, column - a : column + a + 1]))
            self._template_turn = turn
        return self._template

    def taken(
        self,
        place: tuple[float, float, float],
        covariance: NDArray[np.float64],
        correlation: float,
        settled: bool,
        aliasing_px: float,
        picture: Picture,
    ) -> Reading:
        """Accept or reject the result of a registration, and store an accepted result."""
        x, y, turn = place
        if not settled or correlation < self._least_correlation:
            return self._failed(GaugeStatus.NOT_FOUND)
        if hypot(x - self._at[0], y - self._at[1]) > self.reach_px * self.times + 1.0:
            return self._failed(GaugeStatus.NOT_FOUND, "the patch would have moved farther than reach_px permits")
        if not max(covariance[0, 0], covariance[1, 1]) < LEAST_SURE_PX**2:
            return self._failed(GaugeStatus.LOW_CONTRAST)
        # A patch at rest is refused as well, because unresolved lines seem to be at rest until they jump to the next
        # pixel.
        if aliasing_px > MOST_ALIASED_PX:
            return self._failed(
                GaugeStatus.LOW_CONTRAST,
                "the texture of the patch is finer than the pixels: defocus the camera slightly",
            )
        self._at = place
        self.kept(picture)
        # The stated point may differ from the patch's centre, which is the centre of a pixel.
        (from_x, from_y) = self._spec.middle_px
        off_x, off_y = from_x - round(from_x), from_y - round(from_y)
        to = (x + cos(turn) * off_x - sin(turn) * off_y, y + sin(turn) * off_x + cos(turn) * off_y)
        u_x, u_y, u_turn = (sqrt(float(covariance[i, i])) for i in range(3))
        quantities = (
            Shift((from_x, from_y), to, 0.0, u_x),
            Shift((from_x, from_y), to, 0.5 * np.pi, u_y),
            Angle(to, turn, u_turn, is_turn=True),
        )
        return Reading(GaugeStatus.OK, quantities, (Mark(((from_x, from_y), to)), Mark((to,)), self._zone()), None)


def _padded(picture: Picture, x: int, y: int, width: int, height: int) -> Floats:
    """Light in a rectangle of the picture, which may extend beyond the picture.

    Beyond the picture's border the light is mirrored, which affects only the tails of the interpolation.
    """
    levels, (left, top) = picture.part(x, y, width, height)
    part = levels.astype(np.float32)
    if part.shape == (height, width):
        return part
    before = (left - x, top - y)
    after = (width - part.shape[1] - before[0], height - part.shape[0] - before[1])
    return np.asarray(
        cv2.copyMakeBorder(part, before[1], after[1], before[0], after[0], cv2.BORDER_REFLECT_101), dtype=np.float32
    )
