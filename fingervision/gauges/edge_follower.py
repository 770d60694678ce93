"""Follow one straight edge from frame to frame, and fit it together with other edges beside it."""

from dataclasses import dataclass, replace
from math import atan, ceil, cos, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from fingervision.gauges.picture import Picture
from fingervision.gauges.reading import Mark
from fingervision.gauges.status import GaugeStatus
from fingervision.vision.edge_search import Profile, StepCandidate, candidates, profile
from fingervision.vision.response_shift import edge_shift_px
from fingervision.vision.straight_edge_fit import (
    Band,
    EdgeStart,
    NoEdgeFitError,
    StraightEdges,
    fit_straight_edges,
    reach_px,
)

Floats = NDArray[np.float64]

# An edge has at least this share of full scale (as `fingervision.vision.pipeline` has it for the whole picture).
CONTRAST_FLOOR = 0.03
# From frame to frame its contrast stays within these factors: what has less is something else.
LEAST_OF_KNOWN, MOST_OF_KNOWN = 0.4, 2.5
# What the fit leaves is at most this share of the contrast: more is texture. Every eighth of the edge has at least this
# share of the whole's contrast.
MOST_NOISE, LEAST_PIECE = 0.35, 0.5
# `blurred` begins at a sigma of 5 px (measuring a gap has the same limit).
LARGEST_BLUR_PX = 5.0
# A bend beyond this (pixels, and share of the length) is a curve: the limits of `calib.straight_line`.
LARGEST_BEND_PX, LARGEST_BEND = 0.35, 0.01
# How an edge may lean against its gauge's direction in the first frame, and the steps in which that is tried; a profile
# across 40 px of an edge is blurred by 2 px where the lean is wrong by half a step.
LEANS = tuple(float(lean) for lean in np.linspace(-0.6, 0.6, 13))
MOST_LEAN = 1.0
# Strips of the profile beyond the reach: an edge there must be seen whole.
BEYOND_PX = 8
# Nothing alike may be within so many times the reach of where it was: a motion may exceed what was stated by half, and
# the neighbour is still not taken for it.
GUARD = 1.5
# After a frame without a number the thing may be farther away: so many times the reach at most.
MOST_TIMES = 4
# An edge beside it that has this share of its contrast is part of the model.
LEAST_BESIDE = 0.1
# The fit stays near the candidate.
FARTHEST_FROM_CANDIDATE_PX = 3.0
# A plateau of which this share is at the end of the scale is cut off. Where a sixteenth of the step is surely lost (a
# tenth may be) the flank itself is clipped; up to a tenth the edge lies up to 0.125 sigma_e nearer to the light: a
# rectangular distribution that begins at zero.
MOST_CLIPPED, MOST_LOST, SURE, HIDDEN_SHIFT_SIGMAS = 0.5, 0.06, 2.0, 0.125 / 3.0**0.5
# The fitted position is no number where it is less sure than this (pixels).
LEAST_SURE_PX = 1.0


@dataclass(frozen=True, slots=True)
class EdgeFound:
    """A straight edge in one frame.

    Parameters
    ----------
    position_px : float
        Along the gauge's direction, from the gauge's middle.
    slope : float
        Change of that with the distance along the edge.
    u_position_px, u_slope, covariance_px : float
        Standard uncertainties and their covariance.
    contrast, inside : float
        Level beyond less level before it; level before it.
    blur_px : float
        Gaussian sigma of the optics.
    u_response_px : float
        What an unknown camera response leaves open.
    """

    position_px: float
    slope: float
    u_position_px: float
    u_slope: float
    covariance_px: float
    contrast: float
    inside: float
    blur_px: float
    u_response_px: float

    @property
    def dark_side(self) -> int:
        """+1 where the dark side lies beyond the edge, -1 where it lies before it."""
        return -1 if self.contrast > 0.0 else 1


@dataclass(frozen=True, slots=True)
class NotFound:
    """Reason why no edge was found."""

    status: GaugeStatus
    words: str = ""


@dataclass(frozen=True, slots=True)
class Axes:
    """A gauge's own axes in the picture: t along its direction, s turned by 90 degrees.

    Parameters
    ----------
    x_px, y_px : float
        Where both are zero.
    direction_rad : float
        Of t.
    """

    x_px: float
    y_px: float
    direction_rad: float

    def point(self, t_px: float, s_px: float = 0.0) -> tuple[float, float]:
        """Picture coordinates of a point given in the gauge's axes."""
        cosine, sine = cos(self.direction_rad), sin(self.direction_rad)
        return self.x_px + cosine * t_px - sine * s_px, self.y_px + sine * t_px + cosine * s_px

    def box(self, t_px: float, half_t_px: float, half_s_px: float) -> Mark:
        """A rectangle about a position on t, for drawing."""
        signs = ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))
        return Mark(tuple(self.point(t_px + a * half_t_px, b * half_s_px) for a, b in signs))


