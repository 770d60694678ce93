"""Shift of a fitted edge under other camera responses: the uncertainty of a response that is assumed or learnt."""

from functools import lru_cache
from math import copysign, hypot, log, sqrt

import numpy as np
from numpy.typing import NDArray

from calib.camera_response import CameraResponse
from fingervision.domain.camera import ResponseEstimate
from fingervision.domain.gap import GapMeasurement
from fingervision.vision.edge_filters import PIXEL_VARIANCE, Lines, blurred_step, edge_filters, reach_for
from fingervision.vision.edges import EdgePoints

Floats = NDArray[np.float64]

# Step of the levels (share of full scale) and ratio of the blurs for which shifts are computed and stored; one step
# changes the shift by less than 5 %.
LEVEL_STEP, BLUR_RATIO = 1.0 / 64.0, 1.05
# Sub-pixel positions over which the shift is averaged, and number of Gauss-Newton steps at each position.
PHASES_PX = np.array([-0.375, -0.125, 0.125, 0.375])
LOOKS = 8
# Number of steps in which light and levels are tabulated.
STEPS = 4096


def edge_shift_px(
    assumed: CameraResponse, other: CameraResponse, inside: float, outside: float, blur_px: float
) -> float:
    """Error of an edge fitted under an assumed camera response if another response is true (pixels, outwards).

    Parameters
    ----------
    assumed, other : CameraResponse
        The assumed response, and the possible true response.
    inside, outside : float
        Light of the two plateaus under the assumed response, as shares of full scale.
    blur_px : float
        Gaussian sigma of the edge (pixels).
    """
    return _shifts(assumed, (other,), *_rounded(inside, outside, blur_px))[0]


def _rounded(inside: float, outside: float, blur_px: float) -> tuple[int, int, int]:
    levels = [round(min(max(share, 0.0), 1.0) / LEVEL_STEP) for share in (inside, outside)]
    return levels[0], levels[1], round(log(max(blur_px, 0.2)) / log(BLUR_RATIO))


def u_edge_px(response: ResponseEstimate, inside: float, outside: float, blur_px: float) -> float:
    """Standard uncertainty of an edge's position due to the camera's response (pixels); see `edge_shift_px`."""
    shifts_px = _shifts_of(response, inside, outside, blur_px)
    return sqrt(sum(each.weight * px**2 for each, px in zip(response.others, shifts_px, strict=True)))


def _shifts_of(response: ResponseEstimate, inside: float, outside: float, blur_px: float) -> tuple[float, ...]:
    others = tuple(each.response for each in response.others)
    return _shifts(response.curve, others, *_rounded(inside, outside, blur_px))


def u_gap_response_px(measured: GapMeasurement, edges: EdgePoints, response: ResponseEstimate, top_level: int) -> float:
    """Standard uncertainty of the gap due to the camera's response, with the sign of the gap's probable error (pixels).

    A finger's whole outline shifts along its normal, including the tip, and the measuring height shifts with the tip,
    which matters if the edge is slanted.
    """
    sides = []
    for k, (finger, slope) in enumerate(
        ((measured.left, measured.left.slope), (measured.right, -measured.right.slope))
    ):
        inside, outside = (level / top_level for level in (edges.inside[k], edges.inside[k] + finger.contrast))
        shifts_px = _shifts_of(response, inside, outside, float(edges.blur_px[k, 0]))
        sides.append([(hypot(1.0, slope) - slope) * px for px in shifts_px])
    variance, mean = 0.0, 0.0
    for other, left_px, right_px in zip(response.others, *sides, strict=True):
        shift = -(left_px + right_px)
        variance, mean = variance + other.weight * shift**2, mean + other.weight * shift
    return copysign(sqrt(variance), mean)


@lru_cache(maxsize=1024)
def _shifts(
    assumed: CameraResponse, others: tuple[CameraResponse, ...], inside: int, outside: int, blur: int
) -> tuple[float, ...]:
    if inside == outside:
        return (0.0,) * len(others)
    return tuple(_shift(assumed, other, inside, outside, blur) for other in others)


@lru_cache(maxsize=8192)
def _shift(assumed: CameraResponse, other: CameraResponse, inside: int, outside: int, blur: int) -> float:
    """Fit a step of light encoded by one response and decoded by another."""
    sigma = BLUR_RATIO**blur
    shares = np.linspace(0.0, 1.0, STEPS)
    assumed_light, other_light = (np.interp(shares, each.level, each.light) for each in (assumed, other))
    plateaus = np.array([inside, outside]) * LEVEL_STEP
    # Conversion from the light under the assumed response to stored levels, and on to the light under the other
    # response; and back.
    there = np.interp(np.interp(plateaus, assumed_light, shares), shares, other_light)
    reach = reach_for(float(np.sqrt(sigma**2 + PIXEL_VARIANCE)))
    borders = np.arange(-reach - 0.5, reach + 1.0) - PHASES_PX[:, None]
    step, _, _ = blurred_step(borders, np.full((PHASES_PX.size, 1), sigma))
    light = there[0] + (there[1] - there[0]) * step
    seen = 255.0 * np.interp(np.interp(light, other_light, shares), shares, assumed_light)
    return mean_shift_px(seen, reach, sigma)


def mean_shift_px(levels: Floats, reach_px: int, sigma_px: float) -> float:
    """Mean displacement of the step fitted to levels, from the edges at `PHASES_PX` (pixels, outwards).

    Parameters
    ----------
    levels : ndarray of float, shape (phases, pixels)
        Levels across an edge at each sub-pixel position, from inside to outside.
    reach_px : int
        Half-length of the window.
    sigma_px : float
        Gaussian sigma of the edge.
    """
    count = PHASES_PX.size
    lines = Lines(np.zeros(count), np.ones(count), np.zeros(count, dtype=np.intp))
    filters, position, width = edge_filters(reach_px), PHASES_PX.copy(), np.array([sigma_px])
    for _look in range(LOOKS):
        look = filters.look(levels, lines, width, position)
        position, width = look.position, look.blur
    return float(np.mean(position - PHASES_PX))
