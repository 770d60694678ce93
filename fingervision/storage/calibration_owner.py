"""Protection of files against overwriting: a calibration may replace only an older calibration and its pictures."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import OutputError
from fingervision.storage.plain_file import json_of


def refuse_foreign(out: Path) -> None:
    """Refuse to overwrite a file that is not a calibration.

    Raises
    ------
    OutputError
        The path holds a file that is not a calibration.
    """
    if not out.exists():
        return
    try:
        content = json_of(out)
    except (OSError, ValueError):
        content = None
    if not (isinstance(content, dict) and "px_per_mm" in content):
        raise OutputError(f"{out} exists already and is not a calibration; name another file with -o.")


def write_picture(out: Path, name: str, picture: NDArray[np.uint8]) -> None:
    """Write a picture of a calibration (an RGB array) beside the calibration's file.

    Raises
    ------
    OutputError
        The file or folder cannot be written.
    """
    import cv2

    path = out.with_name(f"{out.stem}_{Path(name).stem}.png")
    written, content = cv2.imencode(".png", picture[:, :, ::-1])
    if written:
        try:
            path.write_bytes(content.tobytes())
        except OSError as error:
            raise OutputError(f"The picture {path} could not be written: {error.strerror}.") from error


__all__ = ["refuse_foreign", "write_picture"]
