"""Interpretation of a raw table: role and unit of each column, and open questions."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError
from fingervision.storage.csv_columns import Numbers
from fingervision.tables.body_channels import BodyChannels, channels_in
from fingervision.tables.column_choice import CANONICAL, NEEDED, Findings, choose
from fingervision.tables.dialect import MISSING, NO_NUMBER, to_numbers
from fingervision.tables.doubts import (
    doubts,
    dropped_out,
    filler_value,
    unit_question,
    unit_readings,
    without_filler,
    wrong_unit,
)
from fingervision.tables.mapping import Entry
from fingervision.tables.own_format import refuse_gaps_without_input, refuse_long_table
from fingervision.tables.questions import OpenQuestionError, Question, Reading, asked, span
from fingervision.tables.raw_table import RawColumn, RawTable
from fingervision.tables.times import clock_leaps, is_day_number, is_epoch, looks_like_time, seconds_of, without_leaps
from fingervision.tables.units import DIMENSION, ColumnName, column_name, factor, known_unit, spelled

# Read cells that contain a number and its unit, such as the durations of MATLAB's timetables (`0.1 sec`).

WITH_UNIT = re.compile(r"([+-]?[\d.,]+(?:[eE][+-]?\d+)?)\s*([^\W\d_]+)")


def with_units_of_cells(raw: RawTable) -> RawTable:
    """Move the unit from the cells of a column to the column's name, if all cells have the same unit."""
    columns = tuple(_column(column) for column in raw.columns)
    return raw if columns == raw.columns else replace(raw, columns=columns)


def _column(column: RawColumn) -> RawColumn:
    if isinstance(column.content, Numbers) or column.unit:
        return column
    found: list[str] = []
    units: set[str] = set()
    for cell in column.content:
        match = WITH_UNIT.fullmatch(cell)
        if match is not None and known_unit(match[2]) is not None:
            found.append(match[1])
            units.add(match[2])
        elif cell.lower() in MISSING:
            found.append(cell)
        else:
            return column
        if len(units) > 1:
            return column
    return replace(column, content=found, unit=units.pop()) if units else column


DATE = "date"
"""Word used as the unit of times that are written as dates or times of day."""
MOST_UNREAD = 0.05
"""Largest fraction of a column's cells that may not be numbers (such as ERR of a logger) without a question to the
user."""

OTHER_VALUES = frozenset({"left", "right", "force", "u_gap", "u_random"})
"""Roles whose columns may hold something else (pixels, volts) in a table that also has the values needed."""


@dataclass(frozen=True, slots=True)
class Taken:
    """Interpretation of one column.

    Parameters
    ----------
    name : str
        Name of the column in the file.
    role : str
        Role of the column.
    unit : str
        Unit of the column as written; empty if there is none.
    """

    name: str
    role: str
    unit: str


@dataclass(frozen=True, slots=True, eq=False)
class Understood:
    """A table whose columns are interpreted.

    Parameters
    ----------
    raw : RawTable
        The raw table.
    kind : str
        `measured`, `drive` or `simulation`.
    taken : tuple of Taken
        Columns to which a role was assigned.
    columns : mapping of str to Numbers
        Values of the columns by role, in mm, s and N.
    runs : tuple of str, or None
        Name of the run of each row; None without runs.
    notes : tuple of str
        Assumptions that were made, one sentence each.
    left_out : tuple of str
        Omissions with their reasons, one sentence each.
    questions : tuple of Question
        Open questions.
    channels : BodyChannels
        User-named channels of a measured table.
    """

    raw: RawTable
    kind: str
    taken: tuple[Taken, ...]
    columns: Mapping[str, Numbers]
    runs: tuple[str, ...] | None = None
    notes: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    questions: tuple[Question, ...] = ()
    channels: BodyChannels = field(default_factory=BodyChannels)

    @property
    def path(self) -> Path:
        """Path of the table's file."""
        return self.raw.path

    def decided(self) -> "Understood":
        """Return the interpreted table if there is no open question; otherwise raise an error with the question.

        Raises
        ------
        OpenQuestionError
            There is an open question.
        DataError
            A required column is missing, and no column of the table can be it.
        """
        lost = [each.missing for each in self.questions if each.missing and not each.readings]
        if lost:
            raise DataError(f"{self.path} must have a column {' and a column '.join(lost)}, but {self._instead(lost)}")
        if self.questions:
            raise OpenQuestionError(self.path, self.kind, self.questions)
        return self

    def _instead(self, lost: list[str]) -> str:
        """Say what the table is, and what to give instead of it, if required columns cannot be found in it."""
        roles = {each.role for each in self.taken}
        if self.kind == "measured" and lost == [CANONICAL["gap"]] and "input" in roles and roles & {"time", "date"}:
            return (
                "is a log of the drive, which holds no gap: measure the recording of this motion with it (fingervision "
                f"measure RECORDING --drive {self.path.name}), and give the gaps.csv that this writes."
            )
        return "none of its columns can be that: give a table that has it."


