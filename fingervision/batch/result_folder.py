"""Folder of one result with a record of its input: written under a temporary name, and renamed when complete."""

import errno
import hashlib
import json
import os
import re
import shutil
import socket
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from uuid import uuid4

from fingervision.batch.task import Digest
from fingervision.storage.durable import replaced
from fingervision.storage.plain_file import json_of

RECORD = "record.json"
TABLES = (".csv", ".json", ".toml")
"""File suffixes of results that other programs read; a missing picture does not make a result incomplete."""
SCHEMA = 1
PART = re.compile(r"\.(?P<name>.+)\.part~(?P<host>[^~]+)~(?P<pid>\d+)~[0-9a-f]{8}")


@dataclass(frozen=True, slots=True)
class Record:
    """Record beside a result: its input (files and options) and its outcome.

    Parameters
    ----------
    input : str
        Absolute path of the input.
    stamp : str or None
        Sizes and modification times of the input's files, from `fingerprint.stamp_of`.
    content : str
        Hash of the input's content.
    options_key : str
        Hash of the options, of the files that the options name, and of the version.
    exit_code : int
        Exit code of the command.
    words : str
        Sentence with which the command ended.
    seconds : float
        Duration of the command.
    digest : Digest
        Table row and small plot of the result.
    tables : mapping of str to (int, int, str)
        Size, modification time and hash of each table of the result, by file name.
    """

    input: str
    stamp: str | None
    content: str
    options_key: str
    exit_code: int
    words: str
    seconds: float
    digest: Digest
    tables: Mapping[str, tuple[int, int, str]] = field(default_factory=dict)


def read_record(folder: Path) -> Record | None:
    """Read the record of a result; None for a missing or unreadable record."""
    try:
        held: Mapping[str, object] = json_of(folder / RECORD)
        if held.pop("schema") != SCHEMA:  # type: ignore[attr-defined]
            return None
        digest = held.pop("digest")  # type: ignore[attr-defined]
        # Relative to the results, so that both may move together.
        held["input"] = os.path.abspath(folder.parent / str(held["input"]))  # type: ignore[index]  # noqa: PTH100
        curve = tuple(digest["curve"])
        return Record(digest=Digest(digest["cells"], curve, digest["caption"]), **held)  # type: ignore[arg-type]
    except (OSError, ValueError, TypeError, KeyError):
        return None


def write_record(folder: Path, place: Path, record: Record) -> None:
    """Write the record of a result into `folder`, whose final path is `place`.

    Raises
    ------
    OSError
        The record cannot be written.
    """
    held = {
        "schema": SCHEMA,
        "input": os.path.relpath(record.input, place.parent),
        "stamp": record.stamp,
        "content": record.content,
        "options_key": record.options_key,
        "exit_code": record.exit_code,
        "words": record.words,
        "seconds": record.seconds,
        "digest": {
            "cells": dict(record.digest.cells),
            "curve": record.digest.curve,
            "caption": record.digest.caption,
        },
        "tables": dict(record.tables),
    }
    replace_text(folder / RECORD, json.dumps(held, allow_nan=False) + "\n")


def states_of_tables(folder: Path) -> dict[str, tuple[int, int, str]]:
    """Size, modification time (ns) and hash of every table file of a result, by file name.

    Raises
    ------
    OSError
        A table cannot be read.
    """
    found = {}
    for path in sorted(folder.iterdir()):
        if path.suffix in TABLES and path.name != RECORD and path.is_file():
            stat = path.stat()
            found[path.name] = (stat.st_size, stat.st_mtime_ns, _hash(path))
    return found


def is_whole(folder: Path, record: Record) -> bool:
    """Whether the table files of a result are unchanged; a file is read only if its modification time differs."""
    try:
        for name, (size, changed_ns, content) in record.tables.items():
            stat = (folder / name).stat()
            if stat.st_size != size or (stat.st_mtime_ns != changed_ns and _hash(folder / name) != content):
                return False
    except (OSError, ValueError):
        return False
    return True


def _hash(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def replace_text(path: Path, text: str) -> None:
    """Replace a text file; the older file remains until the new file is complete.

    Raises
    ------
    OSError
        The file cannot be written; its earlier version is kept.
    """
    with replaced(path, unique=f".{uuid4().hex[:8]}") as part:
        part.write_text(text, encoding="utf-8", errors="surrogateescape")


def new_part(folder: Path) -> Path:
    """Choose a temporary folder name beside the result folder; the name contains the identity of the worker."""
    return folder.with_name(f".{folder.name}.part~{_host()}~{os.getpid()}~{uuid4().hex[:8]}")


def publish(part: Path, folder: Path, record: Record) -> None:
    """Rename a complete result to its final name; an older result is first moved aside and then removed.

    If another worker has finished the same task before (a scheduler may assign a task twice), the result of that worker
    is kept.

    Raises
    ------
    OSError
        The folder cannot be renamed; the unfinished folder is kept.
    """
    for _ in range(3):
        with suppress(OSError):
            part.rename(folder)
            return
        there = read_record(folder)
        if there is not None and is_same(there, record) and is_whole(folder, there):
            shutil.rmtree(part, ignore_errors=True)
            return
        if (there is None and folder.exists()) or (there is not None and there.input != record.input):
            raise FileExistsError(errno.EEXIST, "it holds something else by now", str(folder))
        old = new_part(folder)
        with suppress(FileNotFoundError):  # another worker moved it
            folder.rename(old)
            with suppress(OSError):
                part.rename(folder)
                shutil.rmtree(old, ignore_errors=True)
                return
            old.rename(folder)
    part.rename(folder)


def is_same(there: Record, wanted: Record) -> bool:
    """Whether two records belong to the same input, with the same content and the same options."""
    return (there.input, there.content, there.options_key) == (wanted.input, wanted.content, wanted.options_key)


def remove_left_parts(out: Path) -> None:
    """Remove unfinished result folders of ended workers on this computer; folders of other workers are kept."""
    for entry in out.iterdir():
        found = PART.fullmatch(entry.name)
        if found is not None and found["host"] == _host() and not _lives(int(found["pid"])):
            shutil.rmtree(entry, ignore_errors=True)


def _host() -> str:
    return re.sub(r"[^A-Za-z0-9.-]", "_", socket.gethostname()) or "host"


def _lives(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    # A killed process keeps its number until its parent asks for its exit status.
    with suppress(OSError):
        return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] not in "ZX"
    return True
