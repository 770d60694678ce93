"""Track one straight edge from frame to frame, taking account of other edges beside it."""

from dataclasses import replace
from math import ceil, cos, sin

import numpy as np
from numpy.typing import NDArray

from fingervision.gauges.edge_fit import fit_near
from fingervision.gauges.picture import Picture
from fingervision.gauges.reading import Mark
from fingervision.gauges.status import GaugeStatus
from fingervision.gauges.straight_edge import (
    BEYOND_PX,
    CONTRAST_FLOOR,
    GUARD,
    LEANS,
    LEAST_OF_KNOWN,
    MOST_OF_KNOWN,
    MOST_TIMES,
    Axes,
    EdgeFound,
    NotFound,
)
from fingervision.vision.edge_search import Profile, StepCandidate, candidates, profile

Floats = NDArray[np.float64]
# Distance (pixels) below which two steps of a profile are the same edge; a profile of strips of one pixel determines
# the position of a step to half a pixel.
SAME_PX = 2.0


class EdgeFollower:
    """Finds one edge near its position in the previous frame.

    Parameters
    ----------
    axes : Axes
        Axes of the gauge.
    at_px : float
        Expected position of the edge on the axis t in the first frame.
    length_px, reach_px : float
        Settings of the gauge.
    polarity : int
        +1, -1 or 0 for any.
    """

    def __init__(self, axes: Axes, at_px: float, length_px: float, reach_px: float, polarity: int) -> None:
        self.axes, self.length_px, self.reach_px = axes, length_px, reach_px
        self.at_px, self.polarity = at_px, polarity
        self.slope, self.times, self.most_times = 0.0, 1.0, float(MOST_TIMES)
        self.first_reach_px = reach_px
        self.known: EdgeFound | None = None

    @property
    def zone(self) -> Mark:
        """The zone of the picture in which the edge is searched."""
        return self.axes.box(self.at_px, self.reach_px * self.times, 0.5 * self.length_px)

    def turned_to(self, axes: Axes, at_px: float, slope: float) -> None:
        """Continue to follow an edge with other axes, in which the edge has the given position and slope."""
        self.axes, self.at_px, self.slope = axes, at_px, slope

    def lost(self) -> None:
        """Widen the search zone of the next frame, because the edge was not found."""
        self.times = min(self.times + 1.0, self.most_times) if self.known is not None else 1.0

    def candidate(self, picture: Picture) -> tuple[StepCandidate, list[StepCandidate]] | NotFound:
        """The only candidate that may be the edge, together with the other edges beside it."""
        reach = self.first_reach_px if self.known is None else self.reach_px * self.times
        guard = reach if self.known is None else GUARD * reach
        half = ceil(guard) + BEYOND_PX
        middle = self.axes.point(self.at_px)
        anchor = (round(middle[0]), round(middle[1]))
        width, height = picture.size_px
        if not (0 <= anchor[0] < width and 0 <= anchor[1] < height):
            return NotFound(GaugeStatus.OUT_OF_VIEW)
        cosine, sine = cos(self.axes.direction_rad), sin(self.axes.direction_rad)
        off_t = cosine * (anchor[0] - middle[0]) + sine * (anchor[1] - middle[1])
        off_s = -sine * (anchor[0] - middle[0]) + cosine * (anchor[1] - middle[1])

        def seen_at(lean: float) -> Profile:
            return profile(picture.grey, picture.light, anchor, self.axes.direction_rad, lean, self.length_px, half)

        if self.known is None:
            profiles = [seen_at(lean) for lean in LEANS]
            best = int(np.argmax([self._steepest(seen, reach) for seen in profiles]))
            self.slope, seen = LEANS[best], profiles[best]
        else:
            seen = seen_at(self.slope)
        off = off_t - self.slope * off_s
        steps = [replace(step, position_px=step.position_px + off) for step in candidates(seen)]
        if self.known is None:
            strongest = max((abs(step.contrast) for step in self._in_reach(steps, reach)), default=0.0)
            least, most = LEAST_OF_KNOWN * strongest, float("inf")
        else:
            least, most = (factor * abs(self.known.contrast) for factor in (LEAST_OF_KNOWN, MOST_OF_KNOWN))
        least = max(least, CONTRAST_FLOOR * picture.top)
        alike = [step for step in self._in_reach(steps, guard) if least <= abs(step.contrast) <= most]
        if not alike:
            if not steps and self.known is None:
                return NotFound(GaugeStatus.LOW_CONTRAST)
            return NotFound(GaugeStatus.NO_EDGE)
        if len(alike) > 1:
            places = ", ".join(f"{step.position_px:+.0f}" for step in alike)
            return NotFound(
                GaugeStatus.AMBIGUOUS, f"{len(alike)} edges lie within reach_px, at {places} px along the direction"
            )
        if abs(alike[0].position_px) > reach + 1.0:
            return NotFound(GaugeStatus.NO_EDGE, "the edge found is farther away than reach_px")
        if self.known is None:
            wide = profile(
                picture.grey, picture.light, anchor, self.axes.direction_rad, self.slope, self.length_px,
                ceil(GUARD * MOST_TIMES * self.reach_px) + BEYOND_PX,
            )  # fmt: skip
            self.most_times = self._times_clear_of(
                candidates(wide), replace(alike[0], position_px=alike[0].position_px - off)
            )
        return alike[0], steps

    def _times_clear_of(self, steps: list[StepCandidate], own: StepCandidate) -> float:
        """Multiple of `reach_px` up to which the search may be widened without including a similar edge."""
        apart = [
            abs(step.position_px - own.position_px)
            for step in steps
            if LEAST_OF_KNOWN <= step.contrast / own.contrast <= MOST_OF_KNOWN
        ]
        nearest = min((away for away in apart if away > SAME_PX), default=float("inf"))
        return float(np.clip((nearest - SAME_PX) / (GUARD * self.reach_px), 1.0, MOST_TIMES))

    def _in_reach(self, steps: list[StepCandidate], reach: float) -> list[StepCandidate]:
        sign = self.polarity if self.known is None else (1 if self.known.contrast > 0.0 else -1)
        return [s for s in steps if abs(s.position_px) <= reach and (sign == 0 or s.contrast * sign > 0.0)]

    def _steepest(self, seen: Profile, reach: float) -> float:
        """Largest step between neighbouring strips within reach, with the gauge's polarity."""
        rise = np.where((seen.weight[1:] > 0.5) & (seen.weight[:-1] > 0.5), np.diff(seen.level), 0.0)
        rise = self.polarity * rise if self.polarity else np.abs(rise)
        near = np.abs(np.arange(rise.size) + 0.5 - seen.half) <= reach + 1.0
        return float(np.max(rise[near], initial=0.0))

    def measured(self, picture: Picture) -> EdgeFound | NotFound:
        """Find and fit the edge in the next frame."""
        chosen = self.candidate(picture)
        if isinstance(chosen, NotFound):
            self.lost()
            return chosen
        found = fit_near(self, picture, [chosen[0]], chosen[1])
        if isinstance(found, NotFound):
            self.lost()
            return found
        (one,), _ = found
        self.keep(one)
        return one

    def keep(self, found: EdgeFound) -> None:
        """Store the position of the edge for the next frame."""
        self.known, self.at_px, self.slope, self.times = found, found.position_px, found.slope, 1.0