def understand(raw: RawTable, kind: str, given: Entry) -> Understood:
    """Interpret each column of a raw table: assign roles and convert units.

    Parameters
    ----------
    raw : RawTable
        Raw table from a file of any format.
    kind : str
        `measured`, `drive` or `simulation`.
    given : Entry
        Decisions of the user.

    Raises
    ------
    DataError
        A decision of the user in columns.toml does not fit the table.
    """
    refuse_long_table(raw)
    about = Findings(notes=list(raw.notes), left_out=list(raw.left_out))
    raw = with_units_of_cells(raw)
    names = [column_name(column.name) for column in raw.columns]
    chosen = choose(raw, names, kind, given, about)
    if "input" not in chosen:
        refuse_gaps_without_input(raw)
    columns: dict[str, Numbers] = {}
    taken: list[Taken] = []
    decimal = given.words.get("decimal") or str(raw.settings.get("decimal", "."))
    for role, place in chosen.items():
        column = raw.columns[place]
        if role in ("run", "date"):
            taken.append(Taken(column.name, role, ""))
            continue
        if role == "time" and (dated := _dated(raw, chosen, given, about)) is not None:
            columns[role] = dated
            taken.append(Taken(column.name, role, DATE))
            continue
        values = _numbers(raw, column, role, decimal, given, about)
        unit = _unit(column, names[place], role, kind, given, about, values)
        taken.append(Taken(column.name, role, unit or ""))
        if unit is None:
            continue
        size = factor(unit, DIMENSION[role])
        if size is None and role in OTHER_VALUES and role not in given.columns and _is_dispensable(role, kind, chosen):
            about.notes.append(f"'{column.name}' ({role}) is not used: its unit, {unit}, is no {DIMENSION[role]}.")
            taken.pop()
            continue
        if size is None:
            known = values.value[values.present]
            about.questions.append(wrong_unit(column.name, role, DIMENSION[role], unit, known))
            continue
        values = _with_values_only(values, column, role, unit, given, about)
        columns[role] = values if size == 1.0 else Numbers(values.value * size, values.present)
        if column.since and role == "time":
            taken[-1] = Taken(column.name, role, DATE)
        if column.since:
            about.notes.append(f"The times in {column.name} are counted from {column.since}.")
    if "time" in columns and given.words.get("clock") == "continuous":
        columns["time"] = _continuous(columns["time"], about)
    run_cells = _runs(raw, chosen, columns, given, about)
    if not about.questions and "input" in columns:
        codes = None if run_cells is None else _codes(run_cells)
        by_date = any(each.role == "time" and each.unit == DATE for each in taken)
        about.questions += doubts(columns, given, kind, codes, dated=by_date)
    channels = BodyChannels()
    if kind == "measured":
        channels = channels_in(raw, frozenset(chosen.values()), decimal)
        about.notes += channels.notes
    return Understood(
        raw, kind, tuple(taken), columns, run_cells, tuple(about.notes), tuple(about.left_out),
        tuple(about.questions), channels,
    )  # fmt: skip