class EdgeFollower:
    """Finds one edge near its position in the previous frame.

    Parameters
    ----------
    axes : Axes
        The gauge's.
    at_px : float
        Where the edge is thought to lie on t in the first frame.
    length_px, reach_px : float
        As the gauge's keys say.
    polarity : int
        +1, -1 or 0 for any.
    """

    def __init__(self, axes: Axes, at_px: float, length_px: float, reach_px: float, polarity: int) -> None:
        self.axes, self.length_px, self.reach_px = axes, length_px, reach_px
        self.at_px, self.polarity = at_px, polarity
        self.slope, self.times = 0.0, 1.0
        self.first_reach_px = reach_px
        self.known: EdgeFound | None = None

    @property
    def zone(self) -> Mark:
        """The zone in which the edge is searched."""
        return self.axes.box(self.at_px, self.reach_px * self.times, 0.5 * self.length_px)

    def turned_to(self, axes: Axes, at_px: float, slope: float) -> None:
        """Return the follower with other axes."""
        self.axes, self.at_px, self.slope = axes, at_px, slope

    def lost(self) -> None:
        """Widen the search zone for the next frame."""
        self.times = min(self.times + 1.0, float(MOST_TIMES)) if self.known is not None else 1.0

    def candidate(self, picture: Picture) -> tuple[StepCandidate, list[StepCandidate]] | NotFound:
        """The only step that may be the edge, with the other steps beside it."""
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
                GaugeStatus.AMBIGUOUS, f"{len(alike)} edges within reach, at {places} px along the direction"
            )
        if abs(alike[0].position_px) > reach + 1.0:
            return NotFound(GaugeStatus.NO_EDGE, "it lies farther away than it may have moved")
        return alike[0], steps

    def _in_reach(self, steps: list[StepCandidate], reach: float) -> list[StepCandidate]:
        sign = self.polarity if self.known is None else (1 if self.known.contrast > 0.0 else -1)
        return [s for s in steps if abs(s.position_px) <= reach and (sign == 0 or s.contrast * sign > 0.0)]

    def _steepest(self, seen: Profile, reach: float) -> float:
        """Largest step from strip to strip within reach, with the gauge's polarity."""
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
        """Store the position for the next frame."""
        self.known, self.at_px, self.slope, self.times = found, found.position_px, found.slope, 1.0


def fit_near(
    follower: EdgeFollower, picture: Picture, chosen: list[StepCandidate], steps: list[StepCandidate]
) -> tuple[list[EdgeFound], float] | NotFound:
    """Fit chosen edges together with all other edges within their window.

    Parameters
    ----------
    follower : EdgeFollower
        Its axes, length, and what it knows of the edge.
    picture : Picture
        The frame.
    chosen : list of StepCandidate
        One step, or the two of a pair; positions from the follower's `at_px`.
    steps : list of StepCandidate
        All that were seen, the chosen ones among them.

    Returns
    -------
    (list of EdgeFound, float), or NotFound
        In the order of `chosen`; and the covariance of the first two positions (0 of one).
    """
    blur = follower.known.blur_px if follower.known is not None else 1.2
    reach = reach_px(blur)
    least = LEAST_BESIDE * max(abs(step.contrast) for step in chosen)
    beside = [
        step
        for step in steps
        if step not in chosen
        and abs(step.contrast) >= least
        and min(abs(step.position_px - own.position_px) for own in chosen) < reach + 2.0
    ]
    beside = sorted(beside, key=lambda step: -abs(step.contrast))[:2]
    starts = tuple(EdgeStart(step.position_px, follower.slope, step.contrast) for step in (*chosen, *beside))
    x, y = follower.axes.point(follower.at_px)
    band = Band(x, y, follower.axes.direction_rad, follower.length_px)
    places = [start.position_px for start in starts]
    half = hypot(0.5 * follower.length_px * hypot(1.0, follower.slope), max(map(abs, places)) + reach + 2.0)
    corner = (int(x - half) - 1, int(y - half) - 1)
    side = 2 * int(half) + 4
    levels, origin = picture.part(*corner, side, side)
    if not _is_in_view(picture, follower, min(places) - reach + 2.0, max(places) + reach - 2.0):
        return NotFound(GaugeStatus.OUT_OF_VIEW)
    if levels.size == 0:
        return NotFound(GaugeStatus.OUT_OF_VIEW)
    try:
        cut_off = _cut_plateau(picture, levels)
        fitted = fit_straight_edges(levels, origin, band, starts, blur, picture.edge_shared_pixels, cut_off)
    except (NoEdgeFitError, np.linalg.LinAlgError) as why:
        return NotFound(GaugeStatus.NO_EDGE, str(why))
    found = []
    for k, step in enumerate(chosen):
        reason = _refused(follower, picture, fitted, k, step)
        if reason is not None:
            return reason
        found.append(_edge(follower, picture, fitted, k))
    if cut_off:
        if fitted.lost - SURE * fitted.u_lost > MOST_LOST:
            return NotFound(GaugeStatus.SATURATED, "the flank itself is clipped")
        hidden = HIDDEN_SHIFT_SIGMAS * hypot(fitted.blur_px, 0.29)
        found = [replace(one, u_position_px=hypot(one.u_position_px, hidden)) for one in found]
    return found, float(fitted.covariance[0, 1]) if len(chosen) > 1 else 0.0


