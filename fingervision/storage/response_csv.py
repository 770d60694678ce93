"""File of a camera's response: `level,light`, one row per grey level from 0 to full scale."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from calib.camera_response import CURVES, CameraResponse, standard_response
from calib.errors import CalibrationError
from fingervision.domain.errors import DataError, UsageError
from fingervision.storage.csv_columns import read_columns
from fingervision.storage.durable import written

COLUMNS = ("level", "light")
# Full-scale levels of pictures, by bit depth.
TOP_LEVELS = (255, 1023, 4095, 16383, 65535)


def response_named(name: str) -> CameraResponse | None:
    """Return the response that --response names: a standard curve or a file; None for `auto`.

    Raises
    ------
    UsageError
        The name is neither a standard response nor an existing file.
    DataError
        The file is not a camera response.
    """
    if name == "auto":
        return None
    if name in CURVES:
        return standard_response(name)
    if not Path(name).exists():
        raise UsageError(
            f"--response must be auto, {', '.join(CURVES)} or a file made by `fingervision calibrate response`, "
            f"but is {name}, and there is no such file."
        )
    return read_response(Path(name))


def read_response(path: Path) -> CameraResponse:
    """Read a camera's response from a file.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read, or is not a camera response.
    """
    table = read_columns(path, COLUMNS)
    level, light = (table.numbers(name, complete=True).value for name in COLUMNS)
    top = level[-1] if level.size else 0.0
    if top not in TOP_LEVELS:
        depths = ", ".join(map(str, TOP_LEVELS))
        raise DataError(f"The last level of {path} must be the full scale of a picture ({depths}), but is {top:g}.")
    return _response(path.name, level, light, int(top))


def _response(name: str, level: NDArray[np.float64], light: NDArray[np.float64], top: int) -> CameraResponse:
    span = float(light[-1] - light[0])
    if not span > 0.0:
        raise DataError(f"The second column (light) of the camera response {name} must rise, but does not.")
    try:
        return CameraResponse(name, level / top, (light - light[0]) / span, top)
    except CalibrationError as error:
        raise DataError(str(error)) from error


def write_response(response: CameraResponse, path: Path) -> None:
    """Write a camera's response to a file.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    top = response.top_level or 255
    rows = [f"{top * level:g},{light:.6f}" for level, light in zip(response.level, response.light, strict=True)]
    with written(path, "name another place with -o") as part:
        part.write_text("\n".join((",".join(COLUMNS), *rows)) + "\n", encoding="utf-8")
