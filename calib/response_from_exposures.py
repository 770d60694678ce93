"""A camera's response from pictures of one still scene at several known exposures.

A pixel's light is its scene's times the exposure, whatever the scene: ln f(level) = ln scene + ln exposure. Scene and
f are found together by least squares (Debevec & Malik, SIGGRAPH 1997, doi:10.1145/258734.258884). Here ln f is a power
law and a smooth correction to it: cameras are nearly power laws, and the logarithm alone has no end at level 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.camera_response import CameraResponse
from calib.errors import CalibrationError

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8] | NDArray[np.uint16]

# Pictures, and the ratio of the longest to the shortest exposure, that a curve needs.
FEWEST_PICTURES, LEAST_RATIO = 3, 2.0
# Levels are means over squares of this side (pixels) that are flat: noise and edges would bend the curve.
SIDE_PX, FLAT_SHARE = 8, 0.5
# Levels that are used, shares of full scale: below is the black level's noise, above the sensor is full.
LEAST_LEVEL, LARGEST_LEVEL = 0.02, 0.97
# Places in the scene, evenly spread over its levels.
PLACES = 400
# Knots of the correction to the power law, and the weight of its bends against one reading of 1 % (smooth as film and
# sensors are: Grossberg & Nayar, 2004, doi:10.1109/TPAMI.2004.88).
KNOTS, SMOOTHNESS = 17, 3.0
# Rows of the result.
ROWS = 257


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredResponse:
    """A response with how well it explains its pictures.

    Parameters
    ----------
    response : CameraResponse
        The curve.
    exponent : float
        Of the power law that is nearest; 1 for a linear camera, about 2.2 for consumer cameras.
    rms_relative : float
        Root mean square of what is left, as a share of the light.
    covered : (float, float)
        Least and largest level that the pictures showed, shares of full scale; beyond them the curve is extended.
    """

    response: CameraResponse
    exponent: float
    rms_relative: float
    covered: tuple[float, float]


def response_from_exposures(
    pictures: Sequence[Grey], exposures: Sequence[float], top_level: int, name: str
) -> MeasuredResponse:
    """Find a camera's response.

    Parameters
    ----------
    pictures : sequence of ndarray, each of shape (height, width)
        One still scene, with its focus, aperture and light left alone.
    exposures : sequence of float
        Exposure of each, in any unit.
    top_level : int
        Full scale of the pictures.
    name : str
        What the response is called.

    Raises
    ------
    CalibrationError
        Too few pictures, exposures too alike, or nothing in the scene that is flat.
    """
    times = np.asarray(exposures, dtype=np.float64)
    if len(pictures) < FEWEST_PICTURES or not (times > 0.0).all() or times.max() < LEAST_RATIO * times.min():
        raise CalibrationError(
            f"A response needs at least {FEWEST_PICTURES} pictures with exposures that differ by a factor of "
            f"{LEAST_RATIO:g} or more, but there are {len(pictures)} with {', '.join(f'{time:g}' for time in times)}."
        )
    level = _flat_levels(pictures, top_level)
    usable = (level > LEAST_LEVEL) & (level < LARGEST_LEVEL)
    keep = usable.sum(axis=0) >= 2
    if np.count_nonzero(keep) < KNOTS:
        raise CalibrationError(
            "The scene must have flat parts that are neither black nor white in two of the pictures, but has not: "
            "take a sheet of paper with shades on it, and exposures nearer to each other."
        )
    level, usable = level[:, keep], usable[:, keep]
    exponent, correction, residual = _fit(level, usable, np.log(times))
    seen = level[usable]
    share = np.linspace(0.0, 1.0, ROWS)
    light = share**exponent * np.exp(np.interp(share, np.linspace(0.0, 1.0, KNOTS), correction))
    light = np.maximum.accumulate(light / light[-1]) + 1e-9 * share
    curve = CameraResponse(name, share, (light - light[0]) / (light[-1] - light[0]), top_level)
    rms = float(np.sqrt(np.mean(residual**2)))
    return MeasuredResponse(curve, exponent, rms, (float(seen.min()), float(seen.max())))


def _flat_levels(pictures: Sequence[Grey], top_level: int) -> Floats:
    """Mean levels of flat squares, shape (pictures, places), shares of full scale."""
    height, width = (size // SIDE_PX * SIDE_PX for size in pictures[0].shape)
    means, spreads = [], []
    for picture in pictures:
        share = picture[:height, :width].astype(np.float32) / top_level
        squares = share.reshape(height // SIDE_PX, SIDE_PX, width // SIDE_PX, SIDE_PX)
        means.append(squares.mean(axis=(1, 3), dtype=np.float64).ravel())
        spreads.append(squares.std(axis=(1, 3), dtype=np.float64).ravel())
        # A square that a full sensor cuts off anywhere says less light than there was.
        full = cv2.erode((share < LARGEST_LEVEL).astype(np.uint8), np.ones((3, 3), dtype=np.uint8))
        cut = full.reshape(height // SIDE_PX, SIDE_PX, width // SIDE_PX, SIDE_PX).min(axis=(1, 3)).ravel() == 0
        means[-1][cut] = 1.0
    level, spread = np.array(means), np.array(spreads).max(axis=0)
    flat = np.flatnonzero(spread <= np.quantile(spread, FLAT_SHARE))
    order = flat[np.argsort(level[:, flat].mean(axis=0))]
    chosen = order[np.unique(np.linspace(0, order.size - 1, PLACES).astype(int))]
    return level[:, chosen]


def _fit(level: Floats, usable: NDArray[np.bool_], log_time: Floats) -> tuple[float, Floats, Floats]:
    """Exponent, correction at the knots, and residuals of ln light."""
    picture, place = np.nonzero(usable)
    share = level[usable]
    rows, places = share.size, level.shape[1]
    design = np.zeros((rows, 1 + KNOTS + places))
    design[:, 0] = np.log(share)
    at = share * (KNOTS - 1)
    left = np.minimum(at.astype(int), KNOTS - 2)
    design[np.arange(rows), 1 + left] = 1.0 - (at - left)
    design[np.arange(rows), 2 + left] = at - left
    design[np.arange(rows), 1 + KNOTS + place] = -1.0
    wanted = log_time[picture]
    # A level near black is the less sure in its logarithm the lower it is.
    weight = share / (share + 0.05)
    bends = np.zeros((KNOTS, design.shape[1]))
    for knot in range(1, KNOTS - 1):
        bends[knot, knot : knot + 3] = SMOOTHNESS * np.sqrt(rows / KNOTS) * np.array([1.0, -2.0, 1.0])
    # The correction is nothing at full scale, and what it has in common with the power law is left to that.
    bends[0, KNOTS] = bends[-1, 1] = np.sqrt(rows)
    solved, *_ = np.linalg.lstsq(
        np.vstack([design * weight[:, None], bends]), np.concatenate([wanted * weight, np.zeros(KNOTS)]), rcond=None
    )
    return float(solved[0]), solved[1 : 1 + KNOTS], np.asarray((design @ solved - wanted) * weight)
