"""A batch from start to finish: planning, execution, and the overview of all results."""

import glob
import hashlib
import json
import mimetypes
import os
import re
from collections import Counter
from collections.abc import Callable, Collection, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from fingervision.batch.overview import write_overview
from fingervision.batch.result_folder import Record, is_whole, read_record, remove_left_parts, replace_text
from fingervision.batch.task import Outcome, Task, failure
from fingervision.batch.work import outcome_of, stamp_of
from fingervision.domain.errors import ExitCode, InputFileError, OutputError, UsageError

# Names of result folders: the file name of the input, with as much of its path as makes the name unique.

BETWEEN = "__"
LONGEST = 200
"""Largest length of a name in characters; file systems allow 255 bytes, and the temporary name of a folder is
longer."""


def folder_names(inputs: Sequence[Path], taken: Collection[str]) -> tuple[str, ...]:
    """Choose a folder name for each input; names are unique even without distinction of upper and lower case.

    Parameters
    ----------
    inputs : sequence of Path
        Absolute paths of the inputs, all different.
    taken : collection of str
        Names that are already in use.
    """
    parts = [path.parts[1:] or path.parts for path in inputs]
    depth = [1] * len(inputs)
    reserved = {name.casefold() for name in taken}
    while True:
        names = [BETWEEN.join(part[-deep:]) for part, deep in zip(parts, depth, strict=True)]
        count = Counter(name.casefold() for name in names)
        clashing = [
            number for number, name in enumerate(names) if count[name.casefold()] > 1 or name.casefold() in reserved
        ]
        longer = [number for number in clashing if depth[number] < len(parts[number])]
        if not longer:
            break
        for number in longer:
            depth[number] += 1
    # Part of a hash is added if the path does not make a name unique (a name may contain the separator) or is too long.
    for number, name in enumerate(names):
        if number in set(clashing) or len(name) > LONGEST:
            code = hashlib.sha256(str(inputs[number]).encode("utf-8", "surrogateescape")).hexdigest()[:12]
            names[number] = f"{name[-LONGEST:]}{BETWEEN}{code}"
    return tuple(names)


# List the recordings or tables that a user names by paths and by patterns in quotes.


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


MARK = "batch.json"
SCHEMA = 1
OWN_FILES = (MARK, "batch.csv", "batch.png", "index.html")


@dataclass(frozen=True, slots=True)
class Row:
    """An input of a list, which may state options of its own.

    Parameters
    ----------
    input : str
        The recording or the table.
    arguments : tuple of str
        The command's options for this input, without --out.
    options_key : str
        As in `Job`.
    missing : str
        Why the input cannot be processed; empty if it can.
    """

    input: str
    arguments: tuple[str, ...]
    options_key: str
    missing: str = ""


@dataclass(frozen=True, slots=True)
class Job:
    """The user's request: one command on many inputs, with the same options or with those of a list.

    Parameters
    ----------
    command : str
        `measure` or `diagnose`.
    inputs : tuple of str
        Paths and patterns.
    arguments : tuple of str
        The command's options, without --out.
    options_key : str
        Hash of the options, the files that they name, and the version.
    out : Path
        Folder of all results.
    rows : tuple of Row
        The rows of a list, which replaces `inputs`.
    """

    command: str
    inputs: tuple[str, ...]
    arguments: tuple[str, ...]
    options_key: str
    out: Path
    rows: tuple[Row, ...] = ()

    def each(self) -> tuple[Row, ...]:
        """Every input with its options.

        Raises
        ------
        InputFileError, UsageError
            No input matches, or all are in the result folder.
        """
        names = () if self.rows else inputs_of(self.inputs, self.out)
        return self.rows or tuple(Row(name, self.arguments, self.options_key) for name in names)


