"""Folder of a recorded run: video, gaps, events and settings, which are valid even if the program is killed."""

import time
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from calib.measured_scale import Calibration
from fingervision import __version__
from fingervision.domain.camera import CameraModel
from fingervision.domain.errors import FingervisionError, OutputError
from fingervision.domain.frame import Frame, LostFrame
from fingervision.frames.source import Description, OwnPacket
from fingervision.measuring.camera_learning import camera_beside
from fingervision.measuring.run_table import Measured, RunTable
from fingervision.measuring.task import Task
from fingervision.storage.calibration_json import write_calibration
from fingervision.storage.durable import remove_empty
from fingervision.storage.gaps_csv import GapsCsv
from fingervision.storage.recorded_video import RecordedVideo
from fingervision.storage.run_files import (
    CALIBRATION,
    EVENTS,
    LOST,
    RUN,
    SCHEMA,
    VIDEO,
    LostFrames,
    RunFiles,
    device_of,
)

GAPS = "gaps.csv"
RUNS = "????-??-??T??-??-??Z*"
OF_OUT = ("calibration_*.json", "snapshot_*.png", "live_gaps.csv", "live_gauges.csv", "settings.toml")
"""Names of the folders of runs, and of the files that a live view writes beside them."""


@dataclass(frozen=True, slots=True, eq=False)
class RecordedFrame:
    """One frame of a recording: its picture, its coded packets, and what the live view has measured in it."""

    item: Frame | LostFrame
    packets: tuple[OwnPacket, ...]
    seen: Measured | None = None


class RunFolder:
    """Writes the files of a run during the recording.

    Frames are passed to the operating system at once, and rows of the table within a second, so that at most one second
    is lost if the process is killed; the first rows once the camera is learnt from the first frames.

    Parameters
    ----------
    out : Path
        Folder that contains the folders of runs; each of these is named by the start time of its run.
    description : Description
        Description of the source.
    task : Task
        Settings of the measurement.
    template : av.VideoStream or None
        Coded stream of the camera, see `RecordedVideo`.

    Raises
    ------
    FingervisionError
        The folder cannot be written.
    """

    def __init__(self, out: Path, description: Description, task: Task, template: Any) -> None:
        self.path = _new_folder(out)
        self.frames = 0
        self._began = datetime.now(UTC)
        self._about = _about(description, task, self._began)
        self._files = RunFiles(self.path)
        self._files.write_about(self._about, complete=False)
        if isinstance(task.scale, Calibration):
            write_calibration(task.scale, self.path / CALIBRATION)
        self._lost = LostFrames(self.path / LOST)
        self._video = RecordedVideo(self.path / VIDEO, template)
        self._rows = GapsCsv(self.path / GAPS)
        self._table = RunTable(replace(description, files=(self.path / VIDEO,)), task, self._rows.add, camera_beside)
        self._last_s = 0.0
        self.event("recording", "Recording began.")

    @property
    def camera(self) -> CameraModel | None:
        """Camera of the recording; None until it is learnt from the first frames."""
        return self._table.camera

    @property
    def measured(self) -> int:
        """Number of frames whose rows are in the table."""
        return self._table.measured

    @property
    def is_there(self) -> bool:
        """Whether the written files still exist; the operating system would continue to write to deleted files."""
        return (self.path / EVENTS).exists()

    def add(self, frame: RecordedFrame) -> None:
        """Write one frame: first the entry in lost.csv if the frame is lost, then its picture; its row follows."""
        if isinstance(frame.item, LostFrame):
            lost_at_s = self._video.time_s(frame.item, frame.packets)
            if lost_at_s is not None:
                self._lost.add(lost_at_s, frame.item)
        time_s = self._video.add(frame.item, frame.packets)
        if time_s is None:
            return
        self._last_s = time_s
        self._table.add(replace(frame.item, index=self.frames, time_s=time_s), frame.seen)
        self.frames += 1

    def event(self, name: str, words: str) -> None:
        """Append an event with the time of the last frame."""
        self._files.event({"time_s": round(self._last_s, 6), "event": name, "words": words})

    def close(self, why: str) -> None:
        """End the run; every file is closed even if one fails, and the first error is raised."""
        failure: FingervisionError | None = None
        with suppress(FingervisionError):
            self.event("stopped", why)
        for end in (
            self._video.close,
            self._lost.close,
            self._table.close,
            self._rows.close,
            self._files.close,
            self._finish,
        ):
            try:
                end()
            except FingervisionError as error:
                failure = failure or error
        if failure is not None:
            raise failure

    def _finish(self) -> None:
        # A run without frames has no video.
        there = (self.path / VIDEO).exists()
        self._about["sha256"] = {VIDEO: self._files.sha256(VIDEO)} if there else {}
        self._about["frames"] = self.frames
        self._files.write_about(self._about, complete=True)


def remove_leftovers(out: Path) -> None:
    """Remove the empty files that a power failure left in the output folder and in its runs.

    A file that was changed last before the computer was started belongs to no program that still writes it; the moment
    of the start is known on Linux only.
    """
    clock = getattr(time, "CLOCK_BOOTTIME", None)
    if clock is None:
        return
    started_s = time.time() - time.clock_gettime(clock)
    with suppress(OSError):  # what cannot be removed does not prevent a live view
        for folder in (out, *out.glob(RUNS)):
            files = [file for file in folder.iterdir() if file.is_file()]
            old = [file for file in files if file.stat().st_mtime < started_s]
            if folder == out:
                remove_empty(out, [file.name for file in old if any(map(file.match, OF_OUT))])
            elif len(old) == len(files):
                remove_empty(folder, (RUN, CALIBRATION, EVENTS, VIDEO, GAPS, LOST))


def _new_folder(out: Path) -> Path:
    """Make a folder with an unused name."""
    name = datetime.now(UTC).strftime("%Y-%m-%dT%H-%M-%SZ")
    for number in range(1, 1000):
        path = out / (name if number == 1 else f"{name}-{number}")
        try:
            path.mkdir(parents=True)
        except FileExistsError:
            if not path.is_dir():
                raise OutputError(f"--out must be a folder, but {out} is a file: name another.") from None
            continue
        except OSError as error:
            raise OutputError(
                f"The folder {out} cannot be written ({error.strerror}): name another folder with --out."
            ) from error
        return path
    raise OutputError(
        f"The folder {out} holds too many runs that began in this second: try again, or name another folder with --out."
    )


def _about(description: Description, task: Task, began: datetime) -> dict[str, Any]:
    region = task.region
    return {
        "schema": SCHEMA,
        "software": {"name": "fingervision", "version": __version__},
        "began_at": began.isoformat(timespec="milliseconds"),
        "recipe": None,
        "device": device_of(description),
        "settings": {
            "below_tip_mm": task.below_tip_mm,
            "tips": "auto" if task.direction is None else task.direction.value,
            "fingers": task.fingers,
            "roi": None if region is None else list(asdict(region).values()),
        },
        "scale": {
            "px_per_mm": task.scale.px_per_mm,
            "calibration": CALIBRATION if isinstance(task.scale, Calibration) else None,
        },
        "video": VIDEO,
        "gaps": GAPS,
        "lost": LOST,
        "events": EVENTS,
    }
