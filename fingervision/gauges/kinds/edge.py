"""Position of one straight edge along a direction."""

from dataclasses import dataclass

from fingervision.gauges.common_keys import EdgeKeys, edge_keys
from fingervision.gauges.picture import Picture
from fingervision.gauges.quantities import Position
from fingervision.gauges.reading import GaugeStatus, Mark, Reading
from fingervision.gauges.straight_edge import Axes, EdgeFollower, NotFound
from fingervision.storage.toml_section import Section

KEYS = ("x_px", "y_px", "direction_deg", "length_px", "reach_px", "polarity")
QUANTITIES = (("position", "length"),)


@dataclass(frozen=True, slots=True)
class EdgeSpec(EdgeKeys):
    """Settings of an edge gauge; `direction_rad` is the direction in which the position is measured."""

    def follower(self) -> "FollowedEdge":
        """Return a new follower, for the first frame of a recording."""
        return FollowedEdge(self)


def read(section: Section) -> EdgeSpec:
    """Read the settings of one gauge."""
    return EdgeSpec(*edge_keys(section, "direction_deg"))


class FollowedEdge:
    """Tracks one edge through the frames of one recording."""

    def __init__(self, spec: EdgeSpec) -> None:
        axes = Axes(*spec.middle_px, spec.direction_rad)
        self._edge = EdgeFollower(axes, 0.0, spec.length_px, spec.reach_px, spec.polarity)

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
