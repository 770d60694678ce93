"""Folder of a run, written so that a run can be interrupted at any time and resumed."""

import hashlib
import json
import shutil
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from calib.measured_scale import Calibration
from fingervision import __version__
from fingervision.domain.errors import DataError, FingervisionError, OutputError
from fingervision.domain.frame import Frame
from fingervision.domain.model import Model
from fingervision.domain.recipe import Recipe
from fingervision.frames.video_file import VideoFile
from fingervision.measuring.camera_learning import camera_beside
from fingervision.measuring.run_table import Measured, RunTable
from fingervision.storage.calibration_json import write_calibration
from fingervision.storage.drive_csv import SampleRow, SamplesCsv, read_samples, write_rows
from fingervision.storage.durable import remove_empty
from fingervision.storage.gaps_csv import GapRow
from fingervision.storage.out_folder import FolderLock, make_out_folder
from fingervision.storage.plain_file import json_of
from fingervision.storage.recorded_video import RecordedVideo, frames_in
from fingervision.storage.run_files import CALIBRATION, EVENTS, RUN, SCHEMA, VIDEO, RunFiles, device_of
from fingervision.storage.simulation_table import write_simulation
from fingervision.storage.toml_section import Section
from fingervision.testbed.bed import Bed
from fingervision.testbed.motion.move_limits import SoftLimits
from fingervision.testbed.run.synchronised_acquisition import Sight
from fingervision.testbed.simulation.injected_effects import Hidden

SAMPLES, SIMULATION, RECIPE, JOINED = "samples.csv", "simulation.csv", "recipe.toml", "joined.csv"
KIND = "bed run"


def digest_of(bed: Bed, hidden: Hidden) -> str:
    """Hash that identifies a test bed and its injected effects without revealing them."""
    effects = {name: dict(sorted(values.items())) for name, values in sorted(hidden.effects.items())}
    return hashlib.sha256(json.dumps([bed.about, effects], sort_keys=True, default=str).encode()).hexdigest()


def write_expected(path: Path, model: Model, limits: SoftLimits) -> None:
    """Write the gap that the model predicts within the test bed's limits."""
    inputs = limits.tabulated_mm
    # The force is left out, because it depends on the object between the fingers, not only on the gripper.
    write_simulation(path, inputs, replace(model.respond(inputs), force_n=None))


def about_run(recipe: Recipe[Section], bed: Bed, hidden: Hidden, began_at: datetime) -> dict[str, Any]:
    """Content of run.json at the start of a run."""
    return {
        "schema": SCHEMA,
        "kind": KIND,
        "software": {"name": "fingervision", "version": __version__},
        "name": recipe.name,
        "began_at": began_at.isoformat(timespec="milliseconds"),
        "recipe": recipe.text,
        "bed": dict(bed.about),
        "bed_digest": digest_of(bed, hidden),
        "device": None if bed.camera is None else device_of(bed.camera.description),
        "settings": {"below_tip_mm": bed.below_tip_mm, "tips": "auto", "roi": None},
        "scale": {
            "px_per_mm": None if bed.scale is None else bed.scale.px_per_mm,
            "calibration": CALIBRATION if isinstance(bed.scale, Calibration) else None,
        },
        "model": None if bed.model is None else SIMULATION,
        "video": VIDEO,
        "samples": SAMPLES,
        "events": EVENTS,
    }


class Remains(NamedTuple):
    """An interrupted run: its rows and events so far, from which it may be continued.

    Parameters
    ----------
    began_at : datetime
        Time at which the run began.
    rows : list of SampleRow
        Rows of the frames that have a row and a picture.
    events : list of dict
        Events of the run itself, in order.
    """

    began_at: datetime
    rows: list[SampleRow]
    events: list[dict[str, Any]]


def contents(path: Path) -> list[str]:
    """Names of the files in a folder, sorted; hidden files are ignored."""
    return sorted(item.name for item in path.iterdir() if not item.name.startswith("."))


def refuse_others(path: Path, held: str) -> NoReturn:
    """Refuse a folder that contains other files, among which the run's files would be hard to find."""
    raise OutputError(f"--out must be a new or empty folder, but {path} contains {held}: name another folder.")


def _own_names() -> tuple[str, ...]:
    return RUN, RECIPE, CALIBRATION, SIMULATION, VIDEO, SAMPLES, EVENTS


def interrupted(path: Path, recipe: Recipe[Section]) -> dict[str, Any] | None:
    """Content of run.json of the interrupted run in a folder; None if there is nothing to continue.

    Nothing is changed, and no test bed is needed, so that a folder is refused before a test bed is opened.

    Raises
    ------
    DataError, OutputError
        The folder contains other files, a finished run, or a run of another recipe.
    """
    there = contents(path) if path.is_dir() else []
    held = [name for name in there if name not in _own_names() or (path / name).stat().st_size]
    if not held:
        return None
    if RUN not in held:
        refuse_others(path, held[0])
    about = _about(path)
    if about.get("complete"):
        raise OutputError(
            f"The run in {path} is finished already: name another folder with --out, or remove this folder."
        )
    if not read_samples(path / SAMPLES):
        # No frame was recorded: the run starts again, and no data are lost.
        return None
    if about.get("recipe") != recipe.text:
        raise OutputError(
            f"The run in {path} was interrupted, and used another recipe ({about.get('name')}): continue "
            "with that recipe, or name another folder with --out."
        )
    return about


