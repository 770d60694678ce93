"""The folder of a run on the bed: written so that it may break off at any moment and be gone on with."""

import hashlib
import json
import shutil
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from calib.measured_scale import Calibration
from fingervision import __version__
from fingervision.domain.errors import FingervisionError
from fingervision.domain.frame import Frame
from fingervision.domain.model import Model
from fingervision.domain.recipe import Recipe
from fingervision.storage.calibration_json import write_calibration
from fingervision.storage.folder_lock import FolderLock
from fingervision.storage.recorded_video import RecordedVideo, frames_in
from fingervision.storage.run_files import CALIBRATION, EVENTS, RUN, SCHEMA, VIDEO, RunFiles
from fingervision.storage.samples_csv import SampleRow, SamplesCsv, read_samples, write_rows
from fingervision.storage.simulation_csv import write_simulation
from fingervision.storage.toml_section import Section
from fingervision.testbed.bed import Bed
from fingervision.testbed.hidden import Hidden
from fingervision.testbed.soft_limits import SoftLimits

SAMPLES, SIMULATION, RECIPE, JOINED = "samples.csv", "simulation.csv", "recipe.toml", "joined.csv"
KIND = "bed run"
# FFV1 of a picture with noise takes up to this many bytes a pixel.
BYTES_PER_PX = 0.8
# Rows of simulation.csv, and how far it reaches beyond the bed's limits: an encoder's step says more than there is.
SIMULATED_ROWS, BEYOND_LIMITS_MM = 201, 0.06


class BedRunFolder:
    """Writes a run while it happens, and finds out how far an earlier one came.

    Parameters
    ----------
    path : Path
        The folder; made, empty, or holding a run of the same recipe on the same bed that broke off.
    recipe : Recipe
        What is run.
    bed : Bed
        Where.
    hidden : Hidden
        Its digest belongs to the run: a simulation that hides something else is another bed.
    before : sequence of SampleRow
        Rows of an earlier run that this one follows; both together are written to joined.csv.

    Raises
    ------
    FingervisionError
        The folder holds something else, a finished run or another recipe's, is in use, or cannot be written.
    """

    def __init__(
        self, path: Path, recipe: Recipe[Section], bed: Bed, hidden: Hidden, before: Sequence[SampleRow] = ()
    ) -> None:
        self.path, self.before = path, tuple(before)
        _claim(path)
        self._lock = FolderLock(path)
        try:
            earlier = _earlier(path, recipe, _digest(bed, hidden))
            self.rows: list[SampleRow] = _rows_with_pictures(path) if earlier else []
            self.events_done = _numbered_events(path) if earlier else []
            self.began_at = datetime.fromisoformat(str(earlier["began_at"])) if earlier else datetime.now(UTC)
            self.resumed = bool(earlier)
            self._about = _about(recipe, bed, hidden, self.began_at)
            self._files = RunFiles(path)
            self._files.write_about(self._about, complete=False)
            if not earlier:
                (path / RECIPE).write_text(recipe.text, encoding="utf-8")
                if isinstance(bed.scale, Calibration):
                    write_calibration(bed.scale, path / CALIBRATION)
                if bed.model is not None:
                    _write_simulation(path / SIMULATION, bed.model, bed.limits)
            self._samples = SamplesCsv(path / SAMPLES, go_on=bool(self.rows))
            self._video = RecordedVideo(path / VIDEO, None, keep=len(self.rows))
        except OSError as error:
            self._lock.release()
            raise FingervisionError(
                f"The folder {path} cannot be written ({error.strerror}): name another with --out."
            ) from error
        except BaseException:
            self._lock.release()
            raise
        self._last_s = self.rows[-1].time_s if self.rows else 0.0
        if earlier:
            self._files.event({"time_s": self._last_s, "event": "resumed", "words": f"After {len(self.rows)} frames."})

    def needs_room(self, frames: float, size_px: tuple[int, int]) -> None:
        """Refuse a run that the disk has no room for."""
        needed = int(frames * size_px[0] * size_px[1] * BYTES_PER_PX)
        free = shutil.disk_usage(self.path).free
        if needed > free:
            raise FingervisionError(
                f"The run needs up to {needed / 1e6:.0f} MB, but the disk of {self.path} has {free / 1e6:.0f} MB free: "
                "make room, or name a folder on another disk. Nothing was moved."
            )

    def add_picture(self, frame: Frame, time_s: float) -> None:
        """Write a frame's picture, at its time in the run."""
        self._video.add(replace(frame, time_s=time_s), ())

    def add_row(self, row: SampleRow) -> None:
        """Write a frame's row, after its picture."""
        self._samples.add((row,))
        self._last_s = row.time_s

    def event(self, number: int, name: str, words: str, **more: object) -> None:
        """Append an event; those that were written before the run broke off are not written again."""
        if number >= len(self.events_done):
            self._files.event({"n": number, "time_s": round(self._last_s, 6), "event": name, "words": words, **more})

    def finish(self, found: Mapping[str, Any]) -> None:
        """End a run that came to its end."""
        self._end()
        if self.before:
            write_rows(self.path / JOINED, [*self.before, *read_samples(self.path / SAMPLES)])
        self._about |= {**found, "joined": JOINED if self.before else None}
        # A recipe that only asks the operator, for a reference slot say, records no frame.
        names = [name for name in (VIDEO, SAMPLES) if (self.path / name).exists()]
        self._about["sha256"] = {name: self._files.sha256(name) for name in names}
        self._files.write_about(self._about, complete=True)
        self._files.close()
        self._lock.release()

    def break_off(self, why: str) -> None:
        """End a run that did not; what is in the folder stays valid, and may be gone on with."""
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
    """Rows of a finished run, with those of the runs that it followed.

    Raises
    ------
    FingervisionError
        There is no finished run in the folder.
    """
    table = path / (JOINED if (path / JOINED).exists() else SAMPLES)
    rows = read_samples(table)
    if not rows:
        raise FingervisionError(f"--after must be the folder of an earlier run on the bed, but {path} holds none.")
    return rows


