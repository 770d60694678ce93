"""Read the list of a batch: a CSV table with a row for each recording, whose columns are options of the command."""

import difflib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from fingervision.batch.result_folder import read_record
from fingervision.domain.errors import DataError, InputFileError, UsageError
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
