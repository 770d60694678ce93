"""Position and angle of a straight edge."""

from dataclasses import dataclass
from math import atan, cos, hypot, pi, radians, sin, sqrt
from typing import Annotated

from fingervision.domain.field import Field
from fingervision.gauges.common_keys import MOST_DEG, POLARITIES, REACH_PX, Length, Placed, Polarity, Reach
from fingervision.gauges.picture import Picture
from fingervision.gauges.quantities import Angle, Position
from fingervision.gauges.reading import GaugeStatus, Mark, Reading
from fingervision.gauges.straight_edge import Axes, EdgeFollower, NotFound

QUANTITIES = (("position", "length"), ("angle", "angle"))
# Angle between line and search zone (as a slope) above which the zone is rotated, so that the profile stays sharp.
TURN_AT = 0.2


@dataclass(frozen=True, slots=True)
class LineSpec(Placed):
    """Settings of a line gauge."""

    angle_deg: Annotated[float, Field("angle of a `line`: 0 right, 90 down", "degrees", low=-MOST_DEG, high=MOST_DEG)]
    length_px: Length
    reach_px: Reach = REACH_PX
    polarity: Polarity = "any"

    def follower(self) -> "FollowedLine":
        """Return a new follower, for the first frame of a recording."""
        return FollowedLine(self)


SPEC = LineSpec


class FollowedLine:
    """Tracks one line through the frames of one recording.

    `position` is measured from the gauge's centre, perpendicular to the direction in the gauge's settings, so that its
    direction is the same in all frames; `angle` is the direction of the line, within 90 degrees of `angle_deg`.
    """

    def __init__(self, spec: LineSpec) -> None:
        self._angle_rad = radians(spec.angle_deg)
        # The axis t is perpendicular to the line, so that the axis s has the direction of the line in the settings.
        axes = Axes(*spec.middle_px, self._angle_rad - 0.5 * pi)
        self._fixed = axes
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
        angle = axes.direction_rad + 0.5 * pi - atan(found.slope)
        u_angle = found.u_slope / (1.0 + found.slope**2)
        place, u_place = _crossing(self._fixed, axes, found.position_px, found.slope), found.u_position_px
        turned = angle - self._angle_rad
        across = (
            cos(axes.direction_rad - self._fixed.direction_rad)
            + sin(axes.direction_rad - self._fixed.direction_rad) * found.slope
        )
        # Point at which the fixed normal crosses the line; at a distance from the fit's centre, the slope's uncertainty
        # contributes.
        x, y = place
        along = -sin(axes.direction_rad) * (x - axes.x_px) + cos(axes.direction_rad) * (y - axes.y_px)
        variance = u_place**2 + 2.0 * along * found.covariance_px + along**2 * found.u_slope**2
        u_position = sqrt(max(variance, 0.0)) / max(abs(across), 0.1)
        quantities = (
            Position(place, self._fixed.direction_rad, u_position, found.dark_side, found.u_response_px),
            Angle(place, self._angle_rad + _wrapped(turned), u_angle),
        )
        if abs(found.slope) > TURN_AT:
            self._turn(found.position_px, found.slope)
        return Reading(GaugeStatus.OK, quantities, (Mark(ends), Mark((place,))), zone)

    def _turn(self, position_px: float, slope: float) -> None:
        """Rotate the search zone to the line's present direction."""
        axes = self._edge.axes
        x, y = axes.point(position_px)
        self._edge.turned_to(Axes(x, y, axes.direction_rad - atan(slope)), 0.0, 0.0)


def _crossing(fixed: Axes, axes: Axes, position_px: float, slope: float) -> tuple[float, float]:
    """Point where the line crosses the axis t that the settings of the gauge define."""
    x, y = axes.point(position_px)
    along_x, along_y = (
        cos(axes.direction_rad) * slope - sin(axes.direction_rad),
        sin(axes.direction_rad) * slope + cos(axes.direction_rad),
    )
    length = hypot(along_x, along_y)
    along_x, along_y = along_x / length, along_y / length
    normal_x, normal_y = along_y, -along_x
    across = cos(fixed.direction_rad) * normal_x + sin(fixed.direction_rad) * normal_y
    if abs(across) < 1e-6:
        return x, y
    t = ((x - fixed.x_px) * normal_x + (y - fixed.y_px) * normal_y) / across
    return fixed.point(t)


def _wrapped(angle: float) -> float:
    return (angle + pi) % (2.0 * pi) - pi
