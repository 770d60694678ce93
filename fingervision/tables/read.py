"""Entry points for reading any table as a measured table, a drive table or a simulation table."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import DataError
from fingervision.domain.measured_table import MeasuredTable
from fingervision.models.corrected import CorrectedModel
from fingervision.models.table import TableModel
from fingervision.storage import drive_csv, measured_table, model_toml, simulation_table
from fingervision.storage.csv_columns import Numbers
from fingervision.tables.column_choice import CANONICAL
from fingervision.tables.formats import read_raw
from fingervision.tables.iso230 import iso230_rows_of
from fingervision.tables.mapping import Entry, entry_for
from fingervision.tables.own_format import is_own
from fingervision.tables.questions import OpenQuestionError, Question
from fingervision.tables.understanding import Understood, understand

TEXT_ENDINGS = ("", ".asc", ".csv", ".dat", ".log", ".lvm", ".out", ".prn", ".tab", ".tsv", ".txt")
TABLE_ENDINGS = frozenset((*TEXT_ENDINGS, ".mat", ".parquet", ".tdms", ".xls", ".xlsm", ".xlsx"))
"""File suffixes of tables; a file with another suffix that cannot be read as a table was probably named by mistake."""


def read_measured_table(path: Path, columns: Path | None = None, followed: str = "") -> MeasuredTable:
    """Read a measured table in any format.

    Parameters
    ----------
    path : Path
        The table.
    columns : Path or None
        A columns.toml; None for that beside the table, if any.
    followed : str
        Name of a channel that stands for the gap (`followed_channel`); empty for the gap itself.

    Raises
    ------
    DataError, InputFileError
        The table cannot be read, or its content cannot be used.
    OpenQuestionError
        The table can be interpreted in more than one way.
    """
    given = entry_for(path, "measured", columns)
    if followed or is_own(path, "measured", given):
        return measured_table.read_measured_table(path, followed)
    raw = read_raw(path, given)
    targets = iso230_rows_of(raw, given)
    if targets is not None:
        return targets.table(path, said(given, raw.what, raw.notes, raw.left_out))
    table = understand(raw, "measured", given).decided()
    values = {CANONICAL[role]: numbers for role, numbers in table.columns.items()}
    if "gap_mm" not in values:
        left, right = values["left_mm"], values["right_mm"]
        both = left.present & right.present
        values["gap_mm"] = Numbers(np.where(both, right.value - left.value, 0.0), both)
    return measured_table.measured_rows(path, values, table.runs, _said(table, given), channels=table.channels.columns)


def read_drive(path: Path, columns: Path | None = None) -> DriveHistory:
    """Read a drive table in any format.

    Parameters
    ----------
    path : Path
        The table.
    columns : Path or None
        A columns.toml; None for that beside the table, if any.

    Raises
    ------
    DataError, InputFileError
        The table cannot be read, or its content cannot be used.
    OpenQuestionError
        The table can be interpreted in more than one way.
    """
    given = entry_for(path, "drive", columns)
    if is_own(path, "drive", given):
        return drive_csv.read_drive(path)
    return drive_of(understand(read_raw(path, given), "drive", given).decided(), given)


def drive_of(table: Understood, given: Entry) -> DriveHistory:
    """Build a drive history from an interpreted table."""
    path = table.path
    kept = np.flatnonzero(table.columns["time"].present & table.columns["input"].present)
    if not kept.size:
        raise DataError(f"{path} must have at least one row with a time and an input, but has none.")
    if "backward_time" in given.accept:
        kept = kept[np.argsort(table.columns["time"].value[kept], kind="stable")]
    steps = np.diff(table.columns["time"].value[kept])
    repeated = np.flatnonzero(steps == 0.0)
    if repeated.size:
        if "repeated_time" not in given.accept:
            at = int(kept[repeated[0] + 1])
            raise OpenQuestionError(
                path,
                "drive",
                [
                    Question(
                        f"{repeated.size} rows repeat the time of the row before (the first is {table.raw.place(at)}); "
                        "accept=repeated_time keeps the first of each",
                        "accept=repeated_time",
                    )
                ],
            )
        kept = kept[np.concatenate([[True], steps > 0.0])]
    force = table.columns.get("force")
    values = {"time_s": table.columns["time"].value[kept], "input_mm": table.columns["input"].value[kept]}
    if force is not None and force.present[kept].all():
        values["force_n"] = force.value[kept]
    runs = None if table.runs is None else tuple(table.runs[row] for row in kept.tolist())
    lines = [table.raw.lines[row] for row in kept.tolist()] if len(table.raw.lines) else (kept + 1).tolist()
    return drive_csv.drive_rows(path, values, runs, lines)


def read_simulation_table(path: Path, columns: Path | None = None) -> TableModel:
    """Read a simulation table in any format as a model.

    Parameters
    ----------
    path : Path
        The table.
    columns : Path or None
        A columns.toml; None for that beside the table, if any.

    Raises
    ------
    DataError, InputFileError
        The table cannot be read, or its content cannot be used.
    OpenQuestionError
        The table can be interpreted in more than one way.
    """
    given = entry_for(path, "simulation", columns)
    if is_own(path, "simulation", given):
        return simulation_table.read_simulation_table(path)
    table = understand(read_raw(path, given), "simulation", given).decided()
    needed = [
        "input",
        *(["gap"] if "gap" in table.columns else []),
        *(s for s in ("left", "right") if s in table.columns),
    ]
    kept = np.logical_and.reduce([table.columns[role].present for role in needed])
    values = {
        CANONICAL[role]: Numbers.whole(numbers.value[kept])
        for role, numbers in table.columns.items()
        if role in needed or bool(numbers.present[kept].all())
    }
    if "gap_mm" not in values:
        values["gap_mm"] = Numbers.whole(values["right_mm"].value - values["left_mm"].value)
    return simulation_table.simulation_rows(path, values)


def _table_or_no_model(path: Path, columns: Path | None) -> TableModel:
    """Read a simulation table; for a file that is not named like a table, the error states what a model file is."""
    try:
        return read_simulation_table(path, columns)
    except OpenQuestionError:
        raise
    except DataError as error:
        if path.is_dir() or path.suffix.lower() in TABLE_ENDINGS:
            raise
        raise DataError(
            f"{path} is not a model: name a simulation table, a gripper.toml, mechanism.toml or model.toml, an FMU, or "
            "a Python file with simulate(time_s, input_mm)."
        ) from error


def read_model(path: Path, kind: str = "lumped", columns: Path | None = None, followed: str = "") -> CorrectedModel:
    """Read a model: a simulation table in any format, a gripper drawing, or a corrected model.

    Parameters
    ----------
    path : Path
        The file.
    kind : str
        Kind of model that is built from a gripper drawing.
    columns : Path or None
        A columns.toml for simulation tables; None for that beside the table, if any.
    followed : str
        Name of a channel that stands for the gap (`followed_channel`); empty for the gap itself.

    Raises
    ------
    DataError, InputFileError, ModelError, UsageError
        For the same reasons as in `storage.model_toml.read_model` and `read_simulation_table`.
    """
    reader: Callable[[Path], TableModel] = partial(_table_or_no_model, columns=columns)
    if followed:
        reader = partial(simulation_table.read_simulation_table, followed=followed)
    return model_toml.read_model(path, kind, table=reader, followed=followed)


def _said(table: Understood, given: Entry) -> list[str]:
    roles = ", ".join(f"{each.role} = '{each.name}'" + (f" [{each.unit}]" if each.unit else "") for each in table.taken)
    beside = ", ".join(f"{name} = '{text}'" for name, text in table.channels.names.items())
    channels = [f"Channels: {beside}."] if beside else []
    return [*said(given, table.raw.what, table.notes, table.left_out), f"Columns: {roles}.", *channels]


def said(given: Entry, what: str, notes: tuple[str, ...], left_out: tuple[str, ...]) -> list[str]:
    """Sentence on how a table of another program was interpreted."""
    how = f" with {given.source}" if given.source is not None else ""
    return [f"Read as {what}{how}.", *notes, *(f"Left out: {words}." for words in left_out)]
