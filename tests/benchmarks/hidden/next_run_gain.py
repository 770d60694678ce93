"""Actual and predicted gain of a proposed run: the chi-square by which the run separates two explanations."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.hidden.catalogue_chain import Samples, respond
from tests.benchmarks.hidden.diagnose_adapter import Answer
from tests.benchmarks.hidden.experiment import Experiment, first_columns, measured
from tests.benchmarks.hidden.explanations import known_effects, problem_of
from tests.benchmarks.hidden.fit import Curve, Fit, Problem, fit
from tests.benchmarks.hidden.plant import Trace
from tests.benchmarks.hidden.recipe import drive_recipe
from tests.benchmarks.hidden.reported_effects import reported_effects
from tests.benchmarks.hidden.table_cache import JudgedTable

Array = NDArray[np.float64]
GROSS_SIGMAS = 6.0


@dataclass(frozen=True, slots=True)
class Gain:
    """Predicted gain in chi-square with its 95 % interval, and actual gain."""

    promised: float
    low: float
    high: float
    came: float


def promise_of(report: dict[str, Any]) -> tuple[float, float, float] | None:
    """Predicted gain and its interval, in any of the forms that design.md allows; None without a proposal."""
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


def separated(answer: Answer) -> list[frozenset[str]]:
    """Explanations that the proposed run is intended to separate."""
    spoken = (answer.report.get("next_run") or {}).get("separates") or []
    if spoken and isinstance(spoken[0], list) and spoken[0] and isinstance(spoken[0][0], list):
        spoken = spoken[0]
    return [_names(s) for s in spoken] or list(answer.sets)


Columns = dict[str, list[Array]]
"""Columns of a measured table, one array per run."""


def with_second(experiment: Experiment, traces: list[Trace]) -> Columns:
    """Columns of the table as measured, followed by those of further runs."""
    old = first_columns(experiment)
    new = measured(experiment, traces, np.random.default_rng([experiment.seed, 13]))
    return {key: old[key] + new[key] for key in old}


def _joined(table: JudgedTable, traces: list[Trace], columns: Columns) -> tuple[Problem, Curve]:
    """Estimation problem and target for noisy runs."""
    problem = problem_of(table.experiment, traces, known_input=False)
    left, right, recorded, force = (
        np.concatenate(columns[key]) for key in ("left_mm", "right_mm", "input_mm", "force_n")
    )
    at = Samples(recorded, problem.at.run_time_s, problem.at.table_time_s, problem.at.starts)
    return Problem(problem.model, at, problem.weights), (right - left, (left + right) / 2, force)


def gain_that_came(table: JudgedTable, answer: Answer) -> Gain | None:
    """Simulate the proposed run with the same effects, and fit both explanations to old and new runs together.

    The function returns None if no gain was predicted, nothing was to be separated, or the recipe has other steps than
    motions.
    """
    promise, apart = promise_of(answer.report), separated(answer)
    own = frozenset(h.name for h in table.experiment.plant.hidden)
    if promise is None or own not in apart or len(apart) < 2:
        return None
    experiment = table.experiment
    traces = experiment.traces()
    old = _joined(table, traces, first_columns(experiment))
    known = {c.name for c in known_effects(experiment, old[0])}
    rivals = [names for names in apart if names != own and names <= known]
    if not rivals:
        return None
    path = table.folder / "diagnosis" / answer.report["next_run"]["recipe"]
    more = drive_recipe(experiment, path)
    both = _joined(table, [*traces, *more], with_second(experiment, more))
    before, after = (_advantage(table, answer, own, rivals, *data) for data in (old, both))
    return Gain(*promise, min(b - a for a, b in zip(before, after, strict=True)))


def _without_gross_errors(problem: Problem, target: Curve, found: Fit) -> Curve:
    """Replace samples that are too far from their expected value by this value."""
    expected = respond(problem.model, problem.at, found.effects)
    shift = np.median(target[1] - expected[1])
    gap, midline = target[0] - expected[0], target[1] - expected[1] - shift
    weights = problem.weights
    gap_sd, midline_sd = (
        np.hypot(sd, share * weights.run_offset_mm)
        for sd, share in ((weights.gap_sd_mm, np.sqrt(2.0)), (weights.midline_sd_mm, np.sqrt(0.5)))
    )
    gross = (np.abs(gap) > GROSS_SIGMAS * gap_sd) | (np.abs(midline) > GROSS_SIGMAS * midline_sd)
    return np.where(gross, expected[0], target[0]), np.where(gross, expected[1] + shift, target[1]), target[2]


def _advantage(
    table: JudgedTable,
    answer: Answer,
    own: frozenset[str],
    rivals: list[frozenset[str]],
    problem: Problem,
    target: Curve,
) -> list[float]:
    """Chi-square by which the simulated effects fit noisy runs better than each other explanation."""
    known = known_effects(table.experiment, problem)
    reported = reported_effects(answer.report, known)
    distances: list[float] = []
    for names in (own, *rivals):
        chosen = [c for c in known if c.name in names]
        # Effects that another explanation shares with the truth or the answer start from the values there, because a
        # period is hard to find.
        begins = [
            [values.get(c.name, c.starts[k * (len(c.starts) - 1) // 3]) for c in chosen]
            for values in ({}, table.judgement.effects, reported)
            for k in range(4)
        ]
        best = min((fit(problem, target, chosen, begin, 80) for begin in begins), key=lambda found: found.distance)
        if not distances:
            # Gross errors are determined with the simulated effects, and do not influence the comparison.
            target = _without_gross_errors(problem, target, best)
            best = fit(problem, target, chosen, [best.effects[c.name] for c in chosen], 80)
        distances.append(best.distance)
    return [rival - distances[0] for rival in distances[1:]]
