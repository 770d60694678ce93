"""summary.json: what was measured, on what, with what, and how surely."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fingervision.domain.errors import FingervisionError

SCHEMA = 1


def write_summary(path: Path, summary: Mapping[str, Any]) -> None:
    """Write the summary; an older one stays whole until the new one is complete.

    Parameters
    ----------
    path : Path
        The file.
    summary : mapping
        Text, numbers, None, lists and mappings; no NaN.

    Raises
    ------
    FingervisionError
        The file cannot be written.
    """
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_text(summary_text(summary), encoding="utf-8")
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise FingervisionError(
            f"{path} could not be written ({error.strerror}): make room or name another --out, and measure again."
        ) from error


def summary_text(summary: Mapping[str, Any]) -> str:
    """Give the summary as the file holds it."""
    return json.dumps({"schema": SCHEMA, **summary}, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
