"""Ownership of results in a folder, so that no command replaces the results of another input."""

import json
import os
import re
from collections.abc import Iterable
from pathlib import Path

from fingervision.domain.errors import UsageError
from fingervision.storage.out_folder import out_folder

OWNER = ".fingervision.json"
MOST_NAMES = 10_000


def own_folder(out: Path, source: Path, *, named: bool) -> Path:
    """Return the folder for the results of an input.

    Parameters
    ----------
    out : Path
        The folder that is named, or the usual one.
    source : Path
        The input; may be a pattern.
    named : bool
        Whether the user has named the folder. Where not, one with another input's results is left alone, and one
        beside it is given.

    Raises
    ------
    UsageError
        The named folder holds the results of another input.
    """
    other = _of_another(out, source)
    if other is None:
        return out
    if named:
        raise UsageError(
            f"--out must be a folder of its own, but {out} holds the results of {other}: name another folder."
        )
    stem = re.sub(r"[^\w.-]+", "_", source.stem) or "results"
    names = (out.with_name(f"{out.name}-{stem}{'' if k == 1 else f'-{k}'}") for k in range(1, MOST_NAMES))
    return next(
        each
        for each in names
        if not each.exists() or (each.is_dir() and _owner(each) and not _of_another(each, source))
    )


def mark_owner(out: Path, source: Path) -> None:
    """Store in a folder to which input its results belong; the path is relative, so that both may be moved together.

    Raises
    ------
    OutputError
        The folder cannot be written.
    """
    with out_folder(out):
        content = json.dumps({"schema": 1, "input": _relative(out, source)}, ensure_ascii=False)
        (out / OWNER).write_text(content + "\n", encoding="utf-8", errors="surrogateescape")


def began_in(out: Path) -> int | None:
    """Time before anything is written to an own result folder, by the clock of its disk (ns); None for other folders.

    Raises
    ------
    OutputError
        The folder cannot be written.
    """
    if _owner(out) is None:
        return None
    with out_folder(out):
        trial = out / f"{OWNER}.part"
        trial.touch()
        began_ns = trial.stat().st_mtime_ns
        trial.unlink()
    return began_ns


def finish_in(out: Path, source: Path, names: Iterable[str], began_ns: int | None) -> None:
    """Mark the results in a folder as complete, and remove files left by an earlier call of the same command.

    Parameters
    ----------
    out : Path
        The folder.
    source : Path
        The input.
    names : iterable of str
        Files that a call of this kind may write; those older than this call are of an earlier one.
    began_ns : int or None
        What `began_in` gave before the first was written.

    Raises
    ------
    OutputError
        The folder cannot be written.
    """
    mark_owner(out, source)
    if began_ns is None:
        return
    with out_folder(out):
        for name in names:
            if (out / name).is_file() and (out / name).stat().st_mtime_ns < began_ns:
                (out / name).unlink()


def _relative(out: Path, source: Path) -> str:
    return Path(os.path.relpath(source.absolute(), out.absolute())).as_posix()


def _owner(out: Path) -> str | None:
    try:
        found = json.loads((out / OWNER).read_text(encoding="utf-8", errors="surrogateescape"))["input"]
    except (OSError, ValueError, LookupError, TypeError):
        return None  # made by hand, or by a version that did not say
    return found if isinstance(found, str) else None


def _of_another(out: Path, source: Path) -> str | None:
    """Name of the other input to which a folder's results belong; None where it has none, or this input's."""
    owner = _owner(out)
    if owner is None or (out / owner).resolve() == source.resolve():
        return None
    return os.path.normpath(out / owner)
