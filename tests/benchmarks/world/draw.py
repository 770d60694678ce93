"""Simulate tables that resemble those of other set-ups.

    python -m tests.benchmarks.world.draw --seed 7 --tables 6 --rows iso_cycles,sparse --out results/world

For each table, a folder ROW_INDEX with measured.csv, simulation.csv and truth.json is written; the same seed gives the
same files.
"""

import time
from pathlib import Path

import numpy as np

from tests.benchmarks.frame import Namespace, benchmark, listed
from tests.benchmarks.world.folder import write
from tests.benchmarks.world.nearest import Judge
from tests.benchmarks.world.rig import Rig
from tests.benchmarks.world.right_answers import FAR, RightAnswers, outside_enough, right_answers
from tests.benchmarks.world.rows.catalogue import ENCODER_KINDS, ROWS

TRIES = 30
FORM_SHARE = 0.01
"""Largest share of the simulated chi-square that the catalogue's formula may leave (10 % of the amplitude), or 20;
otherwise a table is drawn again."""


def fair(rig: Rig, right: RightAnswers, judge: Judge) -> bool:
    """Whether the table suits its row: its true effects are near the catalogue's formulas, or clearly outside."""
    if rig.wrong_sign:
        return right.nothing > FAR
    if rig.outside:
        return outside_enough(rig, judge)
    return right.own <= max(FAR, FORM_SHARE * right.nothing)


def drawn(row: str, seed: int, index: int, attempt: int) -> Rig:
    """Simulate one table; the same arguments give the same table."""
    return (ROWS | ENCODER_KINDS)[row](np.random.default_rng([seed, index, attempt, *row.encode()]))


def draw_judged(row: str, seed: int, index: int) -> tuple[Rig, Judge, RightAnswers, dict[str, object]]:
    """Draw one table of a row with its right answers; draw again until the table is suitable (`fair`)."""
    for attempt in range(TRIES):
        rig = drawn(row, seed, index, attempt)
        right, judge = right_answers(rig)
        if fair(rig, right, judge):
            return rig, judge, right, {"row": row, "seed": seed, "index": index, "attempt": attempt}
    raise ValueError(f"Row {row} must give a fair table in {TRIES} draws, but seed {seed} index {index} did not.")


def draw_table(row: str, seed: int, index: int, out: Path) -> Path:
    """Draw and write one table, unless it exists."""
    folder = out / f"{row}_{index}"
    if not (folder / "truth.json").exists():
        write(*draw_judged(row, seed, index), folder)
    return folder


@benchmark(
    seed=1,
    tables={"type": int, "default": 6, "help": "tables a row"},
    rows={**listed([*ROWS, *ENCODER_KINDS]), "default": list(ROWS)},
    out={"type": Path, "required": True},
)
def main(chosen: Namespace) -> None:
    """Read the options, and write the folders."""
    for row in chosen.rows:
        begun = time.perf_counter()
        for index in range(chosen.tables):
            draw_table(row, chosen.seed, index, chosen.out)
        print(f"{row}: {chosen.tables} tables, {time.perf_counter() - begun:.0f} s", flush=True)
