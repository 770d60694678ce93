"""Camera response from one picture of a grey wedge whose fields have certified optical densities.

A field of density D reflects (or transmits) 10**-D of the light (ISO 5-1), so that ln f(level) = -D ln 10 plus a
constant for the whole wedge: the same equation as for an exposure series of a single point of a scene.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from calib.camera_response import MeasuredResponse
from calib.errors import CalibrationError
from calib.response_curve import LARGEST_LEVEL, LEAST_LEVEL, fitted_response

Floats = NDArray[np.float64]
Grey = NDArray[np.uint8] | NDArray[np.uint16]

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
