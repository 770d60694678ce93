"""Read the list of a batch: a CSV table with a row for each recording, whose columns are options of the command."""

import difflib
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import click

from fingervision.batch.result_folder import read_record
from fingervision.batch.run import Batch
from fingervision.cli.batch import options_of, run_batch
from fingervision.domain.errors import DataError, InputFileError, UnknownNameError, UsageError
from fingervision.interface.argument_checks import OF_OPTIONS, path_of, speaks_python
from fingervision.interface.progress import Bar
from fingervision.storage.csv_columns import OwnTable, header_of, read_columns

INPUTS = {"measure": "recording", "diagnose": "measured"}
"""Column that names the input of each command."""
GAPS = "gaps.csv"
ANSWERS = {"yes": True, "true": True, "1": True, "no": False, "false": False, "0": False}
SEPARATOR = ";"
"""Stands between several values of an option in one cell."""


@dataclass(frozen=True, slots=True)
class ListedRun:
    """One row of a list.

    Parameters
    ----------
    input : str
        The recording or the table.
    options : mapping of click.Option to object
        Options that the row states.
    missing : str
        Why the recording cannot be diagnosed: it has not been measured. Empty otherwise.
    """

    input: str
    options: Mapping[click.Option, Any]
    missing: str = ""


def listed_runs(
    path: Path, command: str, options: Sequence[click.Option], others: Sequence[click.Option], results: Path | None
) -> tuple[ListedRun, ...]:
    """Read a list; files are relative to its folder, empty cells state nothing.

    Parameters
    ----------
    path : Path
        The list.
    command : str
        `measure` or `diagnose`.
    options, others : sequence of click.Option
        Options of this command, and of the other command, which the same list may state too.
    results : Path or None
        Results of `batch measure`, whose gaps.csv of each recording is diagnosed.

    Raises
    ------
    DataError, InputFileError
        The list cannot be read, has an unknown column, an impossible value, or an input twice.
    """
    known = {_word(option): option for option in options}
    ignored = {_word(option) for option in others} | set(INPUTS.values())
    names = header_of(path)
    for name in names:
        if name.replace("_", "-") not in known | dict.fromkeys(ignored):
            near = difflib.get_close_matches(name.replace("_", "-"), [*known, *ignored], n=1)
            hint = f"did you mean {near[0].replace('-', '_')}?" if near else "remove it, or name it like an option"
            raise DataError(f"The columns of {path} must be {INPUTS[command]} and options, but one is {name}: {hint}")
    column = INPUTS[command] if results is None else INPUTS["measure"]
    if column not in names and INPUTS["measure"] in names:
        raise DataError(
            f"{path} lists recordings, but {command} needs their gaps: name the folder in which `batch measure` wrote "
            f"them with --results, or list them in a column {column}."
        )
    table = read_columns(path, (column,), texts=[name for name in names if name != column])
    inputs = [str(cell) for cell in _texts(table, column)]
    found = []
    for row, (line, cell) in enumerate(zip(table.lines, inputs, strict=True)):
        if not cell:
            raise DataError(
                f"{column} must name a file in every row, but line {line} of {path} has none: fill the cell."
            )
        chosen, missing = str(_beside(path, cell)), ""
        if results is not None and (gaps := _gaps_of(results, chosen)) is not None:
            chosen = str(gaps)
        elif results is not None:
            missing = (
                f"{chosen} must have its gaps in {results}, but has none (line {line} of the list): measure it with "
                "`fingervision batch measure`."
            )
        stated = {
            known[name.replace("_", "-")]: _value(known[name.replace("_", "-")], text, path, line)
            for name in names
            if name.replace("_", "-") in known and name != column and (text := _texts(table, name)[row])
        }
        found.append(ListedRun(chosen, stated, missing))
    places = [os.path.abspath(each.input) for each in found]  # noqa: PTH100 - links keep their own names
    for row, place in enumerate(places):
        if places.index(place) < row:
            lines = f"lines {table.lines[places.index(place)]} and {table.lines[row]}"
            raise DataError(
                f"{path} must list each input once, but {lines} name {found[row].input}: remove one of them."
            )
    if not found:
        raise DataError(f"{path} must list at least one {column}, but has no row: add one.")
    return tuple(found)


def _texts(table: OwnTable, name: str) -> Sequence[str]:
    return table.texts(name) or ()


def _word(option: click.Option) -> str:
    return next(flag for flag in option.opts if flag.startswith("--")).removeprefix("--")


def _beside(path: Path, cell: str) -> Path:
    return Path(cell) if Path(cell).is_absolute() else path.parent / cell


def _value(option: click.Option, text: str, path: Path, line: int) -> Any:
    """Convert a cell as the command line does; the name of an existing file is relative to the list."""
    where = f"line {line} of {path}"
    if option.is_flag:
        if text.lower() not in ANSWERS:
            raise DataError(f"{_word(option)} must be yes or no, but is {text} in {where}: correct it.")
        return ANSWERS[text.lower()]
    try:
        values = [_converted(option, each, path) for each in (text.split(SEPARATOR) if option.multiple else [text])]
    except (click.UsageError, UsageError) as error:
        said = (error.format_message() if isinstance(error, click.UsageError) else str(error)).removesuffix(".")
        raise DataError(f"{_word(option)} in {where} is not understood ({said}): correct the cell.") from None
    return tuple(values) if option.multiple else values[0]


def _converted(option: click.Option, text: str, path: Path) -> Any:
    is_file = isinstance(option.type, click.Path) or _beside(path, text.strip()).exists()
    cell = str(_beside(path, text.strip())) if is_file else text.strip()
    return option.type.convert(cell, option, None)


