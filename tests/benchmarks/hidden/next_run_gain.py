"""What the proposed run was worth: chi-square that it put between two explanations, against what was promised."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.benchmarks.hidden.catalogue_chain import Samples
from tests.benchmarks.hidden.diagnose_adapter import Answer
from tests.benchmarks.hidden.experiment import measured
from tests.benchmarks.hidden.explanations import known_effects, problem_of
from tests.benchmarks.hidden.fit import Curve, Problem, fit
from tests.benchmarks.hidden.plant import Trace
from tests.benchmarks.hidden.recipe import drive_recipe
from tests.benchmarks.hidden.reported_effects import reported_effects
from tests.benchmarks.hidden.table_cache import JudgedTable


@dataclass(frozen=True, slots=True)
class Gain:
    """Promised chi-square with its 95 % interval, and what came."""

    promised: float
    low: float
    high: float
    came: float


def promise_of(report: dict[str, Any]) -> tuple[float, float, float] | None:
    """Promised gain and its interval, in any of the spellings that design.md leaves open; None without a proposal."""
    run = report.get("next_run")
    if not run or run.get("promised") is None:
        return None
    promised = run["promised"]
    if isinstance(promised, int | float):
        return float(promised), float(promised), float(promised)
    value = next(float(promised[k]) for k in ("value", "gain", "chi_square") if k in promised)
    if "interval" in promised:
        low, high = promised["interval"]
    else:
        low = next((promised[k] for k in ("low", "lower", "from") if k in promised), value)
        high = next((promised[k] for k in ("high", "upper", "to") if k in promised), value)
    return value, float(low), float(high)


def _names(spoken: Any) -> frozenset[str]:
    if isinstance(spoken, str):
        return frozenset(part.strip() for part in spoken.replace(" and ", "+").split("+"))
    return frozenset(spoken)


def separated_pair(answer: Answer) -> tuple[frozenset[str], frozenset[str]] | None:
    """The two explanations that the proposed run is meant to separate."""
    spoken = (answer.report.get("next_run") or {}).get("separates") or []
    if len(spoken) == 2 and not any(isinstance(s, list) and s and isinstance(s[0], list) for s in spoken):
        return _names(spoken[0]), _names(spoken[1])
    if spoken and isinstance(spoken[0], list) and len(spoken[0]) == 2:
        return _names(spoken[0][0]), _names(spoken[0][1])
    return (answer.sets[0], answer.sets[1]) if len(answer.sets) > 1 else None


def _joined(table: JudgedTable, runs: list[tuple[Trace, int]]) -> tuple[Problem, Curve]:
    """Noisy runs as the judge fits them; the integer seeds each run's noise."""
    experiment = table.experiment
    traces = [trace for trace, _ in runs]
    problem = problem_of(experiment, traces, known_input=False)
    parts = []
    for trace, seed in runs:
        columns = measured(experiment, [trace], np.random.default_rng([experiment.seed, 13, seed]))
        parts.append((columns["left_mm"][0], columns["right_mm"][0], columns["input_mm"][0], columns["force_n"][0]))
    left, right, recorded, force = (np.concatenate(p) for p in zip(*parts, strict=True))
    at = Samples(recorded, problem.at.run_time_s, problem.at.table_time_s, problem.at.starts)
    return Problem(problem.model, at, problem.weights), (right - left, (left + right) / 2, force)


def gain_that_came(table: JudgedTable, answer: Answer) -> Gain | None:
    """Drive the proposed run with the same plant and fit both explanations to old and new runs together.

    None where nothing was promised, nothing was to be separated, or the recipe asks for more than motion.
    """
    promise, pair = promise_of(answer.report), separated_pair(answer)
    if promise is None or pair is None:
        return None
    own = frozenset(h.name for h in table.experiment.plant.hidden)
    if own not in pair:
        return None
    rival = pair[0] if pair[1] == own else pair[1]
    path = table.folder / "diagnosis" / answer.report["next_run"]["recipe"]
    old = [(trace, k) for k, trace in enumerate(table.experiment.traces())]
    new = [(trace, 100 + k) for k, trace in enumerate(drive_recipe(table.experiment, path))]
    between = []
    for runs in (old, old + new):
        problem, target = _joined(table, runs)
        known = known_effects(table.experiment, problem)
        distances = []
        for names in (own, rival):
            chosen = [c for c in known if c.name in names]
            begins = [[c.starts[len(c.starts) // 2] for c in chosen]]
            if names == own:
                begins.append([table.judgement.effects[c.name] for c in chosen])
            if names == frozenset(e["name"] for e in answer.report["effects"]):
                values = reported_effects(answer.report, known)
                begins.append([values[c.name] for c in chosen])
            distances.append(min(fit(problem, target, chosen, begin, 80).distance for begin in begins))
        between.append(distances[1] - distances[0])
    return Gain(*promise, between[1] - between[0])