def _with_values_only(
    values: Numbers, column: RawColumn, role: str, unit: str, given: Entry, about: Findings
) -> Numbers:
    """Numbers of a column without those that stand for a missing value, and times from their epoch."""
    if role == "time":
        return _from_epoch(values, column, unit, about)
    if "missing" in given.words:
        return without_filler(values, given.words["missing"])
    if "sizes" not in given.accept and DIMENSION[role] == "length":
        filler = 0.0 if dropped_out(values).any() else filler_value(values)
        if filler is not None:
            about.questions.append(_filler(column.name, values, filler, unit))
    return values


def _is_dispensable(role: str, kind: str, chosen: Mapping[str, int]) -> bool:
    """Whether a table can be read without a column: without the sides if there is a gap."""
    return role not in NEEDED[kind] and (role not in ("left", "right") or "gap" in chosen)


def _unit(
    column: RawColumn, name: ColumnName, role: str, kind: str, given: Entry, about: Findings, values: Numbers
) -> str | None:
    """Unit of a column as stated by the user, beside the name or in the name; None if unresolved or not needed."""
    if role in given.units:
        return given.units[role]
    stated = [unit for unit in (spelled(column.unit), name.unit) if unit and unit != "-"]
    if stated:
        if len({known_unit(unit) or unit for unit in stated}) > 1:
            readings = unit_readings(role, DIMENSION[role], stated, values.value[values.present])
            about.questions.append(asked(f"the unit of '{column.name}' is {stated[0]} and {stated[1]}", readings))
            return None
        return stated[0]
    optional = role not in NEEDED[kind] and role in ("force", "u_gap", "u_random")
    if optional:
        about.notes.append(
            f"{column.name} has no unit and is not used; state its unit as units.{role} in columns.toml."
        )
        return None
    words = f"the unit of '{column.name}' ({role}) is not stated"
    about.questions.append(unit_question(words, role, DIMENSION[role], values.value[values.present]))
    return None


def _filler(name: str, values: Numbers, filler: float, unit: str) -> Question:
    """Question whether a number means no value, with the range of the column for both answers."""
    key = f"missing={filler:.12g}"
    others = without_filler(values, key.partition("=")[2])
    rows = np.count_nonzero(values.present) - np.count_nonzero(others.present)
    size = factor(unit, "length") or 1.0
    readings = [
        Reading(each, span(size * kept.value[kept.present], "mm"))
        for each, kept in ((key, others), ("accept=sizes", values))
    ]
    return asked(
        f"{rows} of {values.value.size} rows of '{name}' hold {filler:.12g}, far from the rows beside them, which may "
        "mean no value",
        readings,
    )


def _numbers(raw: RawTable, column: RawColumn, role: str, decimal: str, given: Entry, about: Findings) -> Numbers:
    """Read a column's cells as numbers; cells that are not numbers are reported."""
    if isinstance(column.content, Numbers):
        return _without_overflow(column.content)
    values, odd = to_numbers(column.content, decimal)
    values = _without_overflow(values)
    if odd.size:
        at = int(odd[0])
        words = (
            f"{odd.size} of {len(column)} cells of '{column.name}' are not numbers ('{column.content[at][:40]}' in "
            f"{raw.place(at)})"
        )
        if odd.size > max(1.0, MOST_UNREAD * len(column)) and "unreadable_cells" not in given.accept:
            about.questions.append(_unreadable(words, column.content, role, decimal, values))
        about.left_out.append(words)
    return values


def _unreadable(words: str, cells: Sequence[str], role: str, decimal: str, values: Numbers) -> Question:
    """Question about cells that are not numbers: the other decimal mark, or to leave them out if most can be read."""
    other = "," if decimal == "." else "."
    ways = {f"decimal={other}": to_numbers(cells, other)[0], "accept=unreadable_cells": values}
    rows = {key: int(np.count_nonzero(kept.present)) for key, kept in ways.items()}
    readings = [
        Reading(key, f"{rows[key]} of {len(cells)} rows, {span(kept.value[kept.present])}")
        for key, kept in ways.items()
        if rows[key] > (0.5 * len(cells) if kept is values else np.count_nonzero(values.present))
    ]
    return asked(words, readings) if readings else Question(f"{words}: name another column", f"columns.{role}=NAME")


