"""Process one input in a worker process; processing the same input twice is harmless."""

import os
import shutil
from dataclasses import replace
from pathlib import Path
from time import perf_counter

from fingervision.batch.fingerprint import content_hash, is_settled, stamp_of
from fingervision.batch.reduction import reduction_of
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
