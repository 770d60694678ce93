"""The folder of results: created, locked for one program, and marked with the input to which its results belong."""

import json
import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from fingervision.domain.errors import OutputError, UsageError

LOCK = ".lock"
fcntl: Any
try:
    import fcntl
except ImportError:  # not on Windows, where an open file is always locked
    fcntl = None


class FolderLock:
    """Exclusive lock of a folder.

    Parameters
    ----------
    path : Path
        The folder to lock.

    Raises
    ------
    FingervisionError
        Another program uses the folder, or the folder cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self._path = path / LOCK
        while True:
            try:
                self._file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644)
            except OSError as error:
                raise OutputError(
                    f"The folder {path} cannot be written ({error.strerror}): name another folder with --out."
                ) from error
            try:
                if fcntl is not None:
                    fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                os.close(self._file)
                raise OutputError(
                    f"The folder {path} is in use by another run: wait for its end, or name another folder with --out."
                ) from None
            if self._is_there():
                return
            os.close(self._file)  # its holder removed it between opening and locking

    def _is_there(self) -> bool:
        try:
            return os.path.samestat(os.fstat(self._file), self._path.stat())
        except OSError:
            return False

    def remove(self) -> None:
        """Release the lock, and delete the lock file."""
        if self._file >= 0:
            with suppress(OSError):
                self._path.unlink()
        self.release()

    def release(self) -> None:
        """Release the lock."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


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


@contextmanager
def out_folder(path: Path) -> Iterator[None]:
    """Create a folder if needed; system errors raised in the `with` block are converted to errors that name the folder.

    Raises
    ------
    OutputError
        The folder cannot be created or written.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        yield
    except FileExistsError:
        raise OutputError(f"--out must be a folder, but {path} is a file: name another.") from None
    except OutputError:  # error of a file in the folder, which has its own message
        raise
    except OSError as error:
        raise OutputError(
            f"The folder {path} cannot be written ({error.strerror}): name another folder with --out."
        ) from error


def make_out_folder(path: Path) -> None:
    """Create the folder before a long computation, so that its result is not lost because of an unusable folder."""
    with out_folder(path):
        pass


@contextmanager
def new_out_folder(path: Path) -> Iterator[None]:
    """Create the folder before a long computation, and remove it if the computation fails and leaves it empty."""
    was_there = path.exists()
    make_out_folder(path)
    try:
        yield
    except BaseException:
        if not was_there and not any(path.iterdir()):
            path.rmdir()
        raise
