"""Fits of single effects and pairs to the curve of an experiment, first linearised, then in the complete chain."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.hidden.candidates import Candidate, candidates
from tests.benchmarks.hidden.catalogue_chain import MAP, Effects, Samples, extended, respond
from tests.benchmarks.hidden.experiment import Experiment, edges
from tests.benchmarks.hidden.fit import Curve, Fit, Problem, fit
from tests.benchmarks.hidden.linear_signatures import Library
from tests.benchmarks.hidden.plant import Trace
from tests.benchmarks.hidden.weights import Weights

Array = NDArray[np.float64]
REFINED = 20
"""Number of pairs with the smallest linear residual that are refitted in the chain."""


def problem_of(experiment: Experiment, traces: list[Trace], *, known_input: bool) -> Problem:
    """Estimation problem for the runs of an experiment."""
    table, noise = experiment.plant.table, experiment.noise
    counts = [len(t.input_mm) for t in traces]
    starts = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    at = Samples(
        np.concatenate([t.input_mm for t in traces]),
        np.concatenate([t.run_time_s for t in traces]),
        np.concatenate([t.table_time_s for t in traces]),
        starts,
    )
    shaken = 0.0 if known_input else noise.input_variance_mm2
    gap_sd = np.sqrt(2 * noise.edge_variance_mm2 + table.slope(at.input_mm) ** 2 * shaken)
    midline_sd = np.full_like(gap_sd, np.sqrt(noise.edge_variance_mm2 / 2))
    offset = noise.run_offset_mm if len(traces) > 1 else 0.0
    force = None if table.force_n is None else noise.force_n
    weights = Weights(gap_sd, midline_sd, noise.correlation, offset, starts, force)
    placement = experiment.plant.placement_mm
    inputs = experiment.plant.inputs
    travel = (inputs.lower_mm, inputs.upper_mm)
    model = extended(table.input_mm, table.gap_mm, table.midline_mm, table.force_n, placement, travel)
    return Problem(model, at, weights)


def curve_of(traces: list[Trace]) -> Curve:
    """Gap, midline and force of simulated runs without noise."""
    left, right = edges(traces)
    return right - left, (left + right) / 2, np.concatenate([t.force_n for t in traces])


def known_effects(experiment: Experiment, problem: Problem, *, with_map: bool = False) -> list[Candidate]:
    """Candidate effects for an experiment; the map of position errors only if simulated or requested."""
    return candidates(
        problem.model,
        problem.at,
        experiment.noise,
        time_restarts=experiment.design.time_restarts,
        has_force=experiment.plant.table.force_n is not None,
        with_map=with_map or any(h.name == MAP for h in experiment.plant.hidden),
    )


@dataclass(frozen=True, slots=True, eq=False)
class Search:
    """Fits many explanations to one curve; `sure` is the estimation problem with an exactly known input."""

    problem: Problem
    sure: Problem
    known: list[Candidate]
    library: Library
    bare: Curve

    def signal(self, target: Curve) -> Array:
        return self.problem.weights.apply(*(t - b for t, b in zip(target, self.bare, strict=True)))

    def singles(self, target: Curve) -> list[Fit]:
        signal = self.signal(target)
        found = []
        for _, (group,) in self.library.left_over(signal, 1):
            candidate = self.known[self.library.owner[group]]
            tries = [self.library.begin(self.known, (group,), signal)[0], *more_beginnings(candidate)]
            fits = [fit(self.problem, target, [candidate], [start], 40) for start in tries]
            found.append(min(fits, key=lambda f: f.distance))
        return sorted(found, key=lambda f: f.distance)

    def pairs(self, target: Curve, without: set[str], limit: float) -> tuple[list[Fit], float]:
        """Refitted pairs, and the smallest linear residual of all other pairs."""
        signal = self.signal(target)
        found, skipped = [], np.inf
        for rest, groups in self.library.left_over(signal, 2):
            chosen = [self.known[self.library.owner[g]] for g in groups]
            if without & {c.name for c in chosen}:
                continue
            if len(found) >= REFINED or rest > limit:
                skipped = min(skipped, rest)
                break
            found.append(fit(self.problem, target, chosen, self.library.begin(self.known, groups, signal), 50))
        return sorted(found, key=lambda f: f.distance), skipped

    def exchanged(self, form: Curve, own: Fit) -> list[Fit]:
        """Pairs in which one of two simulated effects is replaced by the most similar other effects."""
        found = []
        for kept in own.names if len(own.names) == 2 else ():
            alone = respond(self.problem.model, self.problem.at, {kept: own.effects[kept]})
            rest = self.problem.weights.apply(*(f - a for f, a in zip(form, alone, strict=True)))
            for _, (group,) in self.library.left_over(rest, 1)[:8]:
                other = self.known[self.library.owner[group]]
                if other.name in own.names:
                    continue
                begin = self.library.begin(self.known, (group,), rest)[0]
                chosen = [c for c in self.known if c.name in (kept, other.name)]
                starts = [own.effects[kept] if c.name == kept else begin for c in chosen]
                found.append(fit(self.problem, form, chosen, starts, 50))
        return found

    def cautious(self, target: Curve, effects: Effects) -> float:
        answer = respond(self.problem.model, self.problem.at, effects)
        difference = [a - b for a, b in zip(answer, target, strict=True)]
        r = self.problem.weights.apply(*difference)
        return self.problem.weights.cautious(float(r @ r), difference[0], difference[1])


def more_beginnings(candidate: Candidate) -> list[Array]:
    """Further starting values for effects without an amplitude, whose search may not converge."""
    if candidate.name in ("slew_limit", "backlash", "stick_slip", "structural_resonance"):
        picked = np.linspace(0, len(candidate.starts) - 1, 4).astype(int)
        return [candidate.starts[k] for k in picked]
    if candidate.name == "large_deflection":
        return [np.array([3 * candidate.lower[0], c]) for c in (-0.7, 0.7)]
    return []


def search_of(
    experiment: Experiment, traces: list[Trace], *, known_input: bool, with_map: bool = False
) -> tuple[Search, Curve]:
    """Search for the runs of an experiment, and their curve without noise."""
    problem = problem_of(experiment, traces, known_input=known_input)
    known = known_effects(experiment, problem, with_map=with_map)
    bare = respond(problem.model, problem.at, {})
    sure = problem_of(experiment, traces, known_input=True)
    return Search(problem, sure, known, Library.of(problem, known), bare), curve_of(traces)
