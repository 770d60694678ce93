"""Detect changes of an input, first by size and modification time, then by the hash of its content."""

import hashlib
from pathlib import Path
from time import time_ns

BYTES_AT_ONCE = 1 << 20
COLUMNS = "columns.toml"
"""Name of the file that states the meaning of the columns of tables in the same folder."""
SETTLED_NS = 3_000_000_000
"""Age below which a file may change again without a change of its modification time, whose resolution is 2 s on some
file systems."""


def files_of(path: Path) -> list[Path]:
    """Files of an input: the file and the columns.toml beside it, or the files in a folder that are not hidden."""
    if not path.is_dir():
        columns = path.parent / COLUMNS
        return [path, columns] if columns != path and columns.is_file() else [path]
    return sorted(file for file in path.iterdir() if not file.name.startswith(".") and file.is_file())


def stamp_of(path: Path) -> str:
    """Sizes and modification times of an input's files, by which an unchanged input is recognised without reading it.

    Raises
    ------
    OSError
        The file cannot be read.
    """
    found = hashlib.sha256()
    for file in files_of(path):
        state = file.stat()
        found.update(f"{file.name}\0{state.st_size}\0{state.st_mtime_ns}\n".encode("utf-8", "surrogateescape"))
    return found.hexdigest()


def is_settled(path: Path) -> bool:
    """Whether the last change of a file is so old that any further change would give a different modification time.

    Raises
    ------
    OSError
        The file cannot be read.
    """
    return all(time_ns() - file.stat().st_mtime_ns > SETTLED_NS for file in files_of(path))


def content_hash(path: Path) -> str:
    """SHA-256 hash of the content of a file, or of the names and hashes of the files in a folder.

    Raises
    ------
    OSError
        The file cannot be read.
    """
    files = files_of(path)
    if files == [path]:
        return _hash_of(path)
    together = hashlib.sha256()
    for file in files:
        together.update(f"{_hash_of(file)}  {file.name}\n".encode("utf-8", "surrogateescape"))
    return together.hexdigest()


def _hash_of(file: Path) -> str:
    found = hashlib.sha256()
    with file.open("rb") as content:
        while block := content.read(BYTES_AT_ONCE):
            found.update(block)
    return found.hexdigest()