def _is_in_view(picture: Picture, follower: EdgeFollower, low_px: float, high_px: float) -> bool:
    width, height = picture.size_px
    half = 0.5 * follower.length_px
    for t in (low_px, high_px):
        for s in (-half, half):
            x, y = follower.axes.point(follower.at_px + t + follower.slope * s, s)
            if not (-0.5 <= x <= width - 0.5 and -0.5 <= y <= height - 0.5):
                return False
    return True


def _refused(
    follower: EdgeFollower, picture: Picture, fitted: StraightEdges, k: int, step: StepCandidate
) -> NotFound | None:
    contrast = float(fitted.contrast[k])
    known = follower.known
    if contrast * step.contrast <= 0.0 or abs(contrast) < CONTRAST_FLOOR * picture.top:
        return NotFound(GaugeStatus.NO_EDGE, "too little contrast")
    if (
        known is not None
        and not LEAST_OF_KNOWN <= contrast / known.contrast <= MOST_OF_KNOWN
        and len(fitted.contrast) < 2
    ):
        return NotFound(GaugeStatus.NO_EDGE, "another contrast")
    if abs(float(fitted.position_px[k]) - step.position_px) > FARTHEST_FROM_CANDIDATE_PX + fitted.blur_px:
        return NotFound(GaugeStatus.NO_EDGE, "the fit left the step")
    if fitted.blur_px >= LARGEST_BLUR_PX:
        return NotFound(GaugeStatus.BLURRED)
    if fitted.noise > MOST_NOISE * abs(contrast):
        return NotFound(GaugeStatus.NO_EDGE, "texture, no step")
    if abs(float(fitted.slope[k])) > MOST_LEAN:
        return NotFound(GaugeStatus.NO_EDGE, "it leans by more than 45 degrees against the direction")
    if k == 0 and fitted.least_piece < LEAST_PIECE:
        return NotFound(GaugeStatus.NO_EDGE, "it ends within the gauge's length")
    if k == 0 and fitted.bend_px > max(LARGEST_BEND_PX, LARGEST_BEND * follower.length_px):
        return NotFound(GaugeStatus.NO_EDGE, f"it is bent by {fitted.bend_px:.1f} px: shorten length_px")
    variance = float(fitted.covariance[k, k])
    if not 0.0 < variance < LEAST_SURE_PX**2:
        return NotFound(GaugeStatus.LOW_CONTRAST)
    return None


def _edge(follower: EdgeFollower, picture: Picture, fitted: StraightEdges, k: int) -> EdgeFound:
    count = fitted.position_px.size
    covariance = fitted.covariance
    contrast = float(fitted.contrast[k])
    inside = fitted.inside + float(fitted.contrast[fitted.position_px < fitted.position_px[k] - 1e-9].sum())
    other = picture.settings.other_response
    shift = 0.0
    if other is not None:
        levels = (inside / picture.top, (inside + contrast) / picture.top)
        shift = edge_shift_px(picture.settings.response, other, *levels, fitted.blur_px)
    at = follower.at_px + float(fitted.position_px[k])
    reach, half = reach_px(fitted.blur_px), 0.5 * follower.length_px
    wide, high = abs(cos(follower.axes.direction_rad)), abs(sin(follower.axes.direction_rad))
    carried = (wide * reach + high * half, high * reach + wide * half)
    displaced = picture.displaced_px(follower.axes.point(at), carried, inside, contrast)
    return EdgeFound(
        at,
        float(fitted.slope[k]),
        hypot(float(np.sqrt(covariance[k, k])), displaced),
        float(np.sqrt(covariance[count + k, count + k])),
        float(covariance[k, count + k]),
        contrast,
        inside,
        fitted.blur_px,
        abs(shift) / 3.0**0.5,
    )


def _cut_plateau(picture: Picture, levels: Floats) -> int:
    """Whether one side may be lighter (+1) or darker (-1) than the scale reaches, because much of it is clipped."""
    middle = 0.5 * (float(levels.min()) + float(levels.max()))
    light = levels > middle
    if np.count_nonzero(levels >= picture.top) > MOST_CLIPPED * np.count_nonzero(light):
        return 1
    return -1 if np.count_nonzero(levels <= 0.0) > MOST_CLIPPED * np.count_nonzero(~light) else 0


def normal_of(axes: Axes, slope: float) -> float:
    """Direction across an edge whose slope in the axes is `slope` (radians)."""
    return (axes.direction_rad - atan(slope) + pi) % (2.0 * pi) - pi