def _without_overflow(values: Numbers) -> Numbers:
    """Mark an instrument's 9.91E37 (not a number) and 9.9E37 (overflow) as missing."""
    usable = np.abs(values.value) < NO_NUMBER
    return values if usable.all() else Numbers(np.where(usable, values.value, 0.0), values.present & usable)


def _dated(raw: RawTable, chosen: Mapping[str, int], given: Entry, about: Findings) -> Numbers | None:
    """Convert a column of dates and times of day to seconds; None if the column contains numbers."""
    column = raw.columns[chosen["time"]]
    if isinstance(column.content, Numbers) or "time" in given.units or not looks_like_time(column.content):
        return None
    cells = column.content
    day = chosen.get("date")
    if day is None:
        days = [
            k
            for k, other in enumerate(raw.columns)
            if column_name(other.name).role == "date" and k != chosen["time"] and not isinstance(other.content, Numbers)
        ]
        day = days[0] if len(days) == 1 else None
    if day is not None and not isinstance(dates := raw.columns[day].content, Numbers) and ":" not in dates[0]:
        cells = [f"{a} {b}" if a and b else "" for a, b in zip(dates, cells, strict=True)]
        about.notes.append(f"{raw.columns[day].name} and {column.name} are read as one date.")
    read = seconds_of(cells, given.words.get("date_order", ""))
    if read.open_order:
        about.questions.append(Question(f"the order of day and month in '{read.since}' is ambiguous", "date_order=dmy"))
    if read.unread:
        about.left_out.append(f"{read.unread} cells of '{column.name}' are not times")
    about.notes += [*read.notes, f"The times in {column.name} are counted from {read.since}."]
    return read.numbers


def _from_epoch(values: Numbers, column: RawColumn, unit: str, about: Findings) -> Numbers:
    """Subtract the first time if the clock counts from 1900, 1904 or 1970."""
    if not values.present.any():
        return values
    first = float(values.value[int(np.argmax(values.present))])
    if known_unit(unit) == "day" and is_day_number(first):
        about.notes.append(
            f"{column.name} counts days since 1900, as a spreadsheet does: it is taken from its first row."
        )
        return Numbers(np.where(values.present, values.value - first, 0.0), values.present)
    for scale, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "µs")):
        if epoch := is_epoch(first / scale):
            about.notes.append(
                f"{column.name} counts {epoch} ({unit}); times are counted from its first row, {first:.6f}."
            )
            return Numbers(np.where(values.present, values.value - first, 0.0), values.present)
    return values


def _continuous(values: Numbers, about: Findings) -> Numbers:
    """Take the leaps out of a clock that was set or ran over."""
    known = values.value[values.present]
    leaps = clock_leaps(known, dated=True)
    about.notes.append(f"The clock leaps {leaps.size} time(s); times are counted on from the row before each leap.")
    elapsed = np.zeros(values.value.size)
    elapsed[values.present] = without_leaps(known, leaps)
    return Numbers(elapsed, values.present)


def _runs(
    raw: RawTable, chosen: Mapping[str, int], columns: Mapping[str, Numbers], given: Entry, about: Findings
) -> tuple[str, ...] | None:
    """Name of each row's run: from the column of runs, or from restarts of the time that the user declares as runs."""
    if (place := chosen.get("run")) is not None:
        return raw.columns[place].words()
    if given.words.get("runs") != "restart":
        return None
    starts = np.zeros(raw.rows, dtype=np.intp)
    starts[raw.restarts] = 1
    if "time" in columns:
        known = np.flatnonzero(columns["time"].present)
        starts[known[1:][np.diff(columns["time"].value[known]) < 0.0]] = 1
    number = np.cumsum(starts) + 1
    about.notes.append(f"{number[-1]} runs: a run begins where the time or the header restarts.")
    return tuple(str(each) for each in number.tolist())


def _codes(runs: Sequence[str]) -> NDArray[np.intp]:
    number: dict[str, int] = {}
    return np.array([number.setdefault(run, len(number)) for run in runs], dtype=np.intp)
