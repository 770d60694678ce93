"""Distance of two parallel edges along a direction: the width of a bar, slot or link."""

from dataclasses import dataclass
from math import radians, sqrt
from typing import Annotated

from fingervision.domain.field import Field
from fingervision.gauges.common_keys import LONGEST_PX, REACH_PX, Across, Length, Placed, Reach
from fingervision.gauges.picture import Picture
from fingervision.gauges.quantities import Distance
from fingervision.gauges.reading import GaugeStatus, Mark, Reading
from fingervision.gauges.straight_edge import Axes, EdgeFollower, EdgeFound, NotFound, apart_px, fit_near
from fingervision.vision.edge_search import StepCandidate
from fingervision.vision.straight_edge_fit import reach_px

QUANTITIES = (("distance", "length"),)
POLARITIES = {"any": (0, 0), "light": (1, -1), "dark": (-1, 1), "rising": (1, 1), "falling": (-1, -1)}
# Largest search distance of each edge in the first frame, as a share of the distance between the edges.
NEAR_OWN = 0.4
# Candidates from the searches of both edges that are nearer than this are regarded as the same edge.
SAME_PX = 1.5


@dataclass(frozen=True, slots=True)
class PairSpec(Placed):
    """Settings of a pair gauge: centre between the edges, direction across them, and their initial distance."""

    direction_deg: Across
    distance_px: Annotated[float, Field("distance of the edges of a `pair`", "px", low=3.0, high=LONGEST_PX)]
    length_px: Length
    reach_px: Reach = REACH_PX
    polarity: Annotated[
        str,
        Field("of a `pair`: as of an edge, or `light` or `dark`, the area between the edges", of=tuple(POLARITIES)),
    ] = "any"

    def follower(self) -> "FollowedPair":
        """Return a new follower, for the first frame of a recording."""
        return FollowedPair(self)


SPEC = PairSpec


class FollowedPair:
    """Tracks two edges through the frames of one recording; edges near each other are fitted together.

    Parameters
    ----------
    spec : PairSpec
        Settings of the gauge.
    along_px : float
        Where the distance is taken: distance along the edges from the middle of what is fitted.
    """

    def __init__(self, spec: PairSpec, along_px: float = 0.0) -> None:
        self._along_px = along_px
        axes = Axes(*spec.middle_px, radians(spec.direction_deg))
        self._edges = [
            EdgeFollower(axes, side * 0.5 * spec.distance_px, spec.length_px, spec.reach_px, polarity)
            for side, polarity in zip((-1.0, 1.0), POLARITIES[spec.polarity], strict=True)
        ]
        for edge in self._edges:
            edge.first_reach_px = min(spec.reach_px, NEAR_OWN * spec.distance_px)

    def lost(self) -> None:
        """Note a frame in which the pair was not seen."""
        for edge in self._edges:
            edge.lost()

    def measured(self, picture: Picture) -> Reading:
        """Measure the next frame."""
        first, second = self._edges
        axes = first.axes
        zone = axes.box(
            0.5 * (first.at_px + second.at_px),
            0.5 * abs(second.at_px - first.at_px) + first.reach_px,
            0.5 * first.length_px,
        )
        found = self._found(picture)
        if isinstance(found, NotFound):
            self.lost()
            return Reading(found.status, zone=zone, words=found.words)
        (left, right), covariance = found
        for edge, one in zip(self._edges, (left, right), strict=True):
            edge.keep(one, picture)
        along = self._along_px
        places = tuple(axes.point(one.position_px + one.slope * along, along) for one in (left, right))
        half = 0.5 * first.length_px
        marks = [
            Mark(tuple(axes.point(one.position_px + one.slope * s, s) for s in (-half, half))) for one in (left, right)
        ]
        variances = (one.u_position_px**2 + 2.0 * along * one.covariance_px + (along * one.u_slope) ** 2
                     for one in (left, right))  # fmt: skip
        u = sqrt(max(sum(variances) - 2.0 * covariance, 0.0))
        polarity = 0 if left.contrast * right.contrast > 0.0 else left.dark_side * -1
        u_response = 0.5 * (left.u_response_px + right.u_response_px)
        quantity = Distance(places[0], places[1], u, polarity, u_response)
        return Reading(GaugeStatus.OK, (quantity,), (*marks, Mark(places)), zone)

    def _found(self, picture: Picture) -> tuple[tuple[EdgeFound, EdgeFound], float] | NotFound:
        first, second = self._edges
        seen: list[tuple[StepCandidate, list[StepCandidate]]] = []
        for edge in self._edges:
            one_seen = edge.candidate(picture)
            if isinstance(one_seen, NotFound):
                return one_seen
            seen.append(one_seen)
        (left, beside), (right, beside_right) = seen
        apart = second.at_px + right.position_px - first.at_px - left.position_px
        blur = max((edge.known.blur_px for edge in self._edges if edge.known is not None), default=1.2)
        if apart < apart_px(blur):
            same = abs(apart) < SAME_PX
            return NotFound(GaugeStatus.AMBIGUOUS if same else GaugeStatus.TOUCHING)
        if apart > 2.0 * reach_px(blur):
            fits: list[EdgeFound] = []
            for edge, one, others in ((first, left, beside), (second, right, beside_right)):
                fitted = fit_near(edge, picture, [one], others)
                if isinstance(fitted, NotFound):
                    return fitted
                fits += fitted[0]
            return (fits[0], fits[1]), 0.0
        # Edges that are near each other are fitted together, because each edge affects the window of its neighbour.
        moved = StepCandidate(right.position_px + second.at_px - first.at_px, right.contrast)
        both = fit_near(first, picture, [left, moved], beside)
        if isinstance(both, NotFound):
            return both
        return (both[0][0], both[0][1]), both[1]
