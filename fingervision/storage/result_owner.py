"""Record of the input to which a result folder belongs, so that no command overwrites results of another input."""

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
        The folder that the user names, or the default folder.
    source : Path
        The input file or folder, or a pattern of file names.
    named : bool
        Whether the user has named the folder. If not, and if the default folder holds results of another input, a new
        folder beside it is returned.

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
    """Store in a result folder the relative path of its input, so that folder and input may be moved together.

    Raises
    ------
    OutputError
        The folder cannot be written.
    """
    with out_folder(out):
        content = json.dumps({"schema": 1, "input": _relative(out, source)}, ensure_ascii=False)
        (out / OWNER).write_text(content + "\n", encoding="utf-8", errors="surrogateescape")


def began_in(out: Path) -> int | None:
    """Time before the first result is written, by the clock of the disk (ns); None if the folder has no owner record.

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
    """Mark the results in a folder as complete, and delete files that remain from an earlier call of the same command.

    Parameters
    ----------
    out : Path
        The folder.
    source : Path
        The input of the command.
    names : iterable of str
        Names of files that the command may write; those older than this call remain from an earlier call.
    began_ns : int or None
        Result of `began_in` before the first file was written.

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
        return None  # made by hand, or by an older version
    return found if isinstance(found, str) else None


def _of_another(out: Path, source: Path) -> str | None:
    """Name of the other input to which a folder's results belong; None without results or for the same input."""
    owner = _owner(out)
    if owner is None or (out / owner).resolve() == source.resolve():
        return None
    return os.path.normpath(out / owner)
