"""Files of a run folder: run.json, events.jsonl and lost.csv, each readable at any time, and hashes of the others."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fingervision.domain.errors import DataError, FingervisionError, OutputError
from fingervision.domain.frame import LostFrame
from fingervision.domain.status import Status
from fingervision.frames.source import Description
from fingervision.storage.csv_columns import read_columns
from fingervision.storage.durable import Flushing, flush, flush_open, replaced
from fingervision.storage.gaps_csv import TIME_PLACES
from fingervision.storage.plain_file import json_of
from fingervision.storage.row_file import cell, quoted

RUN, VIDEO, EVENTS, CALIBRATION = "run.json", "video.mp4", "events.jsonl", "calibration.json"
SCHEMA = 1


def device_of(description: Description) -> dict[str, Any]:
    """What run.json says of the camera; `measure` of the run's video reads its settings there."""
    return {
        "source": description.name,
        "kind": description.kind,
        "codec": description.codec,
        "width_px": description.width_px,
        "height_px": description.height_px,
        "rate_hz": description.rate_hz,
        "camera": dict(description.camera),
        "notes": list(description.notes),
    }


class RunFiles:
    """Writes the metadata and the events of a run.

    Parameters
    ----------
    path : Path
        The run's folder.

    Raises
    ------
    FingervisionError
        A file cannot be written; from every method.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._events = (path / EVENTS).open("a", encoding="utf-8", buffering=1)
        except OSError as error:
            raise self.failed(error) from error

    def write_about(self, about: Mapping[str, Any], *, complete: bool) -> None:
        """Write run.json; an older file is replaced only once the new file is complete."""
        try:
            with replaced(self.path / RUN) as part:
                part.write_text(json.dumps({**about, "complete": complete}, indent=2) + "\n", encoding="utf-8")
        except OSError as error:
            raise self.failed(error) from error

    def event(self, line: Mapping[str, Any]) -> None:
        """Append an event to events.jsonl."""
        try:
            self._events.write(json.dumps(line, ensure_ascii=False) + "\n")
            flush_open(self._events.fileno())
        except OSError as error:
            raise self.failed(error) from error

    def sha256(self, name: str) -> str:
        """SHA-256 hash of one of the run's files."""
        try:
            with (self.path / name).open("rb") as file:
                return hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as error:
            raise self.failed(error) from error

    def close(self) -> None:
        """Close events.jsonl."""
        try:
            self._events.close()
        except OSError as error:
            raise self.failed(error) from error

    def failed(self, error: OSError) -> FingervisionError:
        """Return the error which states that the run could not be written."""
        return OutputError(
            f"The run {self.path} could not be written any further ({error.strerror}); it holds what was recorded "
            f"before: free disk space, or name another folder with --out."
        )


# The file lost.csv: video frames of a run that could not be measured on arrival, as the video itself cannot show.
#
# Stream and decoder mark damage (lost packets, and pictures that depend on lost packets) on arrival. A video file
# contains the packets without these marks, so that some damaged pictures would seem undamaged when the file is read
# again.

LOST = "lost.csv"
HEADER = "time_s,status,words"


class LostFrames:
    """Writes lost.csv; each line is written before the packets to which it refers.

    Parameters
    ----------
    path : Path
        The file.

    Raises
    ------
    FingervisionError
        The table cannot be written; every method may raise this error.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._flushing = path, Flushing(path)
        try:
            self._file = path.open("w", encoding="utf-8", buffering=1)
            self._file.write(f"{HEADER}\n")
        except OSError as error:
            raise self._failed(error) from error

    def add(self, time_s: float, lost: LostFrame) -> None:
        """Add a lost frame with its time in the recording (s)."""
        try:
            self._file.write(f"{cell(time_s, TIME_PLACES)},{lost.status.value},{quoted(lost.words)}\n")
            self._flushing.when_due()
        except OSError as error:
            raise self._failed(error) from error

    def close(self) -> None:
        """Close the file."""
        try:
            self._file.close()
            flush(self._path)
        except OSError as error:
            raise self._failed(error) from error

    def _failed(self, error: OSError) -> FingervisionError:
        return OutputError(
            f"{self._path} could not be written any further ({error.strerror}); what was recorded until then is valid: "
            "free disk space, or name another folder with --out."
        )


def lost_frames(files: Sequence[Path]) -> tuple[LostFrame, ...]:
    """Read the frames that were lost when a recording was made, in order of time.

    Parameters
    ----------
    files : sequence of Path
        Files of which the recording consists.

    Returns
    -------
    tuple of LostFrame
        Lost frames; empty if no run.json beside the file mentions such a table. `index` is the row number in the table.

    Raises
    ------
    DataError, InputFileError
        The run's table of lost frames is missing or cannot be read.
    """
    if len(files) != 1:
        return ()
    try:
        run = json_of(files[0].parent / RUN)
        named = str(run["lost"]) if run["video"] == files[0].name else ""
    except (OSError, ValueError, LookupError, TypeError):
        return ()  # there is no run.json, or it belongs to something else
    if named != LOST:
        return ()
    path = files[0].parent / LOST
    if not path.exists():
        raise DataError(
            f"{path} must list the frames of {files[0].name} that were damaged on arrival, but is missing: put the "
            "file back, or measure a copy of the video in another folder, where damaged frames may look whole."
        )
    table = read_columns(path, HEADER.split(","), texts=("status", "words"))
    times = table.numbers("time_s", complete=True).value.tolist()
    found = []
    rows = zip(times, table.texts("status") or (), table.texts("words") or (), strict=True)
    for row, (time_s, status, words) in enumerate(rows):
        if status not in (Status.DAMAGED, Status.DUPLICATE):
            raise DataError(
                f"Line {table.lines[row]} of {path} must have the status `damaged` or `duplicate`, but has '{status}': "
                "copy the run again."
            )
        found.append(LostFrame(row, time_s, Status(status), words))
    return tuple(sorted(found, key=lambda lost: lost.time_s or 0.0))
