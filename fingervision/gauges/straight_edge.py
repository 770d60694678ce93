"""One straight edge as measured by gauges: its axes, its fitted parameters, and the limits for accepting it."""

from dataclasses import dataclass, replace
from math import ceil, cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from fingervision.gauges.picture import Picture
from fingervision.gauges.reading import GaugeStatus, Mark
from fingervision.gauges.similar_objects import GUARD, PRESENT_SHARE, SAME_PX, Followed, Seen
from fingervision.vision.edge_search import Profile, StepCandidate, candidates, profile
from fingervision.vision.response_shift import u_edge_px
from fingervision.vision.straight_edge_fit import (
    Band,
    EdgeStart,
    NoEdgeFitError,
    StraightEdges,
    fit_straight_edges,
    reach_px,
)

# Smallest contrast of an edge, as a share of full scale (as in `fingervision.vision.pipeline`).
CONTRAST_FLOOR = 0.03
# Limits of the ratio of an edge's contrast to that in the previous frame; outside them, another edge is assumed.
LEAST_OF_KNOWN, MOST_OF_KNOWN = 0.4, 2.5
# Largest residual of the fit as a share of the contrast, above which texture is assumed; smallest contrast of any
# eighth of the edge, as a share of the contrast of the whole edge.
MOST_NOISE, LEAST_PIECE = 0.35, 0.5
# Blur (standard deviation) at which the status is `blurred`, as for a gap.
LARGEST_BLUR_PX = 5.0
# Largest bend of a straight edge, in pixels and as a share of its length (the limits of `calib.straight_line`).
LARGEST_BEND_PX, LARGEST_BEND = 0.35, 0.01
# Slopes of an edge, relative to its gauge, that are tried in the first frame; an error of half a step blurs the profile
# over 40 px of an edge by 2 px.
LEANS = tuple(float(lean) for lean in np.linspace(-0.6, 0.6, 13))
MOST_LEAN = 1.0
# Number of strips of the profile beyond the search distance, so that an edge at this distance is completely visible.
BEYOND_PX = 8
# Smallest contrast of a neighbouring edge, as a share of the measured edge's contrast, at which it is fitted too.
LEAST_BESIDE = 0.1
# At a smaller distance (in standard deviations of the blur), contrast and distance of two edges cannot be
# distinguished: such a neighbour is a part of the edge itself, as its flank in a profile that leans against it.
NEAREST_SIGMAS = 2.5
# Largest distance between the fitted edge and the candidate, in addition to the blur.
FARTHEST_FROM_CANDIDATE_PX = 3.0
# A plateau is clipped if this share of its pixels is at the end of the scale. The flank is clipped as well if more than
# 6 % of the step is lost with a confidence of two standard uncertainties. Otherwise up to a tenth of the step may be
# lost, which shifts the edge by 0 to 0.125 sigma_e towards the light side (rectangular distribution; sigma_e is the
# standard deviation of the blur).
MOST_CLIPPED, MOST_LOST, SURE, HIDDEN_SHIFT_SIGMAS = 0.5, 0.06, 2.0, 0.125 / 3.0**0.5
# Largest standard uncertainty of an accepted position (pixels).
LEAST_SURE_PX = 1.0


@dataclass(frozen=True, slots=True)
class EdgeFound:
    """A straight edge in one frame.

    Parameters
    ----------
    position_px : float
        Position along the gauge's direction, from the gauge's middle.
    slope : float
        Change of the position per distance along the edge.
    u_position_px, u_slope, covariance_px : float
        Standard uncertainties of position and slope, and their covariance.
    contrast, inside : float
        Level beyond the edge minus level before it; level before it.
    blur_px : float
        Gaussian sigma of the optics.
    u_response_px : float
        Standard uncertainty of the position due to an unknown camera response.
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
        """Side of the dark area: +1 beyond the edge (along the direction), -1 before the edge."""
        return -1 if self.contrast > 0.0 else 1


@dataclass(frozen=True, slots=True)
class NotFound:
    """Reason why no edge was found."""

    status: GaugeStatus
    words: str = ""


@dataclass(frozen=True, slots=True)
class Axes:
    """The gauge's own axes in the picture: t along its direction, s perpendicular to t.

    Parameters
    ----------
    x_px, y_px : float
        Origin, where t and s are zero.
    direction_rad : float
        Direction of the axis t.
    """

    x_px: float
    y_px: float
    direction_rad: float

    def point(self, t_px: float, s_px: float = 0.0) -> tuple[float, float]:
        """Picture coordinates of a point that is given in the gauge's axes t and s."""
        cosine, sine = cos(self.direction_rad), sin(self.direction_rad)
        return self.x_px + cosine * t_px - sine * s_px, self.y_px + sine * t_px + cosine * s_px

    def box(self, t_px: float, half_t_px: float, half_s_px: float) -> Mark:
        """Corners of a rectangle around a position on the axis t, for drawing."""
        signs = ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))
        return Mark(tuple(self.point(t_px + a * half_t_px, b * half_s_px) for a, b in signs))


