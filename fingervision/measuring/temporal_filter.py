"""Temporal noise reduction of a camera: how far behind moving fingers are seen, from the noise of what stands still.

A recursive filter y_k = r y_(k-1) + (1 - r) x_k makes white noise an autoregressive process with the correlation r from
picture to picture (Box & Jenkins, Time Series Analysis, 1976, chapter 3), and shows what moves r / (1 - r) pictures
late: x_k - y_k = r / (1 - r) (y_k - y_(k-1)), whatever the motion. For the differences d_k = y_k - y_(k-1) of a still
pixel the correlations at a distance of one and two pictures are -(1 - r) / 2 and -r (1 - r) / 2, whatever its level and
its fixed pattern. A filter may be weaker where something moves, so that the lag is a limit, and the gap lies anywhere
between (a rectangular distribution).
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from math import hypot, sqrt

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.camera import CameraQuantity, Origin
from fingervision.domain.frame import Frame, LostFrame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.vision.edges import EdgePoints
from fingervision.vision.profile_lines import INNER

Floats = NDArray[np.float64]
Item = tuple[Frame | LostFrame, GapMeasurement | NoGap | LostFrame]

# Sigma (pixels) of the blur that is subtracted from each difference: shadows that move on the ground, and flicker, are
# smooth. Least number of still pixels, and of differences of successive pictures.
SMOOTH_PX, FEWEST_PX, FEWEST = 3.0, 400, 4
# Variance of rounding to whole levels, and least variance of a difference without it: a clipped ground has no noise.
ROUNDING, LEAST_VARIANCE = 1.0 / 12.0, 0.05
# Largest deviation of the correlation at a distance of two pictures from that of a recursive filter: a patterned ground
# that trembles has another one. Largest r that is told from a still picture.
NO_FILTER, LARGEST = 0.05, 0.95
# Number of standard uncertainties that a correlation must exceed.
SURE = 4.0
UNKNOWN = CameraQuantity(0.0)


def temporal_lag(seen: Sequence[tuple[int, NDArray[np.generic], EdgePoints]]) -> CameraQuantity:
    """Pictures by which moving fingers may be seen late; of unknown value if too little of the ground stands still.

    Parameters
    ----------
    seen : sequence of (int, ndarray, EdgePoints)
        Number of each frame, its picture turned so that the tips point up (NaN at defect pixels), and the edges fitted
        in it.
    """
    same = [each for each in seen if each[1].shape == seen[0][1].shape]
    ground = _ground([edges for _, _, edges in same])
    if ground is None:
        return UNKNOWN
    pictures = {index: np.nan_to_num(picture[ground].astype(np.float64)) for index, picture, _ in same}
    apart = {
        index: difference - cv2.GaussianBlur(difference, (0, 0), SMOOTH_PX)
        for index, picture in pictures.items()
        if index - 1 in pictures and (difference := picture - pictures[index - 1]).any()
    }
    if len(apart) < FEWEST:
        return UNKNOWN
    variance = float(np.mean([np.mean(each**2) for each in apart.values()])) - 2.0 * ROUNDING
    if variance < LEAST_VARIANCE:
        return UNKNOWN
    next_one, next_but_one = (
        np.array([np.mean(each * apart[index + way]) for index, each in apart.items() if index + way in apart])
        for way in (1, 2)
    )
    if min(next_one.size, next_but_one.size) < 2:
        return UNKNOWN
    each = 1.0 + 2.0 * (next_one + ROUNDING) / variance
    share, u_share = float(each.mean()), float(each.std(ddof=1)) / sqrt(each.size)
    expected = -0.5 * share * (1.0 - share)
    if share > LARGEST or abs(float(next_but_one.mean()) / variance - expected) > NO_FILTER:
        return UNKNOWN
    share = share if share > SURE * u_share else 0.0
    return CameraQuantity(share / (1.0 - share), u_share / (1.0 - share) ** 2, Origin.LEARNT)


def _ground(edges: Sequence[EdgePoints]) -> tuple[slice, slice] | None:
    """Rows and columns between the fingers that are ground in all pictures."""
    left, right, top, bottom = -np.inf, np.inf, -np.inf, np.inf
    for each in edges:
        is_seen = each.lines.weight[:, :INNER] > 0
        if not is_seen.any(axis=1).all():
            return None
        places = [each.position[k, :INNER][is_seen[k]] for k in range(2)]
        rows = [each.lines.fixed[k, :INNER][is_seen[k]] for k in range(2)]
        left = max(left, float(places[0].max()) + each.reach_px)
        right = min(right, float(places[1].min()) - each.reach_px)
        top, bottom = max(top, *(float(row.min()) for row in rows)), min(bottom, *(float(row.max()) for row in rows))
    if not edges or min(right - left, bottom - top) <= 0.0 or (right - left) * (bottom - top) < FEWEST_PX:
        return None
    return slice(int(np.ceil(top)), int(bottom) + 1), slice(int(np.ceil(left)), int(right) + 1)


def with_lag(items: Iterable[Item], lag: CameraQuantity) -> Iterator[Item]:
    """Add to each gap's uncertainty the way that it may have gone on during the lag of the camera's filter.

    Parameters
    ----------
    items : iterable of (Frame or LostFrame, GapMeasurement or NoGap or LostFrame)
        Frames in order, with their results.
    lag : CameraQuantity
        Result of `temporal_lag`.
    """
    before: tuple[int, float] | None = None
    for item, outcome in items:
        if lag.value > 0.0 and isinstance(outcome, GapMeasurement):
            index, gap_px = before or (item.index - 1, outcome.gap_px)
            u_px = abs(lag.value * (outcome.gap_px - gap_px)) / (item.index - index) / sqrt(3.0)
            before = item.index, outcome.gap_px
            beside = "trail" if u_px > outcome.u_gap_px else ""
            outcome = replace(outcome, u_shift_px=hypot(outcome.u_shift_px, u_px), beside=outcome.beside or beside)
        yield item, outcome
