"""Fit the edges near the expected position of a gauge's edge, and give a reason if the result is refused."""

from dataclasses import replace
from math import cos, hypot, sin
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingervision.gauges.picture import Picture
from fingervision.gauges.status import GaugeStatus
from fingervision.gauges.straight_edge import (
    CONTRAST_FLOOR,
    FARTHEST_FROM_CANDIDATE_PX,
    HIDDEN_SHIFT_SIGMAS,
    LARGEST_BEND,
    LARGEST_BEND_PX,
    LARGEST_BLUR_PX,
    LEAST_BESIDE,
    LEAST_OF_KNOWN,
    LEAST_PIECE,
    LEAST_SURE_PX,
    MOST_CLIPPED,
    MOST_LEAN,
    MOST_LOST,
    MOST_NOISE,
    MOST_OF_KNOWN,
    SURE,
    EdgeFound,
    NotFound,
)
from fingervision.vision.edge_search import StepCandidate
from fingervision.vision.response_shift import u_edge_px
from fingervision.vision.straight_edge_fit import (
    Band,
    EdgeStart,
    NoEdgeFitError,
    StraightEdges,
    fit_straight_edges,
    reach_px,
)

if TYPE_CHECKING:
    from fingervision.gauges.edge_follower import EdgeFollower

Floats = NDArray[np.float64]


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