# Fit the edges near the expected position of a gauge's edge, and give a reason if the result is refused.


Floats = NDArray[np.float64]


def apart_px(blur_px: float) -> float:
    """Least distance at which two edges can be told apart."""
    return NEAREST_SIGMAS * hypot(blur_px, 0.29)


def fit_near(
    follower: "EdgeFollower", picture: Picture, chosen: list[StepCandidate], steps: list[StepCandidate]
) -> tuple[list[EdgeFound], float] | NotFound:
    """Fit chosen edges together with all other edges within their fit windows.

    Parameters
    ----------
    follower : EdgeFollower
        Tracker of the edge, with its axes, its length and the results of earlier frames.
    picture : Picture
        The frame.
    chosen : list of StepCandidate
        One candidate, or the two of a pair; positions are relative to the tracker's `at_px`.
    steps : list of StepCandidate
        All candidates seen, including the chosen ones.

    Returns
    -------
    (list of EdgeFound, float), or NotFound
        The fitted edges in the order of `chosen`, and the covariance of the first two positions (0 for one edge).
    """
    blur = follower.known.blur_px if follower.known is not None else 1.2
    reach = reach_px(blur)
    least, nearest = LEAST_BESIDE * max(abs(step.contrast) for step in chosen), apart_px(blur)
    beside = [
        step
        for step in steps
        if abs(step.contrast) >= least
        and nearest <= min(abs(step.position_px - own.position_px) for own in chosen) < reach + 2.0
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
    is_in_view = _is_in_view(picture, follower, min(places) - reach + 2.0, max(places) + reach - 2.0)
    if not is_in_view or levels.size == 0:
        return NotFound(GaugeStatus.OUT_OF_VIEW)
    try:
        cut_off = _cut_plateau(picture, levels)
        fitted = fit_straight_edges(levels, origin, band, starts, blur, picture.edge_shared_pixels, cut_off)
    except NoEdgeFitError as why:
        if beside:
            # In sloping light, a candidate beside the edge may be no edge, and does not determine a position.
            return fit_near(follower, picture, chosen, chosen)
        return NotFound(GaugeStatus.NO_EDGE, str(why))
    found = []
    for k, step in enumerate(chosen):
        reason = _refused(follower, picture, fitted, k, step)
        if reason is not None:
            return reason
        found.append(_edge(follower, picture, fitted, k))
    if cut_off:
        if fitted.lost - SURE * fitted.u_lost > MOST_LOST:
            return NotFound(GaugeStatus.SATURATED, "the flank of the edge is clipped")
        hidden = HIDDEN_SHIFT_SIGMAS * hypot(fitted.blur_px, 0.29)
        found = [replace(one, u_position_px=hypot(one.u_position_px, hidden)) for one in found]
    return found, float(fitted.covariance[0, 1]) if len(chosen) > 1 else 0.0


def _is_in_view(picture: Picture, follower: "EdgeFollower", low_px: float, high_px: float) -> bool:
    width, height = picture.size_px
    half = 0.5 * follower.length_px
    for t in (low_px, high_px):
        for s in (-half, half):
            x, y = follower.axes.point(follower.at_px + t + follower.slope * s, s)
            if not (-0.5 <= x <= width - 0.5 and -0.5 <= y <= height - 0.5):
                return False
    return True


def _refused(
    follower: "EdgeFollower", picture: Picture, fitted: StraightEdges, k: int, step: StepCandidate
) -> NotFound | None:
    contrast = float(fitted.contrast[k])
    known = follower.known
    if contrast * step.contrast <= 0.0 or abs(contrast) < CONTRAST_FLOOR * picture.top:
        return NotFound(GaugeStatus.NO_EDGE, "the edge has too little contrast")
    if (
        known is not None
        and not LEAST_OF_KNOWN <= contrast / known.contrast <= MOST_OF_KNOWN
        and len(fitted.contrast) < 2
    ):
        return NotFound(GaugeStatus.NO_EDGE, "the contrast differs too much from that in the previous frame")
    if abs(float(fitted.position_px[k]) - step.position_px) > FARTHEST_FROM_CANDIDATE_PX + fitted.blur_px:
        return NotFound(GaugeStatus.NO_EDGE, "the fit moved away from the edge")
    if fitted.blur_px >= LARGEST_BLUR_PX:
        return NotFound(GaugeStatus.BLURRED)
    if fitted.noise > MOST_NOISE * abs(contrast):
        return NotFound(GaugeStatus.NO_EDGE, "there is texture, but no edge")
    if abs(float(fitted.slope[k])) > MOST_LEAN:
        return NotFound(GaugeStatus.NO_EDGE, "the edge is tilted by more than 45 degrees against the gauge")
    if k == 0 and fitted.least_piece < LEAST_PIECE:
        return NotFound(GaugeStatus.NO_EDGE, "the edge ends within the gauge's length")
    if k == 0 and fitted.bend_px > max(LARGEST_BEND_PX, LARGEST_BEND * follower.length_px):
        return NotFound(GaugeStatus.NO_EDGE, f"the edge is bent by {fitted.bend_px:.1f} px: shorten length_px")
    variance = float(fitted.covariance[k, k])
    if not 0.0 < variance < LEAST_SURE_PX**2:
        return NotFound(GaugeStatus.LOW_CONTRAST)
    return None


def _edge(follower: "EdgeFollower", picture: Picture, fitted: StraightEdges, k: int) -> EdgeFound:
    count = fitted.position_px.size
    covariance = fitted.covariance
    contrast = float(fitted.contrast[k])
    inside = fitted.inside + float(fitted.contrast[fitted.position_px < fitted.position_px[k] - 1e-9].sum())
    shares = (inside / picture.top, (inside + contrast) / picture.top)
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
        u_edge_px(picture.settings.camera.response, *shares, fitted.blur_px),
    )


