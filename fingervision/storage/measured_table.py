"""Reader of measured tables: CSV files with `input_mm,gap_mm` and further recorded columns, such as gaps.csv."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError
from fingervision.domain.field import declared
from fingervision.domain.measured_table import Channel, MeasuredTable, RecordedPath
from fingervision.motion.time_stamps import frame_resolution_s
from fingervision.storage.beside import clock_beside, log_beside, measurement_beside, response_note_beside, slots_beside
from fingervision.storage.csv_columns import Numbers, read_columns
from fingervision.storage.gaps_csv import GapRow

UNITS = ("_mm", "_mrad")
U_PREFIXES = ("u_random_", "u_")
"""Prefixes of columns with standard uncertainties of a channel, in order of preference: the random part if the table
states it, otherwise the total, as with `u_random_mm` and `u_gap_mm` of the gap."""
NO_CHANNELS = ("held_mm", "target_mm", "encoder_mm", "u_force_n")
"""Columns of fingervision's own tables whose names end like those of channels, but that are not channels."""


def channel_names(names: Sequence[str], taken: Collection[str]) -> list[str]:
    """Select from a table's header the names of channels, and of `u_` columns that belong to a channel."""
    found = [
        name
        for name in names
        if name.endswith(UNITS) and not name.startswith("u_") and name not in taken and name not in NO_CHANNELS
    ]
    return [*found, *(f"{u}{name}" for u in U_PREFIXES for name in found if f"{u}{name}" in names)]


def channels_of(values: Mapping[str, Numbers], rows: np.ndarray[tuple[int], np.dtype[np.intp]]) -> dict[str, Channel]:
    """Select given rows of the channels in a given order; `u_` columns without valid uncertainties are omitted."""
    found = {}
    for name, numbers in values.items():
        if name.startswith("u_") or not numbers.present[rows].any():
            continue
        present = numbers.present[rows]
        stated = None
        for u in (values[f"{prefix}{name}"] for prefix in U_PREFIXES if f"{prefix}{name}" in values):
            if u.present[rows][present].all() and np.all(u.value[rows][present] >= 0.0):
                stated = u.value[rows]
                break
        found[name] = Channel(numbers.value[rows], present, stated)
    return found


FEWEST_ROWS = 5
PATH = ("input_mm", "time_s")
# In the fit, each run has its own constants, so that the matrices grow with rows times runs: 1000 runs of 20 000 rows
# need 160 MB, and no test bed records more in a day.
MOST_RUNS = 1000
NUMBERS = ("input_mm", "gap_mm", "time_s", "left_mm", "right_mm", "u_gap_mm", "u_random_mm", "force_n")


def read_measured_table(path: Path, followed: str = "") -> MeasuredTable:
    """Read a measured table; rows with an input but no gap are kept as its path, rows without an input are omitted.

    Parameters
    ----------
    path : Path
        The file.
    followed : str
        Name of a channel that stands for the gap; empty for the gap itself.

    Raises
    ------
    DataError, InputFileError
        A column is missing, a cell is not a number, there are fewer than five rows, the input or the gap never changes,
        or times repeat within a run.
    """
    needed: tuple[str, ...] = (NUMBERS[0], followed) if followed else NUMBERS[:2]
    others: tuple[str, ...] = ("time_s", "force_n") if followed else NUMBERS[2:]
    table = read_columns(path, needed, others, ("run",), lambda names: channel_names(names, NUMBERS))
    values = {name: table.numbers(name) for name in (*needed, *others) if name in table}
    channels: dict[str, Numbers] = {}
    said = []
    for name in channel_names(list(table.columns), NUMBERS):
        try:
            channels[name] = table.numbers(name)
        except DataError as error:
            said.append(f"the column {name} was left out: {error}")
    if followed:
        values["gap_mm"] = values.pop(followed)
        for u in (f"{prefix}{followed}" for prefix in U_PREFIXES):
            if u in channels:
                values.setdefault("u_random_mm", channels[u])
        said.append(
            f"the table or the model has no gap: {followed}, the displacement of a body that moves most, is compared "
            "in its place, and is meant wherever a gap is named; a constant difference from the model may be an error "
            "of the drawing's place in the picture."
        )
    found = measured_rows(path, values, table.texts("run"), said, channels=channels)
    return replace(found, followed=followed)


