"""Stored table of the benchmark (experiment, judgement and answers), so that a run can be stopped and continued."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.benchmarks.hidden.experiment import Experiment, Row, draw_experiment
from tests.benchmarks.hidden.experiment_files import write
from tests.benchmarks.hidden.oracle import NEAR, Judgement, judge

FORM_SHARE = 0.003
"""Largest share of the simulated chi-square that the catalogue's formula may leave (5 % of the amplitude), or 20."""
TRIES = 40


@dataclass(frozen=True, slots=True, eq=False)
class JudgedTable:
    """A suitable table, and its right answers."""

    experiment: Experiment
    judgement: Judgement
    folder: Path


def fair(row: Row, judgement: Judgement) -> bool:
    """Whether the table suits its row: near the catalogue's formulas, clearly outside, or clearly two effects."""
    if row.foreign:
        return judgement.outside
    if row.hidden == 2 and any(len(names) < 2 for names in judgement.must + judgement.may):
        return False
    if row.hidden and judgement.rival < -NEAR:
        return False
    return judgement.own <= max(20.0, FORM_SHARE * judgement.nothing)


def _written(judgement: Judgement) -> str:
    right = {
        "must": [sorted(names) for names in judgement.must],
        "may": [sorted(names) for names in judgement.may],
        "nothing": judgement.nothing,
        "own": judgement.own,
        "effects": {name: values.tolist() for name, values in judgement.effects.items()},
        "nearest": judgement.nearest,
        "outside": judgement.outside,
        "rival": judgement.rival,
        "run_start": list(judgement.run_start),
    }
    return json.dumps(right, indent=1)


def _read(text: str) -> Judgement:
    right = json.loads(text)
    right["must"] = tuple(frozenset(names) for names in right["must"])
    right["may"] = tuple(frozenset(names) for names in right["may"])
    right["effects"] = {name: np.array(values) for name, values in right["effects"].items()}
    right["run_start"] = tuple(right.get("run_start", ()))
    return Judgement(**right)


def draw_table_of_row(row: Row, seed: int, index: int, folder: Path) -> JudgedTable:
    """Draw, judge and write one table; draw again until the table is suitable. The same seed gives the same table."""
    remembered, right = folder / "attempt.json", folder / "right.json"
    base = (seed * 10_000 + index) * TRIES
    if remembered.exists():
        experiment = draw_experiment(base + json.loads(remembered.read_text())["attempt"], row)
        return JudgedTable(experiment, _read(right.read_text()), folder)
    for attempt in range(TRIES):
        experiment = draw_experiment(base + attempt, row)
        judgement = judge(experiment)
        if fair(row, judgement):
            write(experiment, folder)
            right.write_text(_written(judgement), encoding="utf-8")
            remembered.write_text(json.dumps({"attempt": attempt}), encoding="utf-8")
            return JudgedTable(experiment, judgement, folder)
    raise ValueError(f"Row {row.name} must give a fair table in {TRIES} draws, but seed {seed} index {index} did not.")
