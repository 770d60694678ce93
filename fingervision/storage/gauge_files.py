"""The files gauges.toml (entries keep their text and comments) and gauges.csv (a row per frame and quantity)."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tomlkit
from tomlkit.exceptions import TOMLKitError

from fingervision.domain.errors import DataError, InputFileError
from fingervision.domain.field import Field
from fingervision.storage.durable import written
from fingervision.storage.plain_file import NotUtf8Error, plain
from fingervision.storage.plain_file import text_of as file_text
from fingervision.storage.row_file import RowFile

HEAD = "# For `fingervision measure RECORDING --gauges FILE`; `fingervision gauge RECORDING` draws them.\n"

Tables = Sequence[tuple[Mapping[str, Any], int | None]]


def text_of(path: Path) -> str | None:
    """Read the text of a gauges.toml; None if the file does not exist.

    Raises
    ------
    DataError, InputFileError
        The file cannot be read.
    """
    try:
        return file_text(path)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise InputFileError(f"The gauge file {path} could not be read ({error.strerror}).") from error
    except NotUtf8Error as error:
        raise DataError(f"{path} must be TOML in UTF-8, but is not: {error}.") from error


def gauges_text(tables: Tables, before: str | None, schema: int) -> str:
    """Compose the text of a file of gauges.

    Parameters
    ----------
    tables : sequence of (mapping, int or None)
        Settings of every gauge, and the index, from 0, of the gauge's table `[[gauge]]` in the previous text; None for
        a new gauge.
    before : str or None
        Previous text of the file; None for a new file.
    schema : int
        Schema number of the file.

    Returns
    -------
    str
        TOML text with exactly these gauges. Comments and order of the previous text are kept.
    """
    meant = {"schema": schema, "gauge": [dict(table) for table, _ in tables]}
    if before is not None:
        try:
            text = _changed(tables, before)
            if tomllib.loads(text) == meant:
                return text
        except (TOMLKitError, ValueError, TypeError, KeyError):
            pass  # a layout that cannot be changed in place is written anew
    return HEAD + _anew(meant)


def _changed(tables: Tables, before: str) -> str:
    """Replace only the changed tables of the text, and keep the rest."""
    document = tomlkit.parse(before)
    old: Any = document["gauge"]
    kept = {place: table for table, place in tables if place is not None}
    for place in reversed(range(len(old))):
        if place not in kept:
            del old[place]
            continue
        into, meant = old[place], kept[place]
        for key in [key for key in into if key not in meant]:
            del into[key]
        for key, value in meant.items():
            if key not in into or into[key] != value:
                into[key] = value
    for added in (table for table, place in tables if place is None):
        new = tomlkit.table()
        new.update(added)
        old.append(new)
    return tomlkit.dumps(document)


def _anew(meant: Mapping[str, Any]) -> str:
    tables = "".join("\n[[gauge]]\n" + tomlkit.dumps(table) for table in meant["gauge"])
    return f"schema = {meant['schema']}\n{tables}"


def write_gauges_text(path: Path, text: str) -> None:
    """Replace a file of gauges once the new file is complete.

    Raises
    ------
    OutputError
        The file cannot be written; its earlier version is kept.
    """
    with written(path, "the gauges are not lost; free disk space, and save again") as part:
        plain(path).parent.mkdir(parents=True, exist_ok=True)
        part.write_text(text, encoding="utf-8")


# The file gauges.csv: one row per frame and measured quantity,
# `time_s,gauge,quantity,value,u,unit,status,u_random,u_motion`.

# As in gaps.csv; a microradian is a thousandth of a milliradian.
TIME_PLACES, PLACES = 9, 7


@dataclass(frozen=True, slots=True)
class GaugeRow:
    """One row of gauges.csv; None is written as an empty cell."""

    time_s: Annotated[float | None, Field("presentation time of the frame", "s", TIME_PLACES)]
    gauge: Annotated[str, Field("name of the gauge")]
    quantity: Annotated[str, Field("name of the quantity that the gauge measures")]
    value: Annotated[float | None, Field("measured value", places=PLACES)]
    u: Annotated[float | None, Field("standard uncertainty of the value", places=PLACES, low=0.0)]
    unit: Annotated[str, Field("unit of the value and its uncertainty: mm, px or mrad")]
    status: Annotated[str, Field("`ok`, or why there is no value")]
    u_random: Annotated[
        float | None, Field("the part of `u` that differs from frame to frame", places=PLACES, low=0.0)
    ] = None
    u_motion: Annotated[
        float | None,
        Field(
            "standard uncertainty of the difference from the gauge's first value: errors that both values share cancel",
            places=PLACES,
            low=0.0,
        ),
    ] = None


class GaugeRows(list[GaugeRow]):
    """Collects rows in memory instead of writing them to a file."""

    def add(self, rows: Sequence[GaugeRow]) -> None:
        """Add rows, in order."""
        self.extend(rows)

    def close(self) -> None:
        """Do nothing: rows in memory need no closing."""


class GaugesCsv(RowFile[GaugeRow]):
    """Writes gauges.csv row by row; an existing file is replaced."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, GaugeRow)