def _gaps_of(results: Path, recording: str) -> Path | None:
    """Find the table that `batch measure` wrote for a recording."""
    place = os.path.abspath(recording)  # noqa: PTH100 - links keep their own names
    for folder in _folders(results):
        record = read_record(folder)
        if record is not None and record.input == place:
            return folder / GAPS
    return None


def _folders(results: Path) -> Iterator[Path]:
    if not results.is_dir():
        raise InputFileError(f"There is no folder {results}: name that of `fingervision batch measure`.")
    yield from (entry for entry in sorted(results.iterdir()) if entry.is_dir())


# `fingervision.batch.measure` and `fingervision.batch.diagnose`: the commands on many inputs, from Python.

Inputs: TypeAlias = "str | os.PathLike[str] | Iterable[str | os.PathLike[str]]"


@speaks_python
def measure(
    inputs: Inputs = (),
    *,
    out: "str | os.PathLike[str]",
    list_file: "str | os.PathLike[str] | None" = None,
    scheduler: str | None = None,
    jobs: int | None = None,
    progress: Bar | bool | None = None,
    **options: Any,
) -> Batch:
    """Measure many recordings, on all cores or on a Dask cluster, into a result folder for each.

    In a script, call it under `if __name__ == "__main__":`, because the worker processes import the script.

    Parameters
    ----------
    inputs : path or iterable of path
        Recordings, or patterns such as `recordings/**/*.mp4`.
    out : path
        Folder for all results; inputs that are done there are not processed again.
    list_file : path or None
        CSV table with a row for each recording and its options, in place of `inputs`.
    scheduler : str or None
        Address of a Dask cluster, tcp://HOST:PORT.
    jobs : int or None
        Number of processes on this computer; None is one per core.
    progress : callable, bool or None
        As in `fingervision.measure`.
    **options
        Options of `fingervision measure`, by their names: `px_per_mm=34`, `calibration="calibration.json"`.

    Returns
    -------
    Batch
        An outcome for each input; `out / "batch.csv"` holds their numbers.

    Raises
    ------
    UsageError
        An option is unknown or has an impossible value.
    InputFileError, OutputError, ProcessError
        Nothing matches, the results cannot be written, or all workers are gone.

    Examples
    --------
    >>> import fingervision as fv
    >>> fv.batch.measure("no_such/*.mp4", out="results", px_per_mm=34.0)
    Traceback (most recent call last):
        ...
    fingervision.domain.errors.InputFileError: No file matches no_such/*.mp4: check the path, and put patterns in ...
    """
    return _run("measure", inputs, out, list_file, None, scheduler, jobs, progress, options)


@speaks_python
def diagnose(
    inputs: Inputs = (),
    *,
    out: "str | os.PathLike[str]",
    list_file: "str | os.PathLike[str] | None" = None,
    results: "str | os.PathLike[str] | None" = None,
    scheduler: str | None = None,
    jobs: int | None = None,
    progress: Bar | bool | None = None,
    **options: Any,
) -> Batch:
    """Diagnose many measured tables, as `measure` measures many recordings.

    Parameters
    ----------
    inputs, out, list_file, scheduler, jobs, progress
        As in `measure`, with measured tables for recordings.
    results : path or None
        Folder of a batch of `measure`, whose gaps of the list's recordings are diagnosed.
    **options
        Options of `fingervision diagnose`, by their names: `model="comsol.csv"`, `with_effects=["backlash"]`.

    Returns
    -------
    Batch
        An outcome for each input; `out / "batch.csv"` holds their numbers.

    Raises
    ------
    UsageError
        An option is unknown or has an impossible value.
    InputFileError, OutputError, ProcessError
        Nothing matches, the results cannot be written, or all workers are gone.
    """
    return _run("diagnose", inputs, out, list_file, results, scheduler, jobs, progress, options)


def _run(
    name: str,
    inputs: Any,
    out: Any,
    list_file: Any,
    results: Any,
    scheduler: str | None,
    jobs: int | None,
    progress: Bar | bool | None,
    options: dict[str, Any],
) -> Batch:
    known = {}
    for option in options_of(name):
        word = next(flag for flag in option.opts if flag.startswith("--")).removeprefix("--")
        known[OF_OPTIONS.get(word, word.replace("-", "_"))] = option
    given = {}
    for key, value in options.items():
        if key not in known:
            raise UnknownNameError("option", key, known, f"an option of fingervision {name}")
        if value is not None:
            given[known[key]] = _stated(known[key], value)
    listed = (inputs,) if isinstance(inputs, str | os.PathLike) else inputs
    files = [None if each is None else path_of(what, each, "a file or folder")
             for what, each in (("list_file", list_file), ("results", results), ("out", out))]  # fmt: skip
    return run_batch(
        name, given, tuple(map(os.fspath, listed)), files[0], files[1], files[2] or Path(), scheduler, jobs, progress
    )[1]


def _stated(option: click.Option, value: Any) -> Any:
    """Convert a value as the command line does; several numbers such as a region become one word."""
    if option.is_flag:
        return bool(value)
    several = isinstance(value, list | tuple)
    words = [str(each) for each in value] if several else [str(value)]
    if several and not option.multiple:
        words = [",".join(words)]
    try:
        converted = [option.type.convert(word, option, None) for word in words]
    except click.UsageError as error:
        raise UsageError(f"{option.opts[0]} is not understood: {error.format_message()}") from None
    return tuple(converted) if option.multiple else converted[0]
