"""Position of one straight edge along a direction."""

from dataclasses import dataclass
from math import radians

from fingervision.gauges.common_keys import POLARITIES, REACH_PX, Across, Length, Placed, Polarity, Reach
from fingervision.gauges.picture import Picture
from fingervision.gauges.quantities import Position
from fingervision.gauges.reading import GaugeStatus, Mark, Reading
from fingervision.gauges.straight_edge import Axes, EdgeFollower, NotFound

QUANTITIES = (("position", "length"),)


@dataclass(frozen=True, slots=True)
class EdgeSpec(Placed):
    """Settings of an edge gauge; the direction is that in which the position is measured."""

    direction_deg: Across
    length_px: Length
    reach_px: Reach = REACH_PX
    polarity: Polarity = "any"

    def follower(self) -> "FollowedEdge":
        """Return a new follower, for the first frame of a recording."""
        return FollowedEdge(self)


SPEC = EdgeSpec


class FollowedEdge:
    """Tracks one edge through the frames of one recording."""

    def __init__(self, spec: EdgeSpec) -> None:
        axes = Axes(*spec.middle_px, radians(spec.direction_deg))
        self._edge = EdgeFollower(axes, 0.0, spec.length_px, spec.reach_px, POLARITIES[spec.polarity])

    def lost(self) -> None:
        """Note a frame that was not read."""
        self._edge.lost()

    def measured(self, picture: Picture) -> Reading:
        """Measure the next frame."""
        edge, axes = self._edge, self._edge.axes
        zone = edge.zone
        found = edge.measured(picture)
        if isinstance(found, NotFound):
            return Reading(found.status, zone=zone, words=found.words)
        half = 0.5 * edge.length_px
        ends = tuple(axes.point(found.position_px + found.slope * s, s) for s in (-half, half))
        place = axes.point(found.position_px)
        quantity = Position(place, axes.direction_rad, found.u_position_px, found.dark_side, found.u_response_px)
        return Reading(GaugeStatus.OK, (quantity,), (Mark(ends), Mark((place,))), zone)
