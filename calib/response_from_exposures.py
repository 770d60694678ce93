"""Camera response from pictures of one static scene at several known exposures.

The light at a pixel is the scene's radiance times the exposure, so that the response curve f satisfies ln f(level) = ln
radiance + ln exposure. The radiances and the response curve f are estimated together by least squares (Debevec & Malik,
SIGGRAPH 1997, doi:10.1145/258734.258884).
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.camera_response import MeasuredResponse
from calib.errors import CalibrationError
from calib.response_curve import FEWEST_LEVELS, LARGEST_LEVEL, LEAST_LEVEL, fitted_response

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8] | NDArray[np.uint16]

# Smallest number of pictures, and smallest ratio of the longest to the shortest exposure.
FEWEST_PICTURES, LEAST_RATIO = 3, 2.0
# Side of the squares (pixels) over which levels are averaged, and share of the squares, the most uniform ones, that are
# used, because noise and edges would distort the curve.
SIDE_PX, FLAT_SHARE = 8, 0.5
# Largest number of squares, evenly distributed over the levels.
PLACES = 400


def response_from_exposures(
    pictures: Sequence[Grey], exposures: Sequence[float], top_level: int, name: str
) -> MeasuredResponse:
    """Fit a camera response to a series of exposures.

    Parameters
    ----------
    pictures : sequence of ndarray, each of shape (height, width)
        Pictures of one static scene, with focus, aperture and light unchanged.
    exposures : sequence of float
        Exposure of each picture, in any unit.
    top_level : int
        Full scale of the pictures.
    name : str
        Name of the response.

    Raises
    ------
    CalibrationError
        If there are too few pictures, the exposures are too similar, or the scene has no uniform areas.
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
    if np.count_nonzero(keep) < FEWEST_LEVELS:
        raise CalibrationError(
            "The scene must have uniform areas that are neither black nor white in at least two pictures, but has too "
            "few: take a sheet of paper with shades of grey, and exposures nearer to each other."
        )
    level, usable = level[:, keep], usable[:, keep]
    return fitted_response(level, usable, np.log(times), top_level, name)


def _flat_levels(pictures: Sequence[Grey], top_level: int) -> Floats:
    """Mean levels of uniform squares, as shares of full scale; shape (pictures, squares)."""
    height, width = (size // SIDE_PX * SIDE_PX for size in pictures[0].shape)
    means, spreads = [], []
    for picture in pictures:
        share = picture[:height, :width].astype(np.float32) / top_level
        squares = share.reshape(height // SIDE_PX, SIDE_PX, width // SIDE_PX, SIDE_PX)
        means.append(squares.mean(axis=(1, 3), dtype=np.float64).ravel())
        spreads.append(squares.std(axis=(1, 3), dtype=np.float64).ravel())
        # A square with any clipped pixel is excluded in this picture, because its mean would be too low.
        full = cv2.erode((share < LARGEST_LEVEL).astype(np.uint8), np.ones((3, 3), dtype=np.uint8))
        cut = full.reshape(height // SIDE_PX, SIDE_PX, width // SIDE_PX, SIDE_PX).min(axis=(1, 3)).ravel() == 0
        means[-1][cut] = 1.0
    level, spread = np.array(means), np.array(spreads).max(axis=0)
    flat = np.flatnonzero(spread <= np.quantile(spread, FLAT_SHARE))
    order = flat[np.argsort(level[:, flat].mean(axis=0))]
    chosen = order[np.unique(np.linspace(0, order.size - 1, PLACES).astype(int))]
    return level[:, chosen]
