"""List the recordings or tables that a user names by paths and by patterns in quotes."""

import glob
import mimetypes
import os
import re
from pathlib import Path

from fingervision.domain.errors import InputFileError, UsageError


def inputs_of(names: tuple[str, ...], out: Path) -> tuple[str, ...]:
    """List every input once, in natural order within each name (run2 before run10).

    A folder is a single input (a sequence of images), and the files in this folder are then not inputs. Files inside
    `out` are not inputs, because videos written by an earlier call may match a pattern. A missing path is kept, so that
    it is listed with its error; if other names match, a pattern without a match is kept too.

    Raises
    ------
    InputFileError
        No file matches any of the names.
    UsageError
        All matching files are in `out`.
    """
    found: dict[str, str] = {}
    matched = inside = False
    results = _absolute(out)
    for name in names:
        is_pattern = glob.has_magic(name) and not Path(name).exists()
        # Path.glob knows no absolute patterns.
        matches = sorted(glob.iglob(name, recursive=True), key=_natural) if is_pattern else [name]  # noqa: PTH207
        matches = [m for m in matches if not (is_pattern and Path(m).is_dir() and not _holds_images(m))]
        outside = [match for match in matches if not (_absolute(match) + os.sep).startswith(results + os.sep)]
        inside = inside or len(outside) < len(matches)
        matches = outside
        matched = matched or any(Path(match).exists() for match in matches)
        for match in matches or [name]:
            found.setdefault(_absolute(match), match)
    if not matched and inside:
        raise UsageError(
            f"--out must not be a folder that contains the inputs, but they are in {out}: name another folder."
        )
    if not matched:
        words = ", ".join(names)
        raise InputFileError(
            f"No file matches {words}: check the path, and put patterns in quotes ('recordings/**/*.mp4')."
        )
    folders = {path for path in found if Path(path).is_dir()}
    return tuple(
        name for path, name in found.items() if not any(str(parent) in folders for parent in Path(path).parents)
    )


def _absolute(path: str | Path) -> str:
    return os.path.abspath(path)  # noqa: PTH100 - without following links: a link's own name is what the user gave


def _holds_images(folder: str) -> bool:
    with os.scandir(folder) as entries:
        return any((mimetypes.guess_type(entry.name)[0] or "").startswith("image/") for entry in entries)


def _natural(name: str) -> list[tuple[int, int, str]]:
    parts = re.split(r"(\d+)", name)
    return [(1, int(part), "") if number % 2 else (0, 0, part) for number, part in enumerate(parts)]
