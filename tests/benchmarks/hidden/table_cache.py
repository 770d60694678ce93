"""One table of the benchmark on disk: experiment, judgement and answers, so that a run can be stopped and goes on."""

import json
from dataclasses import dataclass
from pathlib import Path

from tests.benchmarks.hidden.experiment import Experiment, Row, draw_experiment, write
from tests.benchmarks.hidden.oracle import Judgement, judge

FORM_SHARE = 0.003
"""The catalogue's form leaves at most this share of the hidden chi-square (5 % of the amplitude), or 20."""
TRIES = 40


@dataclass(frozen=True, slots=True, eq=False)
class JudgedTable:
    """A table that asks a fair question, and its right answers."""

    experiment: Experiment
    judgement: Judgement
    folder: Path


def fair(row: Row, judgement: Judgement) -> bool:
    """Whether the table asks what its row asks: near the catalogue, or truly outside, or truly two effects."""
    if row.foreign:
        return judgement.outside
    if row.hidden == 2 and all(len(names) < 2 for names in judgement.must):
        return False
    return judgement.own <= max(20.0, FORM_SHARE * judgement.nothing)


def draw_table_of_row(row: Row, seed: int, index: int, folder: Path) -> JudgedTable:
    """Draw, judge and write one table; draws again where the question is not fair. The same seed, the same table."""
    remembered = folder / "attempt.json"
    first = json.loads(remembered.read_text())["attempt"] if remembered.exists() else 0
    for attempt in range(first, TRIES):
        experiment = draw_experiment((seed * 10_000 + index) * TRIES + attempt, row)
        judgement = judge(experiment)
        if fair(row, judgement):
            write(experiment, folder)
            remembered.write_text(json.dumps({"attempt": attempt}), encoding="utf-8")
            right = {
                "must": [sorted(names) for names in judgement.must],
                "may": [sorted(names) for names in judgement.may],
                "nothing": judgement.nothing,
                "own": judgement.own,
                "outside": judgement.outside,
                "parameters": {name: values.tolist() for name, values in judgement.effects.items()},
                "nearest": judgement.nearest,
            }
            (folder / "right.json").write_text(json.dumps(right, indent=1), encoding="utf-8")
            return JudgedTable(experiment, judgement, folder)
    raise ValueError(
        f"Row {row.name} must give a fair table within {TRIES} draws, but seed {seed} index {index} did not."
    )
