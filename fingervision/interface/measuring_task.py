"""Build the settings of a measurement from the options of a command or the arguments of a function."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from calib.measured_scale import Calibration as MeasuredScale
from fingervision.domain.direction import Direction
from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import ArgumentError, ArgumentTypeError, UsageError
from fingervision.domain.frame import Region
from fingervision.frames.array_levels import what_it_is
from fingervision.gauges.gauge_file import Gauge, read_gauges
from fingervision.interface.argument_checks import number, one_of, whole_number
from fingervision.measuring.scale import Scale, check_one_scale, stated_scale
from fingervision.measuring.task import FINGERS, IF_SEEN, NO_FINGERS, Task, fingers_asked
from fingervision.storage.calibration_json import read_calibration
from fingervision.storage.response_csv import response_named

TIPS = ("auto", *(direction.value for direction in Direction))
FACES = ("front", "outline")
BITS = (8, 16)


def scale_of(calibration: Any, px_per_mm: Any, u_px_per_mm: Any = None) -> tuple[Scale, Path | None]:
    """Return the scale, and the file from which it was read.

    Parameters
    ----------
    calibration : path, Calibration or None
        A calibration, or the path of a calibration.json.
    px_per_mm : float or None
        The scale without a calibration, in pixels per mm.
    u_px_per_mm : float or None
        Standard uncertainty of `px_per_mm`.

    Raises
    ------
    UsageError
        Both a calibration and a scale are given, or neither; or the scale is outside the range of real cameras, or its
        uncertainty is impossible.
    DataError, InputFileError
        The calibration cannot be read.
    """
    check_one_scale(calibration, px_per_mm, u_px_per_mm)
    if calibration is not None:
        if isinstance(calibration, str | os.PathLike):
            return read_calibration(Path(calibration)), Path(calibration)
        scale = getattr(calibration, "scale", calibration)
        if not isinstance(scale, MeasuredScale):
            raise ArgumentTypeError(
                "calibration", "be a fingervision.Calibration or the name of its file", f"is {what_it_is(calibration)}"
            )
        return scale, getattr(calibration, "path", None)
    if px_per_mm is None:
        raise UsageError(
            "The scale must be given, but is not: add --calibration FILE (made by `fingervision calibrate`) "
            "or --px-per-mm S."
        )
    u = None if u_px_per_mm is None else number("u_px_per_mm", u_px_per_mm)
    return stated_scale(number("px_per_mm", px_per_mm), u), None


def measuring_task(
    *,
    scale: tuple[Scale, Path | None],
    below_tip_mm: float = 0.3,
    tips: str = "auto",
    roi: tuple[int, int, int, int] | None = None,
    drive: Any = None,
    drive_offset_s: float | None = None,
    columns: Path | None = None,
    response: Any = "auto",
    bits: int | None = None,
    fingers: str | None = None,
    face: str = "front",
    overlay: bool = False,
    steps_frame: int | None = None,
    frames: tuple[int, int] | None = None,
    gauges: Any = None,
) -> Task:
    """Combine options or arguments into one task; see `fingervision.measure`.

    Raises
    ------
    UsageError
        An argument has an impossible value.
    DataError, InputFileError, OpenQuestionError
        A file cannot be read.
    """
    from calib.camera_response import CameraResponse

    tips = one_of("tips", tips, TIPS)
    depth = None
    if bits is not None:
        depth = whole_number("bits", bits, BITS[0])
        if depth > BITS[1]:
            raise UsageError(f"--bits must be {BITS[0]} to {BITS[1]}, but is {depth}.")
    if not isinstance(response, str | os.PathLike | CameraResponse):
        raise ArgumentTypeError("response", "be a word or the name of a file", f"is {what_it_is(response)}")
    drawn = _gauges(gauges)
    if fingers is None:
        described = drive is not None or roi is not None or steps_frame is not None or (tips, face) != ("auto", "front")
        asked = fingers_asked(drawn, is_described=described or not drawn)
        fingers = IF_SEEN if asked == NO_FINGERS else asked
    elif fingers == NO_FINGERS and drive is not None:
        raise UsageError(
            "--drive needs the gap between fingers, from whose motion the clock offset is found, but --fingers is "
            "none: leave one of them out."
        )
    log, rests = (None, 0) if drive is None else _drive(drive, columns)
    return Task(
        scale=scale[0],
        scale_file=scale[1],
        below_tip_mm=number("below_tip_mm", below_tip_mm),
        direction=None if tips == "auto" else Direction(tips),
        region=None if roi is None else Region(*roi),
        drive=log,
        drive_rests=rests,
        drive_offset_s=None if drive_offset_s is None else number("drive_offset_s", drive_offset_s),
        overlay=overlay,
        steps_frame=steps_frame,
        response=response if isinstance(response, CameraResponse) else response_named(os.fspath(response)),
        bits=depth,
        fingers=one_of("fingers", fingers, FINGERS),
        is_outline=one_of("face", face, FACES) == "outline",
        frames=frames,
        gauges=drawn,
    )


def range_of(frames: Any) -> tuple[tuple[int, int] | None, Any]:
    """Interpret `frames`: the range of a recording to measure, or the number of frames to take from a camera.

    Returns
    -------
    (int, int) or None
        First and last frame, both included.
    object
        The number of frames, unchecked; None if `frames` is a range or None.

    Raises
    ------
    UsageError
        The argument is neither a range nor a number of frames.
    """
    if frames is None or isinstance(frames, int | np.integer):
        return None, frames
    if isinstance(frames, str) or not hasattr(frames, "__len__") or len(frames) != 2:
        raise ArgumentTypeError(
            "frames",
            "be a number of frames (of a camera), or the first and the last frame (of a recording)",
            f"is {frames!r}",
        )
    first, last = (whole_number("frames", value, 0) for value in frames)
    if first > last:
        raise ArgumentError("frames", "not have a first frame after the last one", f"is ({first}, {last})")
    return (first, last), None


def _gauges(gauges: Any) -> tuple[Gauge, ...]:
    if gauges is None:
        return ()
    if isinstance(gauges, str | os.PathLike):
        return read_gauges(Path(gauges))
    if not isinstance(gauges, Sequence) or not gauges or not all(isinstance(each, Gauge) for each in gauges):
        raise ArgumentTypeError("gauges", "be the name of a gauges.toml or a sequence of gauges", f"is {gauges!r}")
    return tuple(gauges)


def _drive(drive: Any, columns: Path | None) -> tuple[DriveHistory, int]:
    """Read the log; a log with rows only on change gets rows in its rests, whose number is returned, too."""
    from fingervision.motion.log_on_change import with_rests  # needed with a drive only

    return with_rests(_log(drive, columns))


def _log(drive: Any, columns: Path | None) -> DriveHistory:
    if isinstance(drive, DriveHistory):
        return drive
    if isinstance(drive, str | os.PathLike):
        from fingervision.tables.read import read_drive  # slow to import, needed with a drive only

        return read_drive(Path(drive), columns)
    from fingervision.interface.column_tables import drive_from_columns

    return drive_from_columns(drive)
