"""Folder of a run, written so that a run can be interrupted at any time and resumed."""

import shutil
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from calib.measured_scale import Calibration
from fingervision.domain.errors import DataError, FingervisionError, OutputError
from fingervision.domain.frame import Frame
from fingervision.domain.recipe import Recipe
from fingervision.storage.calibration_json import write_calibration
from fingervision.storage.out_folder import FolderLock, make_out_folder
from fingervision.storage.recorded_video import RecordedVideo
from fingervision.storage.run_files import CALIBRATION, VIDEO, RunFiles
from fingervision.storage.samples_csv import SampleRow, SamplesCsv, read_samples, write_rows
from fingervision.storage.toml_section import Section
from fingervision.testbed.bed import Bed
from fingervision.testbed.run.resume_state import remains
from fingervision.testbed.run.run_metadata import (
    JOINED,
    RECIPE,
    SAMPLES,
    SIMULATION,
    about_run,
    digest_of,
    write_expected,
)
from fingervision.testbed.simulation.injected_effects import Hidden

# Largest size of a picture with noise in FFV1, in bytes per pixel.
BYTES_PER_PX = 0.8


class BedRunFolder:
    """Writes a run while it is executed, and determines how far an interrupted run got.

    Parameters
    ----------
    path : Path
        The folder; it may be missing, empty, or contain an interrupted run of the same recipe on the same test bed.
    recipe : Recipe
        The recipe that is run.
    bed : Bed
        The test bed.
    hidden : Hidden
        Injected effects, whose hash is stored: a simulation with other effects counts as another test bed.
    before : sequence of SampleRow
        Rows of an earlier run that this run continues; the rows of both runs are written to joined.csv.

    Raises
    ------
    FingervisionError
        The folder contains other files, a finished run or a run of another recipe, is in use, or cannot be written.
    """

    def __init__(
        self, path: Path, recipe: Recipe[Section], bed: Bed, hidden: Hidden, before: Sequence[SampleRow] = ()
    ) -> None:
        self.path, self.before = path, tuple(before)
        make_out_folder(path)
        self._lock = FolderLock(path)
        try:
            earlier = remains(path, recipe, digest_of(bed, hidden))
            self.resumed = earlier is not None
            self.rows: list[SampleRow] = earlier.rows if earlier else []
            self.events_done = earlier.events if earlier else []
            self.began_at = earlier.began_at if earlier else datetime.now(UTC)
            self._about = about_run(recipe, bed, hidden, self.began_at)
            self._files = RunFiles(path)
            self._files.write_about(self._about, complete=False)
            kept = {name for name in (RECIPE, CALIBRATION, SIMULATION) if earlier and (path / name).exists()}
            if RECIPE not in kept:
                (path / RECIPE).write_text(recipe.text, encoding="utf-8")
            if isinstance(bed.scale, Calibration) and CALIBRATION not in kept:
                write_calibration(bed.scale, path / CALIBRATION)
            if bed.model is not None and SIMULATION not in kept:
                write_expected(path / SIMULATION, bed.model, bed.limits)
            self._samples = SamplesCsv(path / SAMPLES, tuple(bed.channels), go_on=bool(self.rows))
            self._video = RecordedVideo(path / VIDEO, None, keep=len(self.rows))
        except FingervisionError:
            self._lock.release()
            raise
        except OSError as error:
            self._lock.release()
            raise OutputError(
                f"The folder {path} cannot be written ({error.strerror}): name another folder with --out."
            ) from error
        except BaseException:
            self._lock.release()
            raise
        self._last_s = self.rows[-1].time_s if self.rows else 0.0
        if earlier:
            self._files.event({"time_s": self._last_s, "event": "resumed", "words": f"After {len(self.rows)} frames."})

    def needs_room(self, frames: float, size_px: tuple[int, int]) -> None:
        """Refuse a run for which the disk has not enough space."""
        needed = int(frames * size_px[0] * size_px[1] * BYTES_PER_PX)
        free = shutil.disk_usage(self.path).free
        if needed > free:
            raise OutputError(
                f"The run needs up to {needed / 1e6:.0f} MB, but the disk of {self.path} has {free / 1e6:.0f} MB free: "
                "free disk space, or name a folder on another disk. Nothing was moved."
            )

    def add_picture(self, frame: Frame, time_s: float) -> None:
        """Write a frame's picture, with its time in the run."""
        self._video.add(replace(frame, time_s=time_s), ())

    def add_row(self, row: SampleRow) -> None:
        """Write a frame's row, after its picture."""
        self._samples.add((row,))
        self._last_s = row.time_s

    def event(self, number: int, name: str, words: str, **more: object) -> None:
        """Append an event; events written before an interruption are not written again."""
        if number >= len(self.events_done):
            self._files.event({"n": number, "time_s": round(self._last_s, 6), "event": name, "words": words, **more})

    def finish(self, found: Mapping[str, Any]) -> None:
        """Close the folder of a completed run."""
        self._end()
        if self.before:
            write_rows(self.path / JOINED, [*self.before, *read_samples(self.path / SAMPLES)])
        self._about |= {**found, "joined": JOINED if self.before else None}
        # A recipe with requests to the operator only, such as for a reference slot, records no frame.
        names = [name for name in (VIDEO, SAMPLES) if (self.path / name).exists()]
        self._about["sha256"] = {name: self._files.sha256(name) for name in names}
        self._files.write_about(self._about, complete=True)
        self._files.close()
        self._lock.release()

    def break_off(self, why: str) -> None:
        """Close the folder of an interrupted run; its content remains valid, and the run may be continued."""
        with suppress(FingervisionError):
            self._files.event({"time_s": round(self._last_s, 6), "event": "stopped", "words": why})
        with suppress(FingervisionError):
            self._end()
        with suppress(FingervisionError):
            self._files.close()
        self._lock.release()

    def _end(self) -> None:
        self._video.close()
        self._samples.close()


def rows_before(path: Path) -> list[SampleRow]:
    """Rows of a finished run, with those of the earlier runs that it continued.

    Raises
    ------
    DataError
        The folder contains no finished run.
    """
    table = path / (JOINED if (path / JOINED).exists() else SAMPLES)
    rows = read_samples(table)
    if not rows:
        raise DataError(
            f"--after must be the folder of an earlier run on the test bed, but {path} contains no finished run."
        )
    return rows


def times_of(rows: Sequence[SampleRow]) -> tuple[float, float] | None:
    """Times (s) of a recipe step's first row (earlier rows are at rest) and of the last row; None without rows."""
    if not rows:
        return None
    began_s = next((row.arrived_s for row in rows if row.step > 0), rows[0].arrived_s)
    return began_s, rows[-1].arrived_s