@dataclass(frozen=True, slots=True)
class Plan:
    """Division of a batch's inputs: those that already have a result, and those that remain to be processed.

    Parameters
    ----------
    job : Job
        The user's request.
    tasks : tuple of Task
        One for each input.
    done : dict of int to Outcome
        Outcomes of inputs that have a result already, or can have none, by index in `tasks`.
    """

    job: Job
    tasks: tuple[Task, ...]
    done: dict[int, Outcome]

    @property
    def to_do(self) -> tuple[int, ...]:
        """Indices of the tasks that are still to be processed."""
        return tuple(number for number in range(len(self.tasks)) if number not in self.done)


@dataclass(frozen=True, slots=True, repr=False)
class Batch:
    """Result of a batch.

    Parameters
    ----------
    out : Path
        Folder of all results.
    outcomes : tuple of Outcome
        One outcome for each input, in the order of the inputs.
    fresh : int
        Number of inputs that were processed by this call.
    stopped : str
        Reason why the batch stopped early; empty for a complete batch.

    Examples
    --------
    >>> import tempfile
    >>> import fingervision as fv
    >>> done = fv.batch.measure(
    ...     "sample_frames/table1/frame_00.png", out=tempfile.mkdtemp() + "/all", px_per_mm=34.0, jobs=1
    ... )
    >>> len(done.outcomes), done.fresh, done.bad
    (1, 1, ())
    """

    out: Path
    outcomes: tuple[Outcome, ...]
    fresh: int
    stopped: str

    def __repr__(self) -> str:
        there = sum(outcome.folder is not None for outcome in self.outcomes)
        return f"Batch({there} of {len(self.outcomes)} inputs have a result, {self.fresh} new, in {self.out})"

    @property
    def bad(self) -> tuple[Outcome, ...]:
        """Outcomes of a batch that have a message for the user."""
        return tuple(outcome for outcome in self.outcomes if outcome.exit_code)

    @property
    def exit_code(self) -> ExitCode:
        """Exit code: 0 all done; 3 done, but some inputs bad; 1 stopped, or none done; 2 wrong usage for all inputs."""
        codes = {outcome.exit_code for outcome in self.outcomes}
        if self.stopped:
            return ExitCode.COULD_NOT
        if codes == {ExitCode.WRONG_USAGE}:
            return ExitCode.WRONG_USAGE
        if codes <= {ExitCode.COULD_NOT, ExitCode.WRONG_USAGE}:
            return ExitCode.COULD_NOT
        return ExitCode.DAMAGED_INPUT if codes != {ExitCode.DONE} else ExitCode.DONE


Crew = Callable[[Sequence[Task]], Generator[tuple[int, Outcome], None, None]]
Progress = Callable[[int, int], None]


def planned(job: Job) -> Plan:
    """Find the inputs, and determine which of them already have a result.

    An input keeps its folder from an earlier call; the folder of a new input has the shortest unused name.

    Raises
    ------
    OutputError
        Nothing matches, or the folder for the results holds something else. Nothing is written yet.
    """
    rows = job.each()
    _check_folder(job)
    paths = [os.path.abspath(row.input) for row in rows]  # noqa: PTH100 - links keep their own names
    wanted = set(paths)
    home: dict[str, tuple[Path, Record]] = {}
    taken: list[str] = list(OWN_FILES)
    for folder in _folders(job.out):
        record = read_record(folder)
        if record is not None and record.input in wanted:
            home[record.input] = (folder, record)
        taken.append(folder.name)
    new = [path for path in paths if path not in home]
    fresh = dict(zip(new, folder_names([Path(path) for path in new], taken), strict=True))
    tasks: list[Task] = []
    done: dict[int, Outcome] = {}
    for number, (row, path) in enumerate(zip(rows, paths, strict=True)):
        folder, record = home[path] if path in home else (job.out / fresh[path], None)
        tasks.append(Task(job.command, row.input, row.arguments, folder, row.options_key))
        same = record is not None and record.options_key == row.options_key and _is_untouched(record, path)
        if record is not None and same and is_whole(folder, record):
            done[number] = outcome_of(row.input, folder, record)
        if row.missing:
            done[number] = failure(tasks[number], row.missing)
    return Plan(job, tuple(tasks), done)