def times_of(rows: Sequence[SampleRow]) -> tuple[float, float] | None:
    """Times of the first row of a step (those before it are at rest) and of the last; None without rows."""
    if not rows:
        return None
    began_s = next((row.arrived_s for row in rows if row.step > 0), rows[0].arrived_s)
    return began_s, rows[-1].arrived_s


def _claim(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise FingervisionError(f"--out must be a folder, but {path} is a file: name another.") from None
    except OSError as error:
        raise FingervisionError(
            f"The folder {path} cannot be written ({error.strerror}): name another with --out."
        ) from error


def _earlier(path: Path, recipe: Recipe[Section], digest: str) -> dict[str, Any] | None:
    """What an earlier run of the same recipe left in the folder; None where it is empty."""
    others = sorted(item.name for item in path.iterdir() if not item.name.startswith("."))
    if not others:
        return None
    if RUN not in others:
        raise FingervisionError(f"--out must be a new or empty folder, but {path} holds {others[0]}: name another.")
    try:
        about: dict[str, Any] = json.loads((path / RUN).read_text(encoding="utf-8"))
        if about.get("kind") != KIND:
            raise FingervisionError(f"--out must be a new or empty folder, but {path} holds another run: name another.")
    except (OSError, ValueError, AttributeError) as error:
        raise FingervisionError(f"{path / RUN} could not be read ({error}): name another --out.") from error
    if about.get("complete"):
        raise FingervisionError(
            f"The run in {path} is finished already: name another folder with --out, or remove that one."
        )
    if not read_samples(path / SAMPLES):
        # Nothing was recorded: there is nothing to go on with, and nothing to lose.
        (path / EVENTS).unlink(missing_ok=True)
        return None
    if about.get("recipe") != recipe.text:
        raise FingervisionError(
            f"The run in {path} broke off, but was of another recipe ({about.get('name')}): go on with that one, or "
            "name another folder with --out."
        )
    if about.get("bed_digest") != digest:
        raise FingervisionError(
            f"The run in {path} broke off, but was on another bed: go on with that one, or name another folder with "
            "--out."
        )
    return about


def _digest(bed: Bed, hidden: Hidden) -> str:
    """Recognises a bed, with what is hidden in it, and tells neither."""
    effects = {name: dict(sorted(values.items())) for name, values in sorted(hidden.effects.items())}
    return hashlib.sha256(json.dumps([bed.about, effects], sort_keys=True, default=str).encode()).hexdigest()


def _rows_with_pictures(path: Path) -> list[SampleRow]:
    """Rows whose pictures are in the video as well; the table is cut to them."""
    rows = read_samples(path / SAMPLES)
    frames = frames_in(path / VIDEO)
    if frames < len(rows):
        rows = rows[:frames]
        write_rows(path / SAMPLES, rows)
    return rows


def _numbered_events(path: Path) -> list[dict[str, Any]]:
    """Events of the run itself, in order; a last line that broke off is cut off the file."""
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


def _write_simulation(path: Path, model: Model, limits: SoftLimits) -> None:
    low_mm, high_mm = limits.lower_mm - BEYOND_LIMITS_MM, limits.upper_mm + BEYOND_LIMITS_MM
    inputs = np.linspace(low_mm, high_mm, SIMULATED_ROWS)
    # Without its force: what the fingers press on is no property of the gripper.
    write_simulation(path, inputs, replace(model.respond(inputs), force_n=None))


def _about(recipe: Recipe[Section], bed: Bed, hidden: Hidden, began_at: datetime) -> dict[str, Any]:
    camera = None if bed.camera is None else bed.camera.description
    return {
        "schema": SCHEMA,
        "kind": KIND,
        "software": {"name": "fingervision", "version": __version__},
        "name": recipe.name,
        "began_at": began_at.isoformat(timespec="milliseconds"),
        "recipe": recipe.text,
        "bed": dict(bed.about),
        "bed_digest": _digest(bed, hidden),
        "device": None
        if camera is None
        else {
            "source": camera.name,
            "kind": camera.kind,
            "width_px": camera.width_px,
            "height_px": camera.height_px,
            "rate_hz": camera.rate_hz,
            "notes": list(camera.notes),
        },
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
