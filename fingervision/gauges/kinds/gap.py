"""The gap between two fingers in a region, measured in the same way as `measure` does in the whole picture."""

from dataclasses import dataclass, replace
from math import ceil
from typing import Annotated

from fingervision.domain.camera import BesideEdges
from fingervision.domain.field import Field
from fingervision.domain.frame import Region
from fingervision.domain.gap import GapMeasurement
from fingervision.gauges.common_keys import LONGEST_PX, Placed
from fingervision.gauges.picture import Picture
from fingervision.gauges.quantities import Distance
from fingervision.gauges.reading import GaugeStatus, Mark, Reading
from fingervision.vision.pipeline import Settings, measure_frame
from fingervision.vision.single_picture import beside_in

QUANTITIES = (("gap", "length"),)
ASKS_FOR_FINGERS = True
# Smallest region that can contain two fingers and the edges between them (`fingervision.vision.pipeline` refuses
# smaller regions).
SMALLEST_PX = 16.0
SIZE = "size of the region of a `gap`"


@dataclass(frozen=True, slots=True)
class GapSpec(Placed):
    """Settings of a gap gauge: centre and size of its region."""

    width_px: Annotated[float, Field(SIZE, "px", low=SMALLEST_PX, high=LONGEST_PX)]
    height_px: Annotated[float, Field(SIZE, "px", low=SMALLEST_PX, high=LONGEST_PX)]

    def follower(self) -> "FollowedGap":
        """Return a new follower, for the first frame of a recording."""
        return FollowedGap(self)


SPEC = GapSpec


class FollowedGap:
    """Measures one gap in the frames of one recording; the region moves with the midline of the fingers."""

    def __init__(self, spec: GapSpec) -> None:
        self._spec = spec
        self._middle: tuple[float, float] | None = None
        self._moved = (0, 0)
        self._looks = True
        self._beside: BesideEdges | None = None

    def lost(self) -> None:
        """A frame that was not read leaves the region where it is."""

    def measured(self, picture: Picture) -> Reading:
        """Measure the next frame."""
        region = self._region(picture)
        if region is None:
            return Reading(GaugeStatus.OUT_OF_VIEW)
        x, y, right, bottom = (
            region.x_px, region.y_px, region.x_px + region.width_px - 1, region.y_px + region.height_px - 1,
        )  # fmt: skip
        zone = Mark(((x, y), (right, y), (right, bottom), (x, bottom), (x, y)))
        settings = replace(picture.settings, region=region, has_fingers=True)
        found = measure_frame(picture.frame, self._with_beside(picture, settings))
        if not isinstance(found, GapMeasurement):
            return Reading(GaugeStatus(found.status.value), zone=zone, words=found.words)
        first, second = ((edge.x_px, edge.y_px) for edge in (found.left, found.right))
        middle = (0.5 * (first[0] + second[0]), 0.5 * (first[1] + second[1]))
        if self._middle is None:
            self._middle = middle
        self._moved = (round(middle[0] - self._middle[0]), round(middle[1] - self._middle[1]))
        polarity = 1 if found.light_gap else -1
        # `u_picture_px` applies to the whole gap, and half of it to each edge; other shifts are part of `u_gap_px`.
        quantity = Distance(first, second, found.u_gap_px, polarity, 0.5 * found.u_picture_px)
        return Reading(GaugeStatus.OK, (quantity,), (Mark((first, second)),), zone)

    def _with_beside(self, picture: Picture, settings: Settings) -> Settings:
        """Settings with what stands beside the edges: of the recording, or as the first picture shows it."""
        if settings.camera.beside is not None:
            return settings
        if self._looks:
            self._looks, self._beside = False, beside_in([picture.frame], settings)
        return replace(settings, camera=replace(settings.camera, beside=self._beside))

    def _region(self, picture: Picture) -> Region | None:
        """The present region of the gauge, clipped to the picture."""
        spec, (width, height) = self._spec, picture.size_px
        left = round(spec.middle_px[0] - 0.5 * (spec.width_px - 1.0)) + self._moved[0]
        top = round(spec.middle_px[1] - 0.5 * (spec.height_px - 1.0)) + self._moved[1]
        right, bottom = left + ceil(spec.width_px), top + ceil(spec.height_px)
        left, top, right, bottom = max(left, 0), max(top, 0), min(right, width), min(bottom, height)
        if right - left < SMALLEST_PX or bottom - top < SMALLEST_PX:
            return None
        return Region(left, top, right - left, bottom - top)
