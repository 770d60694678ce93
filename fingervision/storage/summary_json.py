"""The file summary.json: input, settings, results and uncertainties of a measurement."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fingervision.domain.errors import OutputError, UsageError

SUMMARY = "summary.json"
GAPS = "gaps.csv"
SCHEMA = 1


def write_summary(path: Path, summary: Mapping[str, Any]) -> None:
    """Write the summary; an older one stays complete until the new one is complete.

    Parameters
    ----------
    path : Path
        The file.
    summary : mapping
        Text, numbers, None, lists and mappings; no NaN.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    part = path.with_name(f".{path.name}.part")
    try:
        # A name that is not UTF-8 keeps its bytes as JSON's own escapes.
        part.write_text(summary_text(summary), encoding="utf-8", errors="backslashreplace")
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise OutputError(
            f"{path} could not be written ({error.strerror}): free disk space or name another folder with "
            "--out, and measure again."
        ) from error


def summary_text(summary: Mapping[str, Any]) -> str:
    """Text of the summary's file."""
    return json.dumps({"schema": SCHEMA, **summary}, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def recording_of(folder: Path) -> str | None:
    """Name of the recording to which a folder's results belong; None where there is no summary."""
    try:
        name = json.loads((folder / SUMMARY).read_bytes())["recording"]["name"]
    except (OSError, ValueError, LookupError, TypeError):
        return None
    return name if isinstance(name, str) else None


def refuse_other_recording(folder: Path, recording: str) -> None:
    """Refuse a folder with the results of another recording.

    Parameters
    ----------
    folder : Path
        Where results shall go.
    recording : str
        As the user names it: a file, a folder or a pattern.

    Raises
    ------
    UsageError
        The folder holds the results of another recording.
    """
    of = recording_of(folder)
    if of is None or Path(of).resolve() == Path(recording).resolve():
        return
    # A name may be relative to a folder from which an earlier call was made: there, the last part tells.
    if not Path(of).exists() and Path(of).name == Path(recording).name:
        return
    raise UsageError(f"--out must be a folder of its own, but {folder} holds the results of {of}: name another folder.")


def u_clock_beside(table: Path) -> float:
    """Uncertainty of the clock offset of a gaps.csv, from the summary beside it (s).

    Parameters
    ----------
    table : Path
        gaps.csv, or any other table.

    Returns
    -------
    float
        0 where the table is another, or the offset was given instead of found.
    """
    if table.name != GAPS:
        return 0.0
    try:
        settings = json.loads((table.parent / SUMMARY).read_bytes())["settings"]
        found = float(settings["u_drive_time_s"]) if settings["drive_offset"] == "found" else 0.0
    except (OSError, ValueError, LookupError, TypeError):
        return 0.0
    return found if 0.0 < found < float("inf") else 0.0
