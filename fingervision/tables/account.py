"""Report on how a table was interpreted, as text, as JSON, and as an entry of columns.toml."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError
from fingervision.storage.csv_columns import Numbers
from fingervision.tables.body_channels import BodyChannels
from fingervision.tables.column_choice import CANONICAL, NEEDED
from fingervision.tables.formats import read_raw
from fingervision.tables.iso230 import iso230_rows_of
from fingervision.tables.mapping import KINDS, Entry
from fingervision.tables.own_format import is_own
from fingervision.tables.questions import OpenQuestionError
from fingervision.tables.raw_table import RawTable
from fingervision.tables.read import drive_of, read_drive, read_measured_table, read_simulation_table
from fingervision.tables.understanding import Taken, Understood, understand
from fingervision.tables.units import CANONICAL as CANONICAL_UNIT
from fingervision.tables.units import DIMENSION, column_name

RANGE_UNIT = {role: CANONICAL_UNIT[dimension] for role, dimension in DIMENSION.items()}
"""Unit in which the range of a column is stated: the unit after conversion, not that of the file."""


@dataclass(frozen=True, slots=True, eq=False)
class Account:
    """Report on the interpretation of a table.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        `measured`, `drive` or `simulation`.
    what : str
        Description of file format and dialect.
    own : bool
        Whether the table is in fingervision's own format, which needs no columns.toml.
    taken : tuple of Taken
        Columns to which a role was assigned.
    unused : tuple of str
        Names of the columns without a role.
    columns : mapping of str to Numbers
        Values of the columns by role, in mm, s and N.
    rows : int
        Number of rows in the file.
    rate_hz : float or None
        Median sampling rate of the rows that have a time.
    left_out, notes : tuple of str
        Omissions with their reasons; assumptions that were made.
    question : OpenQuestionError or FingervisionError, or None
        Reason why the table cannot be read yet; None if it can.
    entry : Entry
        Entry of columns.toml that describes this interpretation.
    channels : BodyChannels
        User-named channels.
    also : str
        Another kind of table as which the file can be interpreted in the same way; empty if there is none.
    """

    path: Path
    kind: str
    what: str
    own: bool
    taken: tuple[Taken, ...]
    unused: tuple[str, ...]
    columns: Mapping[str, Numbers]
    rows: int
    rate_hz: float | None
    left_out: tuple[str, ...]
    notes: tuple[str, ...]
    question: FingervisionError | None
    entry: Entry
    channels: BodyChannels = field(default_factory=BodyChannels)
    also: str = ""

    def curve(self) -> tuple[str, NDArray[np.float64], str, NDArray[np.float64]] | None:
        """Return the curve to plot: gap over input, or input over time; None if there are too few data."""
        names = ("input", "gap") if "gap" in self.columns else ("time", "input")
        if not all(name in self.columns for name in names):
            return None
        x, y = (self.columns[name] for name in names)
        both = x.present & y.present
        if np.count_nonzero(both) < 2:
            return None
        return CANONICAL[names[0]], x.value[both], CANONICAL[names[1]], y.value[both]

    def document(self) -> dict[str, Any]:
        """Return the report as a mapping for JSON."""
        ranges = {
            role: [float(each.value[each.present].min()), float(each.value[each.present].max())]
            for role, each in self.columns.items()
            if each.present.any()
        }
        return {
            "schema": 1,
            "file": str(self.path),
            "kind": self.kind,
            "also": self.also,
            "format": self.what,
            "own_format": self.own,
            "rows": self.rows,
            "rate_hz": self.rate_hz,
            "columns": [
                {
                    "name": each.name,
                    "role": each.role,
                    "unit": each.unit,
                    "read_as": CANONICAL.get(each.role, each.role),
                    "range": ranges.get(each.role),
                    "range_unit": RANGE_UNIT.get(each.role, ""),
                    "missing": int(np.sum(~self.columns[each.role].present)) if each.role in self.columns else None,
                }
                for each in self.taken
            ],
            "channels": [
                {"name": text, "read_as": name, "missing": int(np.sum(~self.channels.columns[name].present))}
                for name, text in self.channels.names.items()
            ],
            "unused": list(self.unused),
            "left_out": list(self.left_out),
            "notes": list(self.notes),
            "open": [
                {
                    "words": each.words,
                    "key": each.key,
                    "readings": [{"key": one.key, "gives": one.gives} for one in each.readings],
                }
                for each in (self.question.questions if isinstance(self.question, OpenQuestionError) else ())
            ],
            "error": None if self.question is None else str(self.question),
        }


def account(path: Path, kind: str | None, given: Mapping[str, Entry]) -> Account:
    """Interpret a table as a given kind of table, or as the kind for which the fewest questions remain.

    Parameters
    ----------
    path : Path
        The table.
    kind : str or None
        `measured`, `drive` or `simulation`; None if the kind is to be recognised.
    given : mapping of str to Entry
        Decisions of the user, by kind of table.

    Raises
    ------
    DataError, InputFileError, OpenQuestionError
        The file cannot be read as a table of any kind.
    """
    kinds = KINDS if kind is None else (kind,)
    if not path.is_file():
        read_raw(path, Entry())  # raises an error with the reason
    for each in kinds:
        if is_own(path, each, given[each]):
            return _own(path, each)
    raws = {each: read_raw(path, given[each]) for each in kinds}
    if "measured" in kinds and (found := _targets(raws["measured"], given["measured"])) is not None:
        return found
    understood = {each: understand(raws[each], each, given[each]) for each in kinds}
    best = min(kinds, key=lambda each: (_open_columns(understood[each]), KINDS.index(each)))
    also = "simulation" if kind is None and best == "measured" and _same_as_simulation(understood) else ""
    return _account(understood[best], given[best], raws[best], also)


def _same_as_simulation(understood: Mapping[str, Understood]) -> bool:
    """Whether a table can be a measurement as well as a simulation: it holds the gap over the input, without times."""
    measured, simulation = understood["measured"], understood["simulation"]
    return (
        measured.runs is None
        and set(measured.taken) == set(simulation.taken)
        and [each.key for each in measured.questions] == [each.key for each in simulation.questions]
    )


def _open_columns(table: Understood) -> int:
    """Number of columns whose role or unit is unresolved; a missing required column counts twice."""
    missing = sum(question.key.startswith("columns.") for question in table.questions)
    missing += sum(bool(question.missing) for question in table.questions)
    # A column that is named after a simulation program contains no measurement.
    sources = [column_name(each.name).source for each in table.taken if each.role == "gap"]
    return missing + sum(source not in (None, table.kind) for source in sources)


def _account(table: Understood, given: Entry, raw: RawTable, also: str) -> Account:
    question: FingervisionError | None = None
    try:
        # Questions that arise for both kinds of table are answered once, for both kinds.
        (replace(table, kind="table") if also else table).decided()
        if table.kind == "drive":
            drive_of(table, given)
    except FingervisionError as error:
        question = error
    used = {each.name for each in table.taken} | set(table.channels.names.values())
    return Account(
        raw.path,
        table.kind,
        raw.what,
        own=False,
        taken=table.taken,
        unused=tuple(column.name for column in raw.columns if column.name not in used),
        columns=table.columns,
        rows=raw.rows,
        rate_hz=_rate(table.columns.get("time")),
        left_out=table.left_out,
        notes=table.notes,
        question=question,
        entry=_entry(table.taken, given, raw),
        channels=table.channels,
        also=also,
    )


def _entry(taken: tuple[Taken, ...], given: Entry, raw: RawTable) -> Entry:
    """Entry for columns.toml that states everything that was recognised."""
    names = [column.name for column in raw.columns]
    columns = {
        each.role: given.columns.get(each.role)
        or (each.name if names.count(each.name) == 1 else str(names.index(each.name) + 1))
        for each in taken
    }
    # Units that the table itself states are not written to columns.toml, so that the next call doubts them in the same
    # way.
    line = 0 if not raw.named and "header_line" in raw.settings else given.header_line
    return replace(given, columns=columns, words={**_dialect(raw), **given.words}, header_line=line)


def _dialect(raw: RawTable) -> dict[str, str]:
    """Keys of columns.toml for the recognised text format, or for the selected part of a file."""
    return {key: str(raw.settings[key]) for key in ("separator", "decimal", "part") if key in raw.settings}


def _rate(time: Numbers | None) -> float | None:
    """Median sampling rate of the rows (Hz)."""
    if time is None:
        return None
    steps = np.diff(time.value[time.present])
    steps = steps[steps > 0.0]
    return float(1.0 / np.median(steps)) if steps.size else None


def _targets(raw: RawTable, given: Entry) -> Account | None:
    """Report on a table of targets, cycles and directions; None for any other table."""
    question = None
    try:
        rows = iso230_rows_of(raw, given)
    except FingervisionError as error:
        rows, question = None, error
    if rows is None and question is None:
        return None
    with_gap = [] if rows is None else [row for row in rows.rows if row.position_mm is not None]
    columns = {
        "input": Numbers.whole(np.array([row.target_mm for row in with_gap])),
        "gap": Numbers.whole(np.array([row.position_mm for row in with_gap], dtype=np.float64)),
    }
    return Account(
        raw.path, "measured", f"{raw.what}, a table of targets, cycles and directions (ISO 230-2)", own=False, taken=(),
        unused=(), columns=columns if with_gap else {}, rows=raw.rows, rate_hz=None, left_out=raw.left_out,
        notes=(*raw.notes, *(() if rows is None else rows.notes)), question=question,
        entry=replace(given, words={**_dialect(raw), **given.words}),
    )  # fmt: skip


def _own(path: Path, kind: str) -> Account:
    """Report on a table in fingervision's own format, which is read literally."""
    question = None
    notes: tuple[str, ...] = ()
    columns: dict[str, Numbers] = {}
    try:
        if kind == "drive":
            drive = read_drive(path)
            columns = {"time": Numbers.whole(drive.time_s), "input": Numbers.whole(drive.input_mm)}
        elif kind == "measured":
            table = read_measured_table(path)
            columns = {"input": Numbers.whole(table.input_mm), "gap": Numbers.whole(table.gap_mm)}
            if table.time_s is not None:
                columns["time"] = Numbers.whole(table.time_s)
            notes = table.notes
        else:
            model = read_simulation_table(path)
            inputs = np.linspace(*model.input_range_mm, 200)
            columns = {"input": Numbers.whole(inputs), "gap": Numbers.whole(model.respond(inputs).gap_mm)}
    except FingervisionError as error:
        question = error
    roles = [role for role in (*NEEDED[kind], "time") if role in columns]
    taken = tuple(Taken(CANONICAL[role], role, CANONICAL[role].rsplit("_", 1)[1]) for role in dict.fromkeys(roles))
    rows = max((each.value.size for each in columns.values()), default=0)
    what = f"the project's own format, by its columns {', '.join(t.name for t in taken)}"
    return Account(
        path, kind, what, own=True, taken=taken, unused=(), columns=columns, rows=rows,
        rate_hz=_rate(columns.get("time")), left_out=(), notes=notes, question=question, entry=Entry(),
    )  # fmt: skip