def _cut_plateau(picture: Picture, levels: Floats) -> int:
    """Whether much of one side of an edge is clipped and may be lighter (+1) or darker (-1) than recorded; 0 if not."""
    middle = 0.5 * (float(levels.min()) + float(levels.max()))
    light = levels > middle
    if np.count_nonzero(levels >= picture.top) > MOST_CLIPPED * np.count_nonzero(light):
        return 1
    return -1 if np.count_nonzero(levels <= 0.0) > MOST_CLIPPED * np.count_nonzero(~light) else 0


# Track one straight edge from frame to frame, taking account of other edges beside it.


class EdgeFollower(Followed):
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
        super().__init__(reach_px)
        self.axes, self.length_px, self.slope = axes, length_px, 0.0
        self.at_px, self.polarity = at_px, polarity
        self.first_reach_px = reach_px
        self.known: EdgeFound | None = None

    @property
    def zone(self) -> Mark:
        """The zone of the picture in which the edge is searched."""
        return self.axes.box(self.at_px, self.reach_px * self.times, 0.5 * self.length_px)

    def turned_to(self, axes: Axes, at_px: float, slope: float) -> None:
        """Continue to follow an edge with other axes, in which the edge has the given position and slope."""
        self.axes, self.at_px, self.slope = axes, at_px, slope

    def _seen(self, picture: Picture, slope: float, half_px: float) -> tuple[Profile, float] | None:
        """Profile around the edge's last position, and what its middle differs from that; None outside the picture."""
        middle = self.axes.point(self.at_px)
        anchor = (round(middle[0]), round(middle[1]))
        width, height = picture.size_px
        if not (0 <= anchor[0] < width and 0 <= anchor[1] < height):
            return None
        cosine, sine = cos(self.axes.direction_rad), sin(self.axes.direction_rad)
        off_t = cosine * (anchor[0] - middle[0]) + sine * (anchor[1] - middle[1])
        off_s = -sine * (anchor[0] - middle[0]) + cosine * (anchor[1] - middle[1])
        half, direction = ceil(half_px) + BEYOND_PX, self.axes.direction_rad
        seen = profile(picture.grey, picture.light, anchor, direction, slope, self.length_px, half)
        return seen, off_t - slope * off_s

    def similar(self, picture: Picture) -> Seen:
        """Edges like the own one along the gauge's direction."""
        found = self._seen(picture, self.slope, self.wide_px)
        if found is None or self.known is None:
            return Seen(np.zeros((0, 2)), np.zeros(0, dtype=bool), np.zeros(2), np.zeros(2))
        seen, off = found
        ratio = np.array([[step.position_px + off, step.contrast / self.known.contrast] for step in candidates(seen)])
        places, ratio = ratio.reshape(-1, 2).T
        is_there = (ratio >= LEAST_OF_KNOWN * PRESENT_SHARE) & (ratio <= MOST_OF_KNOWN / PRESENT_SHARE)
        is_alike = (ratio >= LEAST_OF_KNOWN) & (ratio <= MOST_OF_KNOWN)
        in_view = np.flatnonzero(seen.weight > 0.5) - seen.half + off
        return Seen(
            np.stack((places, np.zeros_like(places)), axis=1)[is_there], is_alike[is_there],
            np.array([in_view[0] + BEYOND_PX, -np.inf]), np.array([in_view[-1] - BEYOND_PX, np.inf]),
        )  # fmt: skip

    def candidate(self, picture: Picture) -> tuple[StepCandidate, list[StepCandidate]] | NotFound:
        """The only candidate that may be the edge, together with the other edges beside it."""
        reach = self.first_reach_px if self.known is None else self.reach_px * self.times
        # Before the first value, the edge may have moved in every frame that gave none.
        guard = GUARD * reach if self.known is not None else min(reach + self.missed * self.reach_px, self.wide_px)
        if self.known is None:
            leaning = [self._seen(picture, lean, guard) for lean in LEANS]
            profiles = [seen for seen in leaning if seen is not None]
            steep = [self._steepest(seen, reach) for seen, _ in profiles]
            self.slope = LEANS[int(np.argmax(steep))] if steep else 0.0
        found = self._seen(picture, self.slope, guard)
        if found is None:
            return NotFound(GaugeStatus.OUT_OF_VIEW)
        seen, off = found
        steps = [replace(step, position_px=step.position_px + off) for step in candidates(seen)]
        if self.known is None:
            strongest = max((abs(step.contrast) for step in self._in_reach(steps, reach)), default=0.0)
            least, most = LEAST_OF_KNOWN * strongest, float("inf")
        else:
            least, most = (factor * abs(self.known.contrast) for factor in (LEAST_OF_KNOWN, MOST_OF_KNOWN))
        least = max(least, CONTRAST_FLOOR * picture.top)
        alike = [step for step in self._in_reach(steps, guard) if least <= abs(step.contrast) <= most]
        if not alike:
            return NotFound(GaugeStatus.NO_EDGE if steps or self.known is not None else GaugeStatus.LOW_CONTRAST)
        chosen = self._own(picture, alike)
        if isinstance(chosen, StepCandidate) and abs(chosen.position_px) > reach + 1.0:
            return NotFound(GaugeStatus.NO_EDGE, "the edge found is farther away than reach_px")
        return (chosen, steps) if isinstance(chosen, StepCandidate) else chosen

    def _own(self, picture: Picture, alike: list[StepCandidate]) -> StepCandidate | NotFound:
        """The own edge among those that are alike."""
        if self.known is None or not (self.missed or (len(alike) == 1 and self.is_doubtful(alike[0].position_px))):
            if len(alike) == 1:
                return alike[0]
            places = ", ".join(f"{step.position_px:+.0f}" for step in alike)
            return NotFound(
                GaugeStatus.AMBIGUOUS, f"{len(alike)} edges lie within reach_px, at {places} px along the direction"
            )
        place = self.own_place(picture)
        if isinstance(place, GaugeStatus):
            return NotFound(GaugeStatus.NO_EDGE if place is GaugeStatus.NOT_FOUND else place)
        chosen = min(alike, key=lambda step: abs(step.position_px - place[0]))
        is_it = abs(chosen.position_px - place[0]) <= SAME_PX
        return chosen if is_it else NotFound(GaugeStatus.AMBIGUOUS)

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
        self.keep(one, picture)
        return one

    def keep(self, found: EdgeFound, picture: Picture) -> None:
        """Store the position of the edge for the next frame."""
        self.known, self.at_px, self.slope = found, found.position_px, found.slope
        self.kept(picture)
