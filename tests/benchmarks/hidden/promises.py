"""Proposed next runs after a poor first run: predicted gain, actual gain, and final diagnosis.

    python -m tests.benchmarks.hidden.promises --tables 40 --seed 1 [--out DIR]

For every poor table of one simulated effect with an ambiguous answer, the proposed run is simulated. Printed are the
predicted and the actual gain (`next_run_gain`), and the diagnosis of both runs together. If no run was proposed, or the
answer remains ambiguous, the benchmark tests whether any of its own motions would have separated the truth from the
other explanations. Seeds below 1000 are for development, seeds from 2000 on for results.
"""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.frame import Namespace, benchmark
from tests.benchmarks.hidden.binomial import Rate
from tests.benchmarks.hidden.catalogue_chain import respond
from tests.benchmarks.hidden.diagnose_adapter import Answer, diagnose
from tests.benchmarks.hidden.experiment_files import write_table
from tests.benchmarks.hidden.explanations import known_effects, problem_of
from tests.benchmarks.hidden.fit import fit
from tests.benchmarks.hidden.motion import Motion, hold, staircase, triangle
from tests.benchmarks.hidden.next_run_gain import Gain, gain_that_came, with_second
from tests.benchmarks.hidden.recipe import NotDrivenError, drive, drive_recipe
from tests.benchmarks.hidden.rows import ROWS
from tests.benchmarks.hidden.table_cache import JudgedTable, draw_table_of_row

Array = NDArray[np.float64]
APART = 16.0
"""Distance above which a motion counts as able to resolve a set: 9, plus an allowance for noise."""


@dataclass(frozen=True, slots=True)
class Followed:
    """A poor table and its proposed second run.

    Parameters
    ----------
    first, then : Answer
        Answers for the first run and for both runs together; the second is None if no run was possible.
    gain : Gain or None
        Predicted and actual gain, if the truth was one of the two explanations to be separated.
    why : str
        Reason why no run was simulated; empty otherwise.
    """

    hidden: str
    first: Answer
    then: Answer | None
    gain: Gain | None
    why: str

    @property
    def settled(self) -> bool:
        """Whether the diagnosis of both runs names the truth only."""
        return self.then is not None and self.then.verdict == "named" and self.then.sets == (frozenset({self.hidden}),)


def followed(table: JudgedTable) -> Followed | None:
    """Diagnose, simulate the proposed run, and diagnose both; None if the first answer is not ambiguous."""
    (hidden,) = (h.name for h in table.experiment.plant.hidden)
    first = diagnose(table.folder)
    if first.verdict != "ambiguous":
        return None
    proposal = first.report["next_run"]
    if proposal is None:
        return Followed(hidden, first, None, None, "nothing proposed")
    recipe = table.folder / "diagnosis" / proposal["recipe"]
    try:
        traces = drive_recipe(table.experiment, recipe)
    except NotDrivenError as reason:
        return Followed(hidden, first, None, None, str(reason))
    folder = table.folder / "second"
    write_table(table.experiment, with_second(table.experiment, traces), folder)
    return Followed(hidden, first, diagnose(folder), gain_that_came(table, first), "")


def motions_of_the_judge(low_mm: float, high_mm: float) -> list[Motion]:
    """Runs that any test bed can execute, of up to five minutes."""
    low, high = low_mm + 0.03 * (high_mm - low_mm), high_mm - 0.03 * (high_mm - low_mm)
    way = high - low
    strokes = [triangle(low, high, way / seconds, cycles) for seconds, cycles in ((4.0, 30), (20.0, 8), (8.0, 5))]
    stairs = staircase(low, high, 6, 5.0, way / 10.0).then(staircase(high, low, 6, 5.0, way / 10.0))
    held = triangle(low, high, way / 4.0, 3).then(hold(high, 120.0)).then(hold(low, 120.0))
    small = triangle(low + 0.45 * way, low + 0.55 * way, 0.1 * way / 4.0, 20)
    return [*strokes, stairs, held, small]