WIDE, HIGH = 56, 10
"""Width and height of the plot in characters; a braille character has two by four dots."""
DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
EMPTY = 0x2800
FINEST = 1e-12
FEW, JOINED = 2000, 20_000


def terminal_plot(
    x_name: str, x: NDArray[np.float64], y_name: str, y: NDArray[np.float64], *, plain: bool = False
) -> list[str]:
    """Plot points in a grid of characters.

    Parameters
    ----------
    x_name, y_name : str
        Labels of the axes.
    x, y : ndarray of float, shape (n,)
        Coordinates of the points, n at least 1.
    plain : bool
        Whether to use asterisks instead of braille characters, for terminals without Unicode.
    """
    top, bottom = f"{np.max(y):.4g}", f"{np.min(y):.4g}"
    left, right = f"{np.min(x):.4g}", f"{np.max(x):.4g}"
    if x.size <= FEW:
        # If there are few points, they are joined by lines, so that the curve is visible.
        at = np.linspace(0.0, x.size - 1.0, JOINED)
        x, y = (np.interp(at, np.arange(x.size), values) for values in (x, y))
    columns, rows = (WIDE, HIGH) if plain else (2 * WIDE, 4 * HIGH)
    across = _place(x, columns)
    down = rows - 1 - _place(y, rows)
    if plain:
        marks = np.full((HIGH, WIDE), " ")
        marks[down, across] = "*"
        lines = ["".join(row) for row in marks]
    else:
        codes = np.full((HIGH, WIDE), EMPTY)
        np.bitwise_or.at(codes, (down // 4, across // 2), DOTS[down % 4, across % 2])
        lines = ["".join(map(chr, row)) for row in codes]
    margin = max(len(top), len(bottom), 4)
    labels = [top, *[""] * (HIGH - 2), bottom]
    drawn = [f"{label:>{margin}} |{line}" for label, line in zip(labels, lines, strict=True)]
    middle = x_name.center(WIDE - len(left) - len(right))
    return [f"{'':>{margin}} {y_name}", *drawn, f"{'':>{margin}}  {left}{middle}{right}"]


def _place(values: NDArray[np.float64], cells: int) -> NDArray[np.intp]:
    span = float(np.ptp(values))
    if span < FINEST:
        return np.full(values.size, cells // 2)
    places: NDArray[np.intp] = np.minimum(((values - values.min()) / span * cells).astype(np.intp), cells - 1)
    return places
