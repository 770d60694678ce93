"""The file summary.json: input files, settings, results and uncertainties of a measurement."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fingervision.domain.errors import UsageError
from fingervision.storage.durable import written
from fingervision.storage.plain_file import json_of

SUMMARY = "summary.json"
GAPS = "gaps.csv"
SCHEMA = 1


def write_summary(path: Path, summary: Mapping[str, Any]) -> None:
    """Write the summary; an older summary is replaced only once the new file is complete.

    Parameters
    ----------
    path : Path
        The file.
    summary : mapping
        Content of the file: text, numbers, None, lists and mappings, without NaN.

    Raises
    ------
    OutputError
        The file cannot be written.
    """
    with written(path, "free disk space or name another folder with --out, and measure again") as part:
        # A file name that is not valid UTF-8 is written with JSON escapes.
        part.write_text(summary_text(summary), encoding="utf-8", errors="backslashreplace")


def summary_text(summary: Mapping[str, Any]) -> str:
    """Return the text of the file summary.json."""
    return json.dumps({"schema": SCHEMA, **summary}, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def recording_of(folder: Path) -> str | None:
    """Name of the recording to which the results in a folder belong; None without a summary."""
    try:
        name = json_of(folder / SUMMARY)["recording"]["name"]
    except (OSError, ValueError, LookupError, TypeError):
        return None
    return name if isinstance(name, str) else None


def refuse_other_recording(folder: Path, recording: str) -> None:
    """Refuse an output folder that holds the results of another recording.

    Parameters
    ----------
    folder : Path
        Folder for the new results.
    recording : str
        The recording as named by the user: a file, a folder or a pattern.

    Raises
    ------
    UsageError
        The folder holds the results of another recording.
    """
    of = recording_of(folder)
    if of is None or Path(of).resolve() == Path(recording).resolve():
        return
    # A name may be relative to the folder of an earlier call; its last part is then compared.
    if not Path(of).exists() and Path(of).name == Path(recording).name:
        return
    raise UsageError(f"--out must be a folder of its own, but {folder} holds the results of {of}: name another folder.")