def run(plan: Plan, crew: Crew, on_progress: Progress | None = None) -> Batch:
    """Let workers process the remaining tasks, and write the overview of all results.

    A full disk or Ctrl-C stops the batch; finished results are kept, and another call continues.

    Parameters
    ----------
    plan : Plan
        Inputs and tasks, from `planned`.
    crew : callable
        Function that processes tasks and yields each outcome, as it arrives, with the index of its task.
    on_progress : callable, optional
        Function called with the number of completed tasks and the number of all tasks of this call.

    Raises
    ------
    OutputError
        The folder for the results cannot be made, or the overview cannot be written.
    ProcessError
        All workers are gone.
    """
    _claim(plan.job)
    numbers = plan.to_do
    outcomes = dict(plan.done)
    fresh, stopped = 0, ""
    try:
        with closing(crew([plan.tasks[number] for number in numbers])) as coming:
            for place, outcome in coming:
                outcomes[numbers[place]] = outcome
                fresh += not outcome.kept
                if on_progress is not None:
                    on_progress(len(outcomes) - len(plan.done), len(numbers))
                if outcome.disk_full:
                    stopped = f"The disk of {plan.job.out} is full"
                    break
    except KeyboardInterrupt:
        stopped = "Stopped by the user"
    finally:
        remove_left_parts(plan.job.out)
    if stopped:
        kept = sum(outcome.folder is not None for outcome in outcomes.values())
        advice = "free disk space and " if "full" in stopped else ""
        stopped += (
            f"; {kept} of {len(plan.tasks)} inputs are done and kept: {advice}repeat the command to process the others."
        )
    every = tuple(
        outcomes.get(number, failure(task, "The batch ended before this input: repeat the command."))
        for number, task in enumerate(plan.tasks)
    )
    batch = Batch(plan.job.out, every, fresh, stopped)
    try:
        write_overview(plan.job.out, plan.job.command, every)
    except OSError as error:
        raise OutputError(
            f"{stopped or 'All results are there'} The overview in {plan.job.out} could not be written "
            f"({error.strerror}): free disk space and repeat this command."
        ) from error
    return batch


def _check_folder(job: Job) -> None:
    """Refuse a result folder that contains something other than the results of a batch."""
    try:
        entries = [entry.name for entry in os.scandir(job.out) if not entry.name.startswith(".")]
    except FileNotFoundError:
        return
    except NotADirectoryError:
        raise OutputError(f"--out must be a folder, but {job.out} is a file: name another.") from None
    except OSError as error:
        raise OutputError(f"The folder {job.out} cannot be read ({error.strerror}): name another.") from error
    if entries and MARK not in entries:
        raise OutputError(
            f"--out must be a new folder or that of an earlier batch, but {job.out} contains other files "
            f"({min(entries)}): name another."
        )
    if entries and (command := _command_of(job.out / MARK)) != job.command:
        raise OutputError(
            f"--out must be a folder of `batch {job.command}`, but {job.out} was written by `batch {command}`: name "
            "another folder."
        )


def _claim(job: Job) -> None:
    """Create the result folder, and mark it as the result folder of a batch."""
    mark = job.out / MARK
    try:
        job.out.mkdir(parents=True, exist_ok=True)
        if not mark.exists():
            replace_text(mark, json.dumps({"schema": SCHEMA, "command": job.command}) + "\n")
        remove_left_parts(job.out)
    except OSError as error:
        raise OutputError(
            f"The folder {job.out} cannot be written ({error.strerror}): free disk space or name another "
            "folder with --out."
        ) from error


def _command_of(mark: Path) -> str:
    try:
        return str(json.loads(mark.read_bytes())["command"])
    except (ValueError, TypeError, KeyError):
        return "something else"


def _folders(out: Path) -> list[Path]:
    if not out.exists():
        return []
    with os.scandir(out) as entries:
        return [Path(entry.path) for entry in entries if not entry.name.startswith(".") and entry.is_dir()]


def _is_untouched(record: Record, path: str) -> bool:
    try:
        return record.stamp is not None and record.stamp == stamp_of(Path(path))
    except OSError:
        return False
