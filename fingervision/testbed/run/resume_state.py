"""State of a run's folder: empty, interrupted and resumable, or finished and not to be changed."""

import json
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, NoReturn

from fingervision.domain.errors import OutputError
from fingervision.domain.recipe import Recipe
from fingervision.storage.durable import remove_empty
from fingervision.storage.plain_file import json_of
from fingervision.storage.recorded_video import frames_in
from fingervision.storage.run_files import CALIBRATION, EVENTS, RUN, VIDEO
from fingervision.storage.samples_csv import SampleRow, read_samples, write_rows
from fingervision.storage.toml_section import Section
from fingervision.testbed.run.run_metadata import KIND, RECIPE, SAMPLES, SIMULATION


@dataclass(frozen=True, slots=True)
class Remains:
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


def remains(path: Path, recipe: Recipe[Section], digest: str) -> Remains | None:
    """Find the interrupted run of this recipe on this test bed; None if there is nothing to continue.

    Empty files are removed. The table is truncated to the rows whose pictures are in the video, and the file of events
    to complete lines.

    Raises
    ------
    DataError, OutputError
        The folder contains other files, a finished run, or a run of another recipe or test bed.
    """
    remove_empty(path, (RUN, RECIPE, CALIBRATION, SIMULATION, VIDEO, SAMPLES, EVENTS))
    held = contents(path)
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
        (path / EVENTS).unlink(missing_ok=True)
        return None
    if about.get("recipe") != recipe.text:
        raise OutputError(
            f"The run in {path} was interrupted, and used another recipe ({about.get('name')}): continue "
            "with that recipe, or name another folder with --out."
        )
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