def remains(path: Path, recipe: Recipe[Section], digest: str) -> Remains | None:
    """Find the interrupted run of this recipe on this test bed; None if there is nothing to continue.

    Empty files are removed. The table is truncated to the rows whose pictures are in the video, and the file of events
    to complete lines.

    Raises
    ------
    DataError, OutputError
        As for `interrupted`, or the run is that of another test bed.
    """
    remove_empty(path, _own_names())
    about = interrupted(path, recipe)
    if about is None:
        (path / EVENTS).unlink(missing_ok=True)
        return None
    if about.get("bed_digest") != digest:
        raise OutputError(
            f"The run in {path} was interrupted, and used another test bed: continue with that test bed, or "
            "name another folder with --out."
        )
    rows = _rows_with_pictures(path)
    return Remains(datetime.fromisoformat(str(about["began_at"])), rows, _numbered_events(path))


def _about(path: Path) -> dict[str, Any]:
    try:
        about: dict[str, Any] = json_of(path / RUN)
        kind = about.get("kind")
    except (OSError, ValueError, AttributeError) as error:
        raise OutputError(f"{path / RUN} could not be read ({error}): name another folder with --out.") from error
    if kind != KIND:
        refuse_others(path, "another run")
    return about


def _rows_with_pictures(path: Path) -> list[SampleRow]:
    rows = read_samples(path / SAMPLES)
    frames = frames_in(path / VIDEO)
    if frames < len(rows):
        rows = rows[:frames]
        write_rows(path / SAMPLES, rows)
    return rows


def _numbered_events(path: Path) -> list[dict[str, Any]]:
    try:
        text = (path / EVENTS).read_bytes()
    except FileNotFoundError:
        return []
    whole = text[: text.rfind(b"\n") + 1]
    if len(whole) < len(text):
        with (path / EVENTS).open("rb+") as file:
            file.truncate(len(whole))
    events = [json.loads(line) for line in whole.decode("utf-8").splitlines()]
    return [event for event in events if "n" in event]


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
    sight : Sight
        Its camera, and the settings of the measurement.
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
        self, path: Path, recipe: Recipe[Section], bed: Bed, sight: Sight, hidden: Hidden,
        before: Sequence[SampleRow] = (),
    ) -> None:  # fmt: skip
        self.path, self.before = path, tuple(before)
        self.measured: deque[GapRow] = deque()
        """Rows of the frames as `measure` gives them, in order; they come some frames late."""
        make_out_folder(path)
        self._lock = FolderLock(path)
        try:
            earlier = remains(path, recipe, digest_of(bed, hidden))
            self.resumed = earlier is not None
            self.began_at, self.rows, self.events_done = earlier or Remains(datetime.now(UTC), [], [])
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
            description = replace(sight.camera.description, files=(path / VIDEO,))
            learn = None if bed.replays else camera_beside
            self.table = RunTable(description, sight.task, self._take, learn, waits=bed.replays)
            if self.rows:
                # The camera is learnt from the first frames, and each frame is judged by those before it.
                for item in islice(VideoFile(str(path / VIDEO)), len(self.rows)):
                    self.table.add(item, None)
            self._video = RecordedVideo(path / VIDEO, None, keep=len(self.rows))
        except BaseException as error:
            self._lock.release()
            if isinstance(error, FingervisionError) or not isinstance(error, OSError):
                raise
            raise OutputError(
                f"The folder {path} cannot be written ({error.strerror}): name another folder with --out."
            ) from error
        self.last_s = self.rows[-1].time_s if self.rows else 0.0
        """Time of the last frame whose position is known (s)."""
        if earlier:
            self._files.event({"time_s": self.last_s, "event": "resumed", "words": f"After {len(self.rows)} frames."})

    def needs_room(self, frames: float, size_px: tuple[int, int]) -> None:
        """Refuse a run for which the disk has not enough space."""
        needed = int(frames * size_px[0] * size_px[1] * BYTES_PER_PX)
        free = shutil.disk_usage(self.path).free
        if needed > free:
            raise OutputError(
                f"The run needs up to {needed / 1e6:.0f} MB, but the disk of {self.path} has {free / 1e6:.0f} MB free: "
                "free disk space, or name a folder on another disk. Nothing was moved."
            )

    def add_picture(self, frame: Frame, time_s: float, number: int, seen: Measured) -> None:
        """Write a frame's picture, with its time in the run; `measured` gets its row later."""
        in_video_s = self._video.add(replace(frame, time_s=time_s), ())
        self.table.add(replace(frame, index=number, time_s=in_video_s), seen)

    def add_row(self, row: SampleRow) -> None:
        """Write a frame's row, after its picture."""
        self._samples.add((row,))

    def _take(self, rows: Sequence[GapRow]) -> None:
        self.measured.extend(row for row in rows if row.frame >= len(self.rows))

    def event(self, number: int, name: str, words: str, **more: object) -> None:
        """Append an event; events written before an interruption are not written again."""
        if number >= len(self.events_done):
            self._files.event({"n": number, "time_s": round(self.last_s, 6), "event": name, "words": words, **more})

    def end_pictures(self) -> None:
        """Complete the video, and measure the frames that wait."""
        try:
            self._video.close()
        finally:
            self.table.close()

    def finish(self, found: Mapping[str, Any]) -> None:
        """Close the folder of a completed run."""
        self._samples.close()
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
        last = {"time_s": round(self.last_s, 6), "event": "stopped", "words": why}
        for end in (self.end_pictures, partial(self._files.event, last), self._samples.close, self._files.close):
            with suppress(FingervisionError):
                end()
        self._lock.release()


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
