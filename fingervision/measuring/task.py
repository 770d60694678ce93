"""Settings of a measurement of a recording or of a live view."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any

from calib.camera_response import CameraResponse
from fingervision.domain.camera import CameraModel
from fingervision.domain.direction import Direction
from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import UsageError
from fingervision.domain.frame import Region
from fingervision.frames.source import Description
from fingervision.gauges.gauge_file import Gauge, check_gauges
from fingervision.measuring.gap_budget import choose_response
from fingervision.measuring.scale import Scale, field_of_view, scale_for_frames
from fingervision.vision.flanks import STEEPEST
from fingervision.vision.pipeline import Settings

NO_FINGERS, IF_SEEN = "none", "if_seen"
FINGERS = {"auto": None, "dark": True, "light": False, NO_FINGERS: None, IF_SEEN: None}
"""Whether the fingers are dark, by the name that options and files give it; None: found in the pictures."""


def fingers_asked(gauges: Sequence[Gauge], *, is_described: bool) -> str:
    """Which fingers are meant if the user states none: some if they are described, or if a gauge measures them."""
    return "auto" if is_described or any(gauge.asks_for_fingers for gauge in gauges) else NO_FINGERS


@dataclass(frozen=True, slots=True)
class Task:
    """Settings of a measurement.

    Parameters
    ----------
    scale : Scale
        Conversion from pixels to millimetres.
    scale_file : Path or None
        Calibration file from which the scale was read.
    below_tip_mm : float
        Measuring height: distance below each finger's tip.
    direction : Direction or None
        Direction in which the tips point; None determines it in every frame.
    region : Region or None
        The part of the frame that is measured; None for the whole frame.
    drive : DriveHistory or None
        The recorded input.
    drive_rests : int
        Number of rests into which rows were inserted, because the log has rows on change only (`on_change.with_rests`).
    drive_offset_s : float or None
        Offset that is added to the drive's times to give times of the recording; None finds it from the motion.
    overlay : bool
        Whether a video with the measured edges drawn in is written.
    steps_frame : int or None
        Number of the frame of which every processing step is written as a picture.
    response : CameraResponse or None
        Camera response, if the user knows it.
    bits : int or None
        Bit depth of levels stored in 16 bits; None determines it in every frame.
    fingers : str
        Brightness of the fingers, one of `FINGERS`: auto determines it from the first frames, none asks for no gap, and
        if_seen asks for it only where the frames show fingers.
    is_outline : bool
        Whether a thick part is measured at its whole outline, side walls included, rather than at its front face.
    steepest : float
        Largest inclination of a finger's flank against its axis, in pixels across per pixel along it.
    frames : (int, int) or None
        First and last frame to be measured, counted from 0, both included; None measures all.
    gauges : tuple of Gauge
        Gauges to be measured in addition to the gap; none by default.
    mechanism : mapping or None
        Summary of the poses of a drawing's bodies, for summary.json, if they were followed.
    """

    scale: Scale
    scale_file: Path | None = None
    below_tip_mm: float = 0.3
    direction: Direction | None = None
    region: Region | None = None
    drive: DriveHistory | None = None
    drive_rests: int = 0
    drive_offset_s: float | None = None
    overlay: bool = False
    steps_frame: int | None = None
    response: CameraResponse | None = None
    bits: int | None = None
    fingers: str = "auto"
    is_outline: bool = False
    steepest: float = STEEPEST
    frames: tuple[int, int] | None = None
    gauges: tuple[Gauge, ...] = ()
    mechanism: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.below_tip_mm < float("inf"):
            raise UsageError(f"--below-tip-mm must be positive, but is {self.below_tip_mm:g}.")
        if self.drive_offset_s is not None and not isfinite(self.drive_offset_s):
            raise UsageError(f"--drive-offset-s must be a number of seconds, but is {self.drive_offset_s:g}.")
        if self.steps_frame is not None and self.steps_frame < 0:
            raise UsageError(
                f"--steps (pictures of the processing steps) must be the number of a frame, from 0, but is "
                f"{self.steps_frame}."
            )
        if self.frames is not None and not 0 <= self.frames[0] <= self.frames[1]:
            raise UsageError(
                f"--frames must be FIRST:LAST, counted from 0, with FIRST not above LAST, but is "
                f"{self.frames[0]}:{self.frames[1]}."
            )

    @property
    def has_fingers(self) -> bool:
        """Whether the gap between fingers is asked for."""
        return self.fingers != NO_FINGERS

    @property
    def settings(self) -> Settings:
        """Settings for the image processing that do not depend on the recording."""
        return self.settings_for(())[0]

    def settings_for(self, files: tuple[Path, ...]) -> tuple[Settings, str]:
        """Settings for the image processing of a recording that consists of these files, and a warning if needed."""
        response, words = choose_response(self.response, self.scale, files)
        below_px = self.below_tip_mm * self.scale.px_per_mm
        settings = Settings(
            below_px,
            self.direction,
            self.region,
            self.bits,
            FINGERS[self.fingers],
            self.has_fingers,
            self.is_outline,
            self.steepest,
            CameraModel(response),
        )
        return settings, words

    @property
    def drive_columns(self) -> tuple[str, ...]:
        """Names of the columns that the drive adds to the table."""
        if self.drive is None:
            return ()
        return ("run", "input_mm") if self.drive.force_n is None else ("run", "input_mm", "force_n")


def task_for_frames(task: Task, description: Description) -> Task:
    """Refuse settings that are impossible for frames of a given size; complete the scale by the frames' size.

    Parameters
    ----------
    task : Task
        Settings of the measurement.
    description : Description
        Known properties of the frames.

    Returns
    -------
    Task
        The settings for these frames.

    Raises
    ------
    UsageError
        The region lies outside the frame, or a drive is given for frames without times.
    DataError
        The scale is for other frames.
    """
    width_px, height_px = description.width_px, description.height_px
    region = task.region
    if region is not None and not (
        region.x_px >= 0
        and region.y_px >= 0
        and region.width_px > 0
        and region.height_px > 0
        and region.x_px + region.width_px <= width_px
        and region.y_px + region.height_px <= height_px
    ):
        raise UsageError(
            f"--roi must lie inside the frame of {width_px}x{height_px} pixels, but is "
            f"{region.x_px},{region.y_px},{region.width_px},{region.height_px} (first column, row, width, height)."
        )
    below_px = task.below_tip_mm * task.scale.px_per_mm
    if task.fingers == IF_SEEN and below_px >= max(width_px, height_px):
        task = replace(task, fingers=NO_FINGERS)
    elif task.has_fingers and below_px >= max(width_px, height_px):
        raise UsageError(
            f"--below-tip-mm must lie within the picture of {width_px}x{height_px} pixels, but "
            f"{task.below_tip_mm:g} mm are {below_px:.0f} px at {task.scale.px_per_mm:g} px/mm, at which the picture "
            f"shows {field_of_view((width_px, height_px), task.scale.px_per_mm)}: state a smaller height, or the right "
            "scale."
        )
    if task.drive is not None and not description.has_times:
        raise UsageError(
            f"--drive needs a recording with times, but {description.name} has none: "
            "give --rate-hz, or a times.csv beside the images (times_s for arrays in Python)."
        )
    check_gauges(task.gauges, width_px, height_px)
    return replace(task, scale=scale_for_frames(task.scale, (width_px, height_px)))


def in_words(task: Task, settings: Settings) -> dict[str, Any]:
    """The settings in the form in which summary.json lists them."""
    region = task.region
    return {
        "below_tip_mm": task.below_tip_mm,
        "tips": "auto" if task.direction is None else task.direction.value,
        "roi": None if region is None else [region.x_px, region.y_px, region.width_px, region.height_px],
        "response": settings.response.name,
        "response_known": settings.camera.response.is_known,
        "bits": task.bits,
        "fingers": task.fingers,
        "face": "outline" if task.is_outline else "front",
        "frames": None if task.frames is None else list(task.frames),
        "drive": task.drive is not None,
        "drive_offset_s": task.drive_offset_s if task.drive is not None else None,
    }
