"""Open a recording or a run folder for playback, with the settings of its original measurement."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from calib.calibration import BareScale
from fingervision.domain.direction import Direction
from fingervision.domain.errors import DataError, FingervisionError
from fingervision.domain.frame import Frame, LostFrame, Region
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.frames.source import Description, FrameSource, Wish
from fingervision.frames.source_kinds import open_source
from fingervision.live.choices import Choices
from fingervision.live.frame_measurement import FrameMeasurement, Seen
from fingervision.storage.beside import optional_document
from fingervision.storage.calibration_json import read_calibration
from fingervision.storage.gaps_csv import GapRow
from fingervision.storage.run_files import RUN

# One frame of a recording with its table row, and with a separate measurement of this frame.


# Grey level of the even picture that is shown in place of a frame that could not be decoded.
NO_PICTURE_LEVEL = 90
IN_THE_TABLE = "This result is from the table, for which the preceding frames were used too."


def recorded_frame(item: Frame | LostFrame, row: GapRow | None, choices: Choices, description: Description) -> Seen:
    """Combine picture, measured points and table row of a frame.

    Parameters
    ----------
    item : Frame or LostFrame
        The frame as read from the recording.
    row : GapRow or None
        Row of this frame in the table of the recording; None until the measurement has reached this frame.
    choices : Choices
        Settings of the measurement.
    description : Description
        Description of the recording.

    Returns
    -------
    Seen
        The frame with its row from the table, whose measurement uses the preceding frames; until this row exists, a row
        from the measurement of the single frame.
    """
    if isinstance(item, LostFrame):
        pixels = np.full((description.height_px, description.width_px), NO_PICTURE_LEVEL, np.uint8)
        frame = Frame(pixels, item.index, item.time_s, description.coding)
        return Seen(frame, NoGap(item.status, item.words), row or GapRow(item.index, item.time_s, item.status))
    polarity = None if row is None or not row.fingers else row.fingers == "dark"
    measurement = FrameMeasurement((description.width_px, description.height_px), description.files, polarity)
    _, outcome, own = measurement.measured(item, choices)
    if row is None or own is None or row.status is own.status:
        return Seen(item, outcome, row or own)
    if isinstance(outcome, GapMeasurement) or outcome is None:
        outcome = NoGap(row.status, IN_THE_TABLE)
    return Seen(item, replace(outcome, words=IN_THE_TABLE), row)


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recording for playback.

    Parameters
    ----------
    name : str
        Name of the recording for `measure`; for a run folder, the video in this folder.
    source : FrameSource
        Source of the frames.
    choices : Choices
        Settings of the measurement: those of the run, unless the user states others.
    options : tuple of str
        Further options for `measure`, such as a frame rate or a drive log.
    """

    name: str
    source: FrameSource
    choices: Choices
    options: tuple[str, ...]


def is_recording(name: str) -> bool:
    """Whether a source is a recording (a file, images, a run folder), not a camera or stream."""
    path = Path(name)
    if (path / RUN).is_file():
        return True
    if "://" in name or str(path).startswith("/dev/"):
        return False
    return path.exists() or any(sign in name for sign in "*?[")


def recorded(name: str, rate_hz: float | None, choices: Choices, drive: tuple[str, ...]) -> Recorded:
    """Open a recording or a run folder.

    Parameters
    ----------
    name : str
        A video file, a folder of images, a glob pattern, or a run folder.
    rate_hz : float or None
        Frame rate of images without times.
    choices : Choices
        Settings chosen by the user; without a scale, the scale and the settings of the run apply.
    drive : tuple of str
        Options of `measure` for a drive log, if one was given.

    Raises
    ------
    DataError, InputFileError, UsageError
        The recording cannot be opened, or the folder of the run has no video.
    """
    path = Path(name)
    folder = path if path.is_dir() else path.parent
    about = optional_document(folder / RUN)
    video = about.get("video")
    if path.is_dir() and about:
        if not isinstance(video, str) or not (folder / video).is_file():
            raise DataError(f"{name} must be the folder of a run with its video, but has no video: name a video.")
        name = str(folder / video)
    is_of_run = isinstance(video, str) and (folder / video) == Path(name)
    if is_of_run and choices.scale is None:
        choices = _as_in_run(folder, about, choices)
    samples = about.get("samples")
    if is_of_run and not drive and isinstance(samples, str) and (folder / samples).is_file():
        # The table of a test-bed run states the stage's position at the time of every frame, so that no offset is
        # needed.
        drive = ("--drive", str(folder / samples), "--drive-offset-s", "0")
    rate = () if rate_hz is None else ("--rate-hz", repr(rate_hz))
    return Recorded(name, open_source(name, Wish(rate_hz=rate_hz)), choices, (*rate, *drive))


def _as_in_run(folder: Path, about: dict[str, Any], choices: Choices) -> Choices:
    """Take scale and settings from a run; the user must state a scale or setting that cannot be read."""
    try:
        scale, settings = about["scale"], about["settings"]
        file = scale.get("calibration")
        box, tips = settings.get("roi"), settings.get("tips", "auto")
        return Choices(
            scale=BareScale(float(scale["px_per_mm"])) if file is None else read_calibration(folder / str(file)),
            scale_file=None if file is None else folder / str(file),
            below_tip_mm=float(settings["below_tip_mm"]),
            direction=None if tips == "auto" else Direction(tips),
            region=None if box is None else Region(*(int(side) for side in box)),
            fingers=choices.fingers,
        )
    except FingervisionError:  # a file that exists but is no calibration
        raise
    except (KeyError, TypeError, ValueError, AttributeError):
        return choices
