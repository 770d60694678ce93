"""Write one picture for each processing step, numbered in order."""

import re
from collections.abc import Sequence
from pathlib import Path

import cv2

from fingervision.domain.errors import OutputError
from fingervision.domain.frame import Frame, Pixels
from fingervision.vision.pipeline import Settings, steps


def write_steps(
    frame: Frame, settings: Settings, folder: Path, more: Sequence[tuple[str, Pixels]] = ()
) -> tuple[Path, ...]:
    """Write the picture of every processing step of one frame as `01_grey.png`, `02_...` and so on.

    Parameters
    ----------
    frame : Frame
        The frame.
    settings : Settings
        Settings of the measurement.
    folder : Path
        Folder for the pictures; created if missing.
    more : sequence of (str, ndarray)
        Names and pictures of further steps.

    Returns
    -------
    tuple of Path
        Paths of the pictures, in order.

    Raises
    ------
    OutputError
        If a picture cannot be written.
    """
    written = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for number, (name, picture) in enumerate((*steps(frame, settings), *more), start=1):
            path = folder / f"{number:02d}_{re.sub('[^a-z0-9]+', '_', name.lower()).strip('_')}.png"
            stored = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)
            path.write_bytes(cv2.imencode(".png", stored)[1].tobytes())
            written.append(path)
    except OSError as error:
        raise OutputError(
            f"The pictures of the steps could not be written to {folder} ({error.strerror}): "
            "free disk space or name another folder with --out, and measure again."
        ) from error
    return tuple(written)
