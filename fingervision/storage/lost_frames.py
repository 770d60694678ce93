"""The file lost.csv: video frames of a run that could not be measured on arrival, as the video itself cannot show.

Stream and decoder mark damage (lost packets, and pictures that depend on lost packets) on arrival. A video file
contains the packets without these marks, so that some damaged pictures would seem undamaged when the file is read
again.
"""

from collections.abc import Sequence
from pathlib import Path

from fingervision.domain.errors import DataError, FingervisionError, OutputError
from fingervision.domain.frame import LostFrame
from fingervision.domain.status import Status
from fingervision.storage.csv_columns import read_columns
from fingervision.storage.durable import Flushing, flush
from fingervision.storage.gaps_csv import TIME_PLACES
from fingervision.storage.plain_file import json_of
from fingervision.storage.row_file import cell, quoted
from fingervision.storage.run_files import RUN

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