def measured_rows(
    path: Path,
    values: Mapping[str, Numbers],
    run_cells: Sequence[str] | None,
    said: Sequence[str] = (),
    *,
    count_rows: bool = True,
    channels: Mapping[str, Numbers] = MappingProxyType({}),
) -> MeasuredTable:
    """Build a measured table from columns: sort the rows by run and time, and refuse invalid values.

    Parameters
    ----------
    path : Path
        File of the columns, for error messages.
    values : mapping of str to Numbers
        Columns with the names in `NUMBERS`, all of equal length.
    run_cells : sequence of str, or None
        Name of the run of each row.
    said : sequence of str
        Notes of the reader on the table, one sentence each.
    count_rows : bool
        Whether to add a note on the number of rows without a value.
    channels : mapping of str to Numbers
        User-named columns, and their uncertainty columns `u_`.

    Raises
    ------
    DataError
        For the same reasons as in `read_measured_table`.
    """
    values = dict(values)
    edges = "left_mm" in values and "right_mm" in values
    if "time_s" in values and not values["time_s"].present.any():
        del values["time_s"]
    timed = ["time_s"] if "time_s" in values else []
    needed = ["input_mm", *(["left_mm", "right_mm"] if edges else ["gap_mm"]), *timed]
    total = values["input_mm"].value.size
    is_kept = np.logical_and.reduce([values[name].present for name in needed])
    is_path = np.logical_and.reduce([values[name].present for name in PATH]) if timed else is_kept
    kept, on_path = np.flatnonzero(is_kept), np.flatnonzero(is_path)
    notes = list(said)
    if count_rows:
        notes += _left_out(total, kept.size, on_path.size - kept.size)
    if kept.size < FEWEST_ROWS:
        raise DataError(
            f"{path} must have at least {FEWEST_ROWS} rows with an input and a gap, but has {kept.size}: measure more."
        )
    column = {name: each.value[kept] for name, each in values.items() if each.present[kept].all()}
    _check_limits(column, kept, path)
    names = [run_cells[row] for row in kept.tolist()] if run_cells is not None else [""] * kept.size
    count = len(set(names))
    bound = f"at most {MOST_RUNS} runs" if count > MOST_RUNS else "several rows in a run"
    if count > MOST_RUNS or count == kept.size == on_path.size:
        raise DataError(
            f"{path} must have {bound}, but has {count} runs in {kept.size} rows: does the run column number the rows? "
            f"Leave the run column out{', or compare fewer runs at once' if count > MOST_RUNS else ''}."
        )
    time = column.get("time_s")
    if time is not None and run_cells is None and np.any(np.diff(time) < 0.0):
        notes.append("times run backwards and there is no run column: rows were sorted by time as one run.")
    order, runs, run_names = _runs(column["input_mm"], time, names)
    column = {name: value[order] for name, value in column.items()}
    along = None
    if on_path.size > kept.size:
        of_path = [run_cells[row] for row in on_path.tolist()] if run_cells is not None else [""] * on_path.size
        along = _path(values, on_path, is_kept, of_path, run_names)
    if time is not None:
        times, of_runs = (column["time_s"], runs) if along is None else (along.time_s, along.runs)
        for run, name in zip(of_runs, run_names, strict=True):
            _check_times(times[run], name, path)
    if edges and np.median(column["right_mm"] - column["left_mm"]) < 0.0:
        notes.append(
            "left_mm is larger than right_mm: the two columns were taken as exchanged, and were exchanged back."
        )
        column["left_mm"], column["right_mm"] = column["right_mm"], column["left_mm"]
    gap = column["right_mm"] - column["left_mm"] if edges else column["gap_mm"]
    for label, signal in (("input_mm", column["input_mm"]), ("gap_mm", gap)):
        if np.ptp(signal) == 0.0:
            raise DataError(
                f"{label} must change, but is {signal[0]:g} in every row of {path}: record a run that moves."
            )
    if len(runs) == 1:
        notes.append(
            "there is only one run, in which a re-zeroing of the stage cannot be distinguished from an offset."
        )
    notes += response_note_beside(path)
    return MeasuredTable(
        input_mm=column["input_mm"],
        gap_mm=gap,
        midline_mm=0.5 * (column["left_mm"] + column["right_mm"]) if edges else None,
        time_s=column.get("time_s"),
        runs=runs,
        run_names=run_names,
        u_random_mm=column.get("u_random_mm", column.get("u_gap_mm")),
        force_n=column.get("force_n"),
        notes=tuple(notes),
        slots=slots_beside(path),
        path=along,
        clock=clock_beside(path),
        log=log_beside(path, column.get("time_s"), column["input_mm"], run_names),
        stamp_s=frame_resolution_s(time) if time is not None and measurement_beside(path) else 0.0,
        channels=channels_of(channels, kept[order]),
    )


