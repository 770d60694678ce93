"""Camera response from known light: a grey wedge of certified densities, or one scene at several exposures.

For both, the logarithm of the light is known up to a constant for each point of the scene, and ln f(level) is fitted to
it. It is that of a power law plus a smooth correction: camera responses are nearly power laws (Grossberg & Nayar, 2004,
doi:10.1109/TPAMI.2004.88), and a smooth curve for the logarithm alone would diverge at level 0.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.camera_response import CameraResponse, MeasuredResponse
from calib.errors import CalibrationError

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

    The light at a pixel is the scene's radiance times the exposure; the radiances and the response curve are estimated
    together by least squares (Debevec & Malik, SIGGRAPH 1997, doi:10.1145/258734.258884).

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

    Examples
    --------
    >>> import numpy as np, calib
    >>> light = np.kron(np.linspace(0.02, 1.0, 48).reshape(6, 8), np.ones((16, 16)))
    >>> exposures = [1.0, 0.5, 0.25, 0.125]
    >>> pictures = [np.rint(255.0 * (light * each) ** (1 / 2.2)).astype(np.uint8) for each in exposures]
    >>> measured = calib.response_from_exposures(pictures, exposures, 255, "my camera")
    >>> print(f"exponent {measured.exponent:.1f}")
    exponent 2.2
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


FEWEST_FIELDS = 6
"""Least number of fields between black and white for a curve, twice the number of parameters of a power law with one
correction.
"""
MIDDLE = 0.25
"""Share of a field that is left out at each of its borders."""
LARGEST_SPREAD = 0.5
"""Largest difference between the thirds of a field, as a share of the step to the next field; more indicates a border
or a reflection."""


def response_from_wedge(
    grey: Grey, densities: Sequence[float], top_level: int, name: str, region: tuple[int, int, int, int] | None = None
) -> MeasuredResponse:
    """Fit a camera response to the fields of a grey wedge.

    A field of density D reflects (or transmits) 10**-D of the light (ISO 5-1), so that ln f(level) = -D ln 10 plus a
    constant for the whole wedge: the same equation as for an exposure series of a single point of a scene.

    Parameters
    ----------
    grey : ndarray, shape (height, width)
        Picture of the wedge, evenly lit. The fields are arranged along the longer side of the region.
    densities : sequence of float
        Optical density of each field, from the lightest to the darkest.
    top_level : int
        Full scale of the picture.
    name : str
        Name of the response.
    region : (x, y, width, height), optional
        Region of the wedge's fields in the picture, in pixels; the whole picture by default.

    Raises
    ------
    CalibrationError
        If there are too few fields, the densities do not increase, or the region does not show the fields.
    """
    stated = np.asarray(densities, dtype=np.float64)
    if stated.size < FEWEST_FIELDS or not np.isfinite(stated).all() or not (np.diff(stated) > 0.0).all():
        raise CalibrationError(
            f"A grey wedge must have at least {FEWEST_FIELDS} fields with increasing densities, but has "
            f"{', '.join(f'{value:g}' for value in stated[:8])}: state the densities of its certificate."
        )
    level, spread = _field_levels(grey, stated.size, top_level, region)
    if level[0] < level[-1]:
        level, spread = level[::-1], spread[::-1]
    steps = -np.diff(level)
    usable = (level > LEAST_LEVEL) & (level < LARGEST_LEVEL)
    seen = usable[:-1] & usable[1:]
    blurred = spread[:-1][seen] > LARGEST_SPREAD * np.maximum(steps[seen], 1.0 / top_level)
    if np.count_nonzero(usable) < FEWEST_FIELDS or (steps[seen] <= 0.0).any() or blurred.any():
        raise CalibrationError(
            f"The region must show {stated.size} uniform fields, each darker than the previous field, of which at "
            f"least {FEWEST_FIELDS} are neither black nor white, but does not: limit --roi to the fields of the "
            "wedge, light the wedge evenly, and state one density for each field."
        )
    return fitted_response(level[None, :].T, usable[None, :].T, -stated * np.log(10.0), top_level, name)


def _field_levels(
    grey: Grey, fields: int, top_level: int, region: tuple[int, int, int, int] | None
) -> tuple[Floats, Floats]:
    """Mean and scatter of the levels in the central part of each field, as shares of full scale; shape (fields,)."""
    x, y, width, height = region if region is not None else (0, 0, grey.shape[1], grey.shape[0])
    part = grey[y : y + height, x : x + width].astype(np.float64) / top_level
    part = part if part.shape[1] >= part.shape[0] else part.T
    if part.shape[1] < 4 * fields or part.shape[0] < 4:
        raise CalibrationError(
            f"The region must show {fields} fields of at least four pixels each, but is {part.shape[1]} by "
            f"{part.shape[0]} pixels: set --roi to the wedge."
        )
    rows = part[int(MIDDLE * part.shape[0]) : part.shape[0] - int(MIDDLE * part.shape[0])]
    ends = np.linspace(0.0, part.shape[1], fields + 1)
    inner = [
        rows[:, int(np.ceil(a + MIDDLE * (b - a))) : max(int(b - MIDDLE * (b - a)), int(a) + 1)]
        for a, b in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True)
    ]
    # Thirds of a field are averaged before they are compared, so that noise does not look like a border between fields.
    thirds = [[part.mean() for part in np.array_split(field, 3, axis=1) if part.size] for field in inner]
    return np.array([field.mean() for field in inner]), np.array([np.ptp(means) for means in thirds])
