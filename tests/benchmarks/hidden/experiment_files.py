"""Files of an experiment: the input files of a diagnosis, and the truth."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.hidden.experiment import Experiment, first_columns

Array = NDArray[np.float64]


def write_table(experiment: Experiment, columns: dict[str, list[Array]], folder: Path) -> None:
    """Write measured.csv and simulation.csv."""
    folder.mkdir(parents=True, exist_ok=True)
    with_force = experiment.plant.table.force_n is not None
    header = ["run", "time_s", "input_mm", "gap_mm", "left_mm", "right_mm"] + ["force_n"] * with_force
    lines = [",".join(header)]
    for k in range(len(columns["time_s"])):
        left, right = columns["left_mm"][k], columns["right_mm"][k]
        values = [columns["time_s"][k], columns["input_mm"][k], right - left, left, right]
        values += [columns["force_n"][k]] * with_force
        lines += [f"run{k + 1}," + ",".join(f"{v:.9g}" for v in row) for row in zip(*values, strict=True)]
    (folder / "measured.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    experiment.plant.table.write(folder / "simulation.csv")


def write(experiment: Experiment, folder: Path) -> None:
    """Write measured.csv, simulation.csv and truth.json."""
    write_table(experiment, first_columns(experiment), folder)
    truth = {
        "hidden": [asdict(h) for h in experiment.plant.hidden],
        "foreign": asdict(experiment.plant.foreign) if experiment.plant.foreign else None,
        "snr": experiment.snr,
        "design": experiment.design.kind,
        "runs": len(experiment.design.motions),
        "rate_hz": experiment.design.rate_hz,
        "time_restarts": experiment.design.time_restarts,
        "run_start": experiment.plant.run_start,
        "noise": asdict(experiment.noise),
    }
    (folder / "truth.json").write_text(json.dumps(truth, indent=1), encoding="utf-8")
