"""Files that are complete whenever the program or the machine stops: replaced as a whole, and flushed to the disk."""

import errno
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic

from fingervision.domain.errors import OutputError

FLUSH_EVERY_S = 0.5
"""Longest time between two flushes of a file that grows. What is added waits as long again for the next one, so that at
most one second is lost when the program is killed or the power fails."""


@contextmanager
def replaced(path: Path, unique: str = "") -> Iterator[Path]:
    """Write a file beside the final one, which it replaces once it is complete and on the disk.

    After a power failure the file is either the former or the new one.

    Parameters
    ----------
    path : Path
        The final file.
    unique : str
        Part of the temporary name, if several processes may write the same file.

    Yields
    ------
    Path
        The temporary file; it is removed if the block fails.
    """
    part = path.with_name(f".{path.name}{unique}.part")
    try:
        yield part
        flush(part)
        part.replace(path)
        flush(path.parent)
    except BaseException:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise


@contextmanager
def written(path: Path, cure: str) -> Iterator[Path]:
    """Write a file as `replaced` does; if that fails, the error names the file and what to do.

    Raises
    ------
    OutputError
        The file cannot be written; an older one is kept.
    """
    try:
        with replaced(path) as part:
            yield part
    except OSError as error:
        raise OutputError(f"{path} could not be written ({error.strerror}): {cure}.") from error


def flush(path: Path) -> None:
    """Wait until a file, or the entries of a folder, are on the disk; Windows flushes folders itself."""
    if os.name == "nt" and path.is_dir():
        return
    number = os.open(path, os.O_RDWR if os.name == "nt" else os.O_RDONLY)
    try:
        flush_open(number)
    finally:
        os.close(number)


def flush_open(number: int) -> None:
    """Wait until an open file, given by its number, is on the disk."""
    try:
        os.fsync(number)
    except OSError as error:
        # Pipes and some network folders have no such operation.
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise


class Flushing:
    """Flushes a file that grows, at most `FLUSH_EVERY_S` after the previous time.

    Parameters
    ----------
    path : Path
        The file.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._at = 0.0

    def when_due(self) -> None:
        """Flush the file if its last flush is long enough ago; the first call also flushes the folder's entry."""
        if monotonic() - self._at >= FLUSH_EVERY_S:
            if self._at == 0.0:
                flush(self._path.parent)
            flush(self._path)
            self._at = monotonic()


def remove_empty(folder: Path, names: Sequence[str]) -> None:
    """Remove those of the named files of a folder that are empty, and unfinished replacements of them.

    A power failure can leave the name of a file whose content had not reached the disk.
    """
    for name in names:
        (folder / f".{name}.part").unlink(missing_ok=True)
        file = folder / name
        if file.is_file() and file.stat().st_size == 0:
            file.unlink()
