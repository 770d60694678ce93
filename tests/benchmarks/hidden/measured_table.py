"""The measured table for other methods: recorded inputs and edges, read from the file only."""

import csv
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.hidden.catalogue_chain import Samples

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredTable:
    """Samples with recorded input, gap, midline and force (zero if there is none)."""

    at: Samples
    gap_mm: Array
    midline_mm: Array
    force_n: Array
    time_restarts: bool
    has_force: bool


def _columns(path: Path) -> dict[str, list[str]]:
    with path.open(encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    return {key: [row[key] for row in rows] for key in rows[0]}


def read_measured(path: Path) -> MeasuredTable:
    """Read a measured.csv of this benchmark."""
    columns = _columns(path)
    runs = columns.pop("run")
    number = {key: np.array(values, dtype=float) for key, values in columns.items()}
    starts = np.array([0] + [i for i in range(1, len(runs)) if runs[i] != runs[i - 1]] + [len(runs)])
    time = number["time_s"]
    run_time = np.concatenate([time[a:b] - time[a] for a, b in pairwise(starts)])
    at = Samples(number["input_mm"], run_time, time, starts.astype(np.int64))
    left, right = number["left_mm"], number["right_mm"]
    force = number.get("force_n", np.zeros_like(left))
    restarts = len(starts) > 2 and bool(time[starts[1]] < time[starts[1] - 1])
    return MeasuredTable(at, right - left, (left + right) / 2, force, restarts, "force_n" in number)
