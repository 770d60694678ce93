"""Fit of a smooth response curve to levels of known relative light, with an unknown factor for each scene point.

The logarithm ln f of the light is that of a power law plus a smooth correction: camera responses are nearly power laws
(Grossberg & Nayar, 2004, doi:10.1109/TPAMI.2004.88), and a smooth curve for the logarithm alone would diverge at level
0.
"""

import numpy as np
from numpy.typing import NDArray

from calib.camera_response import CameraResponse, MeasuredResponse

Floats = NDArray[np.float64]

# Smallest and largest level that are used, as shares of full scale; lower levels are noise of the black level, and
# higher levels are saturated.
LEAST_LEVEL, LARGEST_LEVEL = 0.02, 0.97
# Number of knots of the correction to the power law, and weight of its second differences relative to the readings.
KNOTS, SMOOTHNESS = 17, 3.0
# Smallest number of points of the scene in an exposure series: one for each knot.
FEWEST_LEVELS = KNOTS
# Number of rows of the tabulated curve.
ROWS = 257


def fitted_response(
    level: Floats, usable: NDArray[np.bool_], log_light: Floats, top_level: int, name: str
) -> MeasuredResponse:
    """Fit the response curve by least squares.

    Parameters
    ----------
    level : ndarray of float, shape (n, places)
        Levels as shares of full scale: one row per known light, one column per point of the scene.
    usable : ndarray of bool, shape (n, places)
        Whether each level is used.
    log_light : ndarray of float, shape (n,)
        Natural logarithm of each row's light, up to a constant.
    top_level : int
        Full scale of the pictures.
    name : str
        Name of the response.
    """
    exponent, correction, residual = _fit(level, usable, log_light)
    seen = level[usable]
    return MeasuredResponse(
        curve_of(exponent, correction, top_level, name),
        exponent,
        float(np.sqrt(np.mean(residual**2))),
        (float(seen.min()), float(seen.max())),
    )


def curve_of(exponent: float, correction: Floats, top_level: int, name: str) -> CameraResponse:
    """Tabulate a power law with a correction of the light's logarithm at the knots, shape (KNOTS,)."""
    share = np.linspace(0.0, 1.0, ROWS)
    light = share**exponent * np.exp(np.interp(share, np.linspace(0.0, 1.0, KNOTS), correction))
    light = np.maximum.accumulate(light / light[-1]) + 1e-9 * share
    return CameraResponse(name, share, (light - light[0]) / (light[-1] - light[0]), top_level)


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
    # The logarithm of a level near black has a large uncertainty, and hence a small weight.
    weight = share / (share + 0.05)
    bends = np.zeros((KNOTS, design.shape[1]))
    for knot in range(1, KNOTS - 1):
        bends[knot, knot : knot + 3] = SMOOTHNESS * np.sqrt(rows / KNOTS) * np.array([1.0, -2.0, 1.0])
    # The correction is zero at full scale, and contains no part that the power law can represent.
    bends[0, KNOTS] = bends[-1, 1] = np.sqrt(rows)
    solved, *_ = np.linalg.lstsq(
        np.vstack([design * weight[:, None], bends]), np.concatenate([wanted * weight, np.zeros(KNOTS)]), rcond=None
    )
    return float(solved[0]), solved[1 : 1 + KNOTS], np.asarray((design @ solved - wanted) * weight)
