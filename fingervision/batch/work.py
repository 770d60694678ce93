"""Process one input in a worker process; processing the same input twice is harmless."""

import hashlib
import os
import shutil
from dataclasses import replace
from pathlib import Path
from time import perf_counter, time_ns

from fingervision.batch.overview import reduction_of
from fingervision.batch.result_folder import (
    Record,
    is_whole,
    new_part,
    publish,
    read_record,
    states_of_tables,
    write_record,
)
from fingervision.batch.task import NO_ROOM, Outcome, Perform, Task, failure

# Detect changes of an input, first by size and modification time, then by the hash of its content.

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


def work(task: Task, perform: Perform) -> Outcome:
    """Process one input and store the result in its folder, unless the result already exists.

    Every failure becomes an outcome with a sentence. The complete result folder is put in place by a rename; until
    then, and if the new result fails, an older result is kept.

    Parameters
    ----------
    task : Task
        Task to process.
    perform : callable
        Function that runs a command, given its name and arguments, and returns how it ended.
    """
    started = perf_counter()
    part = new_part(task.folder)
    try:
        return _brought(task, perform, part, started)
    except OSError as error:
        where = error.filename or task.folder
        return failure(
            task,
            f"{task.input} could not be processed, because {where} could not be read or written ({error.strerror}): "
            f"check the disk and its permissions, and repeat the command.",
            perf_counter() - started,
            disk_full=error.errno in NO_ROOM,
        )
    finally:
        shutil.rmtree(part, ignore_errors=True)


def outcome_of(name: str, folder: Path, record: Record) -> Outcome:
    """Return the outcome stated by a record."""
    return Outcome(name, folder, record.exit_code, record.words, record.digest, record.seconds, kept=True)


def _brought(task: Task, perform: Perform, part: Path, started: float) -> Outcome:
    source = Path(task.input)
    exists = source.exists()  # the command itself reports a missing input
    settled = exists and is_settled(source)
    stamp, content = (stamp_of(source), content_hash(source)) if exists else ("", "")
    name = os.path.abspath(source)  # noqa: PTH100 - links keep their own names
    there = read_record(task.folder)
    key = (name, content, task.options_key)
    same = there is not None and (there.input, there.content, there.options_key) == key
    if exists and there is not None and same and is_whole(task.folder, there):
        touched = replace(there, stamp=stamp if settled else None)
        if touched != there:
            write_record(task.folder, task.folder, touched)
        return outcome_of(task.input, task.folder, touched)
    ended = perform(task.command, (*task.arguments, "--out", str(part), "--", task.input))
    words = ended.words.replace(str(part), str(task.folder))
    seconds = round(perf_counter() - started, 3)
    if not ended.finished or not exists:
        return failure(task, words, seconds, ended.exit_code, disk_full=ended.disk_full)
    if stamp_of(source) != stamp or (not settled and content_hash(source) != content):
        return failure(
            task,
            f"{task.input} was changed while it was processed: repeat the command when the file is complete.",
            seconds,
        )
    digest = reduction_of(task.command).digest_of(part)
    record = Record(
        input=name,
        stamp=stamp if settled or is_settled(source) else None,
        content=content,
        options_key=task.options_key,
        exit_code=ended.exit_code,
        words=words,
        seconds=seconds,
        digest=digest,
        tables=states_of_tables(part),
    )
    write_record(part, task.folder, record)
    publish(part, task.folder, record)
    return replace(outcome_of(task.input, task.folder, record), kept=False)