def _check_limits(column: Mapping[str, NDArray[np.float64]], rows: NDArray[np.intp], path: Path) -> None:
    """Refuse numbers beyond the limits of their column, such as negative standard uncertainties."""
    for each in declared(GapRow):
        if (value := column.get(each.name)) is None:
            continue
        wrong = np.flatnonzero((value < each.field.low) | (value > each.field.high))
        if wrong.size:
            raise DataError(
                f"{each.name} {each.field.refusal(value[wrong[0]])} in data row {rows[wrong[0]] + 1} of {path}: "
                "correct it, or leave the column out."
            )


def _left_out(total: int, kept: int, besides: int) -> list[str]:
    """Sentences on the number of rows without a gap that count as path, and of rows that are omitted."""
    notes = []
    if besides:
        notes.append(
            f"{besides} of {total} rows have an input but no gap: they are used as part of the path of the input."
        )
    if total - kept - besides:
        notes.append(f"{total - kept - besides} of {total} rows have no value and were left out.")
    return notes


def _check_times(time_s: NDArray[np.float64], name: str, path: Path) -> None:
    """Refuse times that repeat within a run."""
    repeated = np.flatnonzero(np.diff(time_s) == 0.0)
    if not repeated.size:
        return
    said = f"time_s must be unique within a run, but {time_s[repeated[0]]:g} s occurs "
    said += "in every row" if repeated.size == time_s.size - 1 else "twice"
    whole = bool(np.all(time_s == np.round(time_s)))
    cure = "write the times with more digits" if whole else "add a run column, or remove the repeated rows"
    raise DataError(f"{said} in run {name or '(unnamed)'} of {path}: {cure}.")


def _by_run(names: Sequence[str], key: NDArray[np.float64]) -> dict[str, NDArray[np.intp]]:
    """Row numbers of each run, sorted by a key; runs are in order of their first appearance."""
    number: dict[str, int] = {}
    codes = np.array([number.setdefault(name, len(number)) for name in names], dtype=np.intp)
    order = np.lexsort((key, codes))
    ends = np.cumsum(np.bincount(codes))[:-1]
    return dict(zip(number, np.split(order, ends), strict=True))


def _path(
    values: Mapping[str, Numbers],
    on_path: NDArray[np.intp],
    is_kept: NDArray[np.bool_],
    names: Sequence[str],
    run_names: tuple[str, ...],
) -> RecordedPath:
    """Sort all rows with an input in the same way as the rows with a gap; runs without a gap are omitted."""
    of_run = _by_run(names, values["time_s"].value[on_path])
    rows = np.concatenate([on_path[of_run[name]] for name in run_names])
    ends = np.cumsum([of_run[name].size for name in run_names])
    runs = tuple(slice(int(end) - of_run[name].size, int(end)) for end, name in zip(ends, run_names, strict=True))
    input_mm, time_s = (values[name].value[rows] for name in PATH)
    return RecordedPath(input_mm, time_s, runs, np.flatnonzero(is_kept[rows]))


def _runs(
    inputs: NDArray[np.float64], time: NDArray[np.float64] | None, names: Sequence[str]
) -> tuple[NDArray[np.intp], tuple[slice, ...], tuple[str, ...]]:
    """Order of the rows; runs are sorted by their first time (or smallest input), then as they stand in the file."""
    key = inputs if time is None else time
    # Each group is sorted by its key, so that its first row has the smallest key.
    groups = sorted(_by_run(names, key).items(), key=lambda item: (key[item[1][0]], int(np.min(item[1]))))
    ends = np.cumsum([rows.size for _, rows in groups])
    runs = tuple(slice(int(end) - rows.size, int(end)) for end, (_, rows) in zip(ends, groups, strict=True))
    return np.concatenate([rows for _, rows in groups]), runs, tuple(name for name, _ in groups)
