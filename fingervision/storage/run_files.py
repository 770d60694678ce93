"""Files of a run folder: run.json and events.jsonl, each readable at any time, and hashes of the other files."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fingervision.domain.errors import FingervisionError, OutputError
from fingervision.frames.source import Description
from fingervision.storage.durable import flush_open, replaced

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