def could_be_settled(table: JudgedTable, answer: Answer) -> bool:
    """Whether one of the benchmark's motions, after the first run, separates the truth from the rest of the set."""
    experiment = table.experiment
    own = frozenset(h.name for h in experiment.plant.hidden)
    inputs = experiment.plant.inputs
    nearest: dict[frozenset[str], list[Array]] = {}
    for motion in motions_of_the_judge(inputs.lower_mm, inputs.upper_mm):
        traces = [*experiment.traces(), *drive(experiment, [motion])]
        problem = problem_of(experiment, traces, known_input=False)
        known = known_effects(experiment, problem)
        truth = respond(problem.model, problem.at, table.judgement.effects)
        apart = np.inf
        for names in (s for s in answer.sets if s != own):
            chosen = [c for c in known if c.name in names]
            if len(chosen) < len(names):
                continue
            begins = [[c.starts[k * (len(c.starts) - 1) // 3] for c in chosen] for k in range(4)]
            if names in nearest:
                begins.append(nearest[names])
            best = min((fit(problem, truth, chosen, begin, 60) for begin in begins), key=lambda found: found.distance)
            nearest[names] = [best.effects[c.name] for c in chosen]
            apart = min(apart, best.distance)
            if apart < APART:
                break
        if apart >= APART:
            return True
    return False


def line_of(index: int, case: Followed) -> str:
    """Text line for one case."""
    sets = ",".join("+".join(sorted(s)) for s in case.first.sets)
    there = frozenset({case.hidden}) in case.first.sets
    words = f"{index:4d} {case.hidden}{'' if there else ' (NOT IN SET)'} of {len(case.first.sets)} [{sets}]"
    proposal = case.first.report["next_run"]
    if proposal:
        promised = proposal["promised"]
        words += f"\n     {proposal['words']} promised {promised['gain']:.0f} "
        words += f"[{promised['from']:.0f}, {promised['to']:.0f}]"
        words += f" came {case.gain.came:.0f}" if case.gain else " came -"
    if case.why:
        words += f"\n     {case.why}"
    if case.then:
        words += f"\n     then {case.then.verdict} {['+'.join(sorted(s)) for s in case.then.sets]}"
        words += " SETTLED" if case.settled else ""
    return words


@benchmark(tables=40, first=0, seed=1, out=Path("results/promises"))
def main(chosen: Namespace) -> None:
    """Read the options, process the tables, and print the results."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    cases, able = [], 0
    for index in range(chosen.first, chosen.first + chosen.tables):
        table = draw_table_of_row(ROWS["poor"], chosen.seed, index, chosen.out / f"seed{chosen.seed}" / f"{index:04d}")
        case = followed(table)
        if case is None:
            continue
        cases.append(case)
        solvable = case.settled or could_be_settled(table, case.first)
        able += solvable
        print(line_of(index, case) + ("" if case.settled else f" (a motion could: {solvable})"), flush=True)
    proposed = sum(case.first.report["next_run"] is not None for case in cases)
    gains = [case.gain for case in cases if case.gain]
    large = [0.7 <= g.came / g.promised <= 1.3 for g in gains if g.promised >= 75.0]
    small = [g.low <= g.came <= g.high for g in gains if g.promised < 75.0]
    ratios = np.array([g.came / g.promised for g in gains])
    print(f"open: {len(cases)} of {chosen.tables}, a run proposed: {proposed}, settled by it: "
          f"{sum(c.settled for c in cases)}, could be settled by a motion: {able}")  # fmt: skip
    if gains:
        print(f"came over promised: quartiles {np.round(np.quantile(ratios, [0.25, 0.5, 0.75]), 2)}")
        print(f"promises of 75 and more within 0.7-1.3: {Rate(sum(large), len(large)) if large else 'none'}")
        print(f"smaller promises: interval holds {Rate(sum(small), len(small)) if small else 'none'}")
