"""A measured table: any CSV with `input_mm,gap_mm`, and what else the bench recorded (`gaps.csv` is one)."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError
from fingervision.domain.measured_table import MeasuredTable, RecordedPath
from fingervision.storage.csv_columns import number, read_columns
from fingervision.storage.iso230_table import read_iso230_table
from fingervision.storage.reference_slots import slots_beside
from fingervision.storage.summary_json import u_clock_beside

FEWEST_ROWS = 5
PATH = ("input_mm", "time_s")
# Each run has constants of its own in the fit, whose matrices grow with rows times runs: 1000 runs of 20 000 rows are
# 160 MB, and no bench records more in a day.
MOST_RUNS = 1000
NUMBERS = ("input_mm", "gap_mm", "time_s", "left_mm", "right_mm", "u_gap_mm", "u_random_mm", "force_n")


def read_measured_table(path: Path) -> MeasuredTable:
    """Read a measured table; rows with an input and no gap are its path, rows without an input are left out.

    Raises
    ------
    FingervisionError
        In a sentence: columns missing, cells that are no numbers, fewer than five rows, an input or a gap that
        never changes, times that repeat within a run.
    """
    targets = read_iso230_table(path)
    cells = read_columns(path, ("input_mm", "gap_mm"), (*NUMBERS[2:], "run")) if targets is None else targets.cells()
    values = {
        name: [number(path, name, row, cell) for row, cell in enumerate(cells[name])]
        for name in NUMBERS
        if name in cells
    }
    edges = "left_mm" in values and "right_mm" in values
    needed = [
        "input_mm",
        *(["left_mm", "right_mm"] if edges else ["gap_mm"]),
        *(["time_s"] if "time_s" in values else []),
    ]
    if "time_s" in values and not any(cell is not None for cell in values["time_s"]):
        needed.remove("time_s")
        del values["time_s"]
    total = len(values["input_mm"])
    kept = [row for row in range(total) if all(values[name][row] is not None for name in needed)]
    on_path = [row for row in range(total) if all(values[name][row] is not None for name in needed if name in PATH)]
    on_path = on_path if "time_s" in values else kept
    notes = _left_out(total, len(kept), len(on_path) - len(kept)) if targets is None else list(targets.notes)
    if len(kept) < FEWEST_ROWS:
        raise FingervisionError(
            f"{path} must have at least {FEWEST_ROWS} rows with an input and a gap, but has {len(kept)}: measure more."
        )
    column = {
        name: np.array([values[name][row] for row in kept], dtype=np.float64)
        for name in values
        if all(values[name][row] is not None for row in kept)
    }
    names = [cells["run"][row] for row in kept] if "run" in cells else [""] * len(kept)
    count = len(set(names))
    if count > MOST_RUNS:
        raise FingervisionError(
            f"{path} must have at most {MOST_RUNS} runs, but has {count} in {len(kept)} rows: does the run column "
            "number the rows? Leave it out, or give fewer runs at once."
        )
    time = column.get("time_s")
    if time is not None and "run" not in cells and np.any(np.diff(time) < 0.0):
        notes.append("times run backwards and there is no run column: rows were sorted by time as one run.")
    order, runs, run_names = _runs(column["input_mm"], time, names)
    column = {name: value[order] for name, value in column.items()}
    along = None
    if len(on_path) > len(kept):
        along = _path(values, on_path, set(kept), cells.get("run"), run_names)
    if time is not None:
        times, of_runs = (column["time_s"], runs) if along is None else (along.time_s, along.runs)
        for run, name in zip(of_runs, run_names, strict=True):
            _check_times(times[run], name, path)
    if edges and np.median(column["right_mm"] - column["left_mm"]) < 0.0:
        notes.append("left_mm is larger than right_mm: the two columns were taken as exchanged and swapped back.")
        column["left_mm"], column["right_mm"] = column["right_mm"], column["left_mm"]
    gap = column["right_mm"] - column["left_mm"] if edges else column["gap_mm"]
    for label, signal in (("input_mm", column["input_mm"]), ("gap_mm", gap)):
        if np.ptp(signal) == 0.0:
            raise FingervisionError(
                f"{label} must change, but is {signal[0]:g} in every row of {path}: record a run that moves."
            )
    if len(runs) == 1:
        notes.append("there is one run only: it cannot tell a re-zeroing of the bench from an offset.")
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
        u_clock_s=u_clock_beside(path),
    )


def _left_out(total: int, kept: int, besides: int) -> list[str]:
    """Say how many rows have no value, and what they are good for."""
    notes = []
    if besides:
        notes.append(f"{besides} of {total} rows have an input and no gap: they count as the input's path.")
    if total - kept - besides:
        notes.append(f"{total - kept - besides} of {total} rows have no value and were left out.")
    return notes


def _check_times(time_s: NDArray[np.float64], name: str, path: Path) -> None:
    """Refuse times that repeat within a run."""
    repeated = np.flatnonzero(np.diff(time_s) == 0.0)
    if not repeated.size:
        return
    said = f"time_s must be unique within a run, but {time_s[repeated[0]]:g} s stands "
    said += "in every row" if repeated.size == time_s.size - 1 else "twice"
    whole = bool(np.all(time_s == np.round(time_s)))
    cure = "write the times with more digits" if whole else "add a run column, or remove the repeated rows"
    raise FingervisionError(f"{said} of run {name or '(unnamed)'} of {path}: {cure}.")


def _path(
    values: dict[str, list[float | None]],
    on_path: list[int],
    measured: set[int],
    run_cells: list[str] | None,
    run_names: tuple[str, ...],
) -> RecordedPath:
    """Order all rows that have an input like the measured ones; rows of runs without any gap are left out."""
    rows: list[int] = []
    runs: list[slice] = []
    for name in run_names:
        of_run = [row for row in on_path if (run_cells[row] if run_cells else "") == name]
        of_run.sort(key=lambda row: values["time_s"][row] or 0.0)
        runs.append(slice(len(rows), len(rows) + len(of_run)))
        rows += of_run
    input_mm, time_s = (np.array([values[name][row] for row in rows], dtype=np.float64) for name in PATH)
    with_gap = np.flatnonzero([row in measured for row in rows])
    return RecordedPath(input_mm, time_s, tuple(runs), with_gap)


def _runs(
    inputs: NDArray[np.float64], time: NDArray[np.float64] | None, names: list[str]
) -> tuple[NDArray[np.intp], tuple[slice, ...], tuple[str, ...]]:
    """Order of the rows, runs by their first time (or smallest input), so that no name decides anything."""
    key = inputs if time is None else time
    groups: dict[str, list[int]] = {}
    for row, name in enumerate(names):
        groups.setdefault(name, []).append(row)
    ordered = sorted(groups.items(), key=lambda item: (min(key[item[1]]), float(np.sum(inputs[item[1]]))))
    order: list[int] = []
    runs: list[slice] = []
    for _, rows in ordered:
        runs.append(slice(len(order), len(order) + len(rows)))
        order += sorted(rows, key=lambda row: key[row])
    return np.array(order, dtype=np.intp), tuple(runs), tuple(name for name, _ in ordered)
