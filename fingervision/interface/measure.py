"""`fingervision.measure`: the finger gap in a picture, a recording or a camera's next frames."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from calib.calibration import BareScale
from fingervision.frames.source import FrameSource, Wish
from fingervision.frames.source_kinds import open_source
from fingervision.interface.argument_checks import region_of, speaks_python
from fingervision.interface.frame_sources import recording_of
from fingervision.interface.measurement import Measurement
from fingervision.interface.measuring_task import measuring_task, range_of, scale_of
from fingervision.interface.progress import shown
from fingervision.measuring.frame_loop import Progress
from fingervision.measuring.in_memory import measure_in_memory
from fingervision.measuring.measure import Measured
from fingervision.measuring.measure import measure as measure_to_files
from fingervision.measuring.output_folder import usual_folder
from fingervision.measuring.task import Task
from fingervision.storage.summary_json import refuse_other_recording

if TYPE_CHECKING:
    import os

    import numpy as np
    from numpy.typing import NDArray

    from calib.camera_response import CameraResponse
    from fingervision.domain.drive import DriveHistory
    from fingervision.gauges.gauge_file import Gauge
    from fingervision.interface.calibration import Calibration

FLOAT_BITS = 16
"""Bit depth to which pictures given as floats are converted."""


@speaks_python
def measure(
    source: "NDArray[np.generic] | Iterable[NDArray[np.generic]] | str | os.PathLike[str] | int | FrameSource",
    *,
    calibration: "str | os.PathLike[str] | Calibration | None" = None,
    px_per_mm: float | None = None,
    u_px_per_mm: float | None = None,
    below_tip_mm: float = 0.3,
    tips: str = "auto",
    roi: Sequence[int] | None = None,
    rate_hz: float | None = None,
    times_s: Iterable[float] | None = None,
    drive: "str | os.PathLike[str] | DriveHistory | Any" = None,
    drive_offset_s: float | None = None,
    columns: "str | os.PathLike[str] | None" = None,
    response: "str | os.PathLike[str] | CameraResponse" = "auto",
    bits: int | None = None,
    fingers: str | None = None,
    face: str = "front",
    coding: str = "lossless",
    frames: int | tuple[int, int] | None = None,
    gauges: "str | os.PathLike[str] | Sequence[Gauge] | None" = None,
    progress: Callable[[int, int | None], None] | bool | None = None,
) -> Measurement:
    """Measure the gap between two fingers in a picture, a recording or a camera's next frames; write nothing.

    The gap is the distance between the fingers' inner edges at `below_tip_mm` below their tips, with its standard
    uncertainty. A frame without a gap states the reason in its status; no exception is raised for it.

    Parameters
    ----------
    source : ndarray, iterable of ndarray, path, int or FrameSource
        Either an array: one picture of shape (height, width) or (height, width, 3), or a stack of pictures with the
        frames as first dimension, in uint8, uint16, or float from 0 (black) to 1 (full scale). Colours are red, green,
        blue; an alpha channel must be opaque. A three-dimensional array is a single picture in colour if its last
        dimension is 3 or 4. Or a list, a generator or another iterable of single pictures of equal size, of which
        only one is in memory at a time. Or the name of a video file, an image, a folder of images, a glob, a camera or
        a stream; or the number of a camera; or an object of a user's class, with `description` and `__iter__`.
    calibration : path, Calibration or None
        The scale with its uncertainty; one of `calibration` and `px_per_mm` is required.
    px_per_mm : float or None
        Scale in pixels per mm; without `u_px_per_mm`, only the random part of the uncertainty is given.
    u_px_per_mm : float or None
        Standard uncertainty of `px_per_mm` in pixels per mm, such as that of a ruler; `u_gap_mm` then includes this
        uncertainty, an unknown edge bias, and the default limits of the set-up.
    below_tip_mm : float
        Distance (mm) below each finger's tip at which the gap is measured.
    tips : str
        Where the fingers point in the picture: auto, up, down, left or right.
    roi : (int, int, int, int) or None
        Region of interest: first column, first row, width, height in pixels.
    rate_hz : float or None
        Pictures per second, if the pictures carry no times.
    times_s : iterable of float or None
        Time (s) of every picture of an array, or of an iterable of arrays.
    drive : path, DriveHistory, DataFrame or mapping of columns, or None
        The recorded input, `time_s,input_mm[,run][,force_n]`.
    drive_offset_s : float or None
        Clock offset, added to the drive's times; None determines it from the motion.
    columns : path or None
        A columns.toml that states the meaning of the columns of a drive table from another program.
    response : str, path or CameraResponse
        Light that each grey level stands for: auto, linear, srgb, bt709 or a file.
    bits : int or None
        True bit depth of levels that are stored in 16 bits, if it is not 16.
    fingers : str or None
        Whether the fingers are darker or lighter than the background: auto, dark or light; none measures no gap. By
        default auto; with gauges, the picture need not show fingers.
    face : str
        Edge of a thick part: front, of the face towards the camera, or outline.
    coding : str
        Compression of an array's pictures before: lossless, intraframe (JPEG) or interframe (H.264). After lossy
        compression the errors of neighbouring pixels are correlated, and the uncertainty is larger.
    frames : int, (int, int) or None
        Number of frames to measure from a camera; or first and last frame of a recording, counted from 0, both
        included.
    gauges : path, sequence of Gauge, or None
        Gauges to measure in addition to the gap; their values are in `gauge_rows`.
    progress : callable, bool or None
        Called repeatedly with the number of measured frames and the number of frames that the source announces; True
        shows a progress bar on a terminal or in a notebook.

    Returns
    -------
    Measurement
        The result, with one row per frame.

    Raises
    ------
    UsageError
        An argument has an impossible value; `ArgumentError` names the argument and says what it must be.
    DataError, InputFileError, OpenQuestionError
        The recording, the calibration or the drive cannot be read.

    Examples
    --------
    >>> import numpy as np
    >>> import fingervision as fv
    >>> from fingervision.rendering import two_fingers, Camera, render
    >>> picture = render(two_fingers(68.0, below_tip_px=10.2), Camera(), np.random.default_rng(1))
    >>> measured = fv.measure(picture, px_per_mm=34.0)
    >>> print(f"{measured[0].gap_mm:.2f} mm, {measured[0].status}")
    2.00 mm, ok
    """
    own = source == "simulated" if isinstance(source, str) else hasattr(source, "px_per_mm")
    if own and calibration is None and px_per_mm is None and u_px_per_mm is None:
        scale: Any = (BareScale(_own_scale(source)), None)
    else:
        scale = scale_of(calibration, px_per_mm, u_px_per_mm)
    part, count = range_of(frames)
    again = recording_of(source, rate_hz=rate_hz, times_s=times_s, frames=count, coding=coding)
    recording = again()
    task = measuring_task(
        scale=scale,
        below_tip_mm=below_tip_mm,
        tips=tips,
        roi=region_of(roi),
        drive=drive,
        drive_offset_s=drive_offset_s,
        columns=None if columns is None else Path(columns),
        response=response,
        bits=FLOAT_BITS if bits is None and getattr(recording, "has_float_levels", False) else bits,
        fingers=fingers,
        face=face,
        frames=part,
        gauges=gauges,
    )
    with shown(progress, "Measuring", "frames") as show:
        found = measure_in_memory(recording, task, show)
    if found.stopped:
        raise KeyboardInterrupt
    return Measurement(found, again)


def measure_into(
    folder: Path | None, recording: str, task: Task, rate_hz: float | None, *, progress: Progress | bool | None = None
) -> Measured:
    """Measure a recording and write each row as soon as it is measured, so that any length fits into memory.

    Parameters
    ----------
    folder : Path or None
        Folder for the results; None takes measured/<name of the recording>.
    recording : str
        A video file, a folder of images, or a glob.
    task : Task
        Settings of the measurement.
    rate_hz : float or None
        Images per second, if the images carry no times.
    progress : callable, bool or None
        The same as the argument `progress` of `measure`.

    Raises
    ------
    UsageError, FingervisionError
        For the same reasons as in `measure`; or the folder holds the results of another recording, or cannot be
        written.
    """
    source = open_source(recording, Wish(rate_hz=rate_hz))
    out = folder or usual_folder(recording)
    refuse_other_recording(out, recording)
    with shown(progress, "Measuring", "frames") as show:
        return measure_to_files(source, task, out, show)


def _own_scale(source: Any) -> float:
    """Return the scale of a drawn (rendered) source, which is known without being stated."""
    from fingervision.frames.simulated import PX_PER_MM

    return PX_PER_MM if isinstance(source, str) else float(source.px_per_mm)
