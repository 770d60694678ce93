"""The judge: which answers are right for a table, from fits of every effect to the truth without noise.

A distance is the squared whitened distance D_jk of diagnosing.md. An explanation nearer than 4 belongs to the answer,
one farther than 20 does not, in between it may or may not. What rests on a choice is decided in favour of the tool:
distances that must be in are taken with the input's error switched off (all the information there could be), those that
must be out with the recorded input's whole error and with profiled offsets of the runs.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.hidden.candidates import Candidate, candidates
from tests.benchmarks.hidden.catalogue_chain import Effects, Samples, extended, respond
from tests.benchmarks.hidden.experiment import Experiment, edges
from tests.benchmarks.hidden.fit import Curve, Fit, Library, Problem, fit
from tests.benchmarks.hidden.plant import Trace
from tests.benchmarks.hidden.weights import Weights

Array = NDArray[np.float64]
NEAR, FAR, OUTSIDE = 4.0, 20.0, 25.0
REFINED = 14
"""Pairs of the smallest linear rest that are refitted in the chain."""
LIMITING = {
    "friction_hysteresis": {"backlash"},
    "viscoelastic_creep": {"input_scale", "lever_ratio_error", "thermal_drift", "drive_lag", "camera_latency"},
    "large_deflection": {"input_scale", "lever_ratio_error"},
    "structural_resonance": {"drive_lag", "camera_latency"},
    "finger_contact": {"end_stop"},
    "end_stop": {"finger_contact"},
    "thermal_drift": {"rest_gap_error", "edge_bias", "camera_scale_drift"},
}
"""Effects whose limiting case is a simpler one: they may stand beside it in a set, or be folded into it."""


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """The right answers for one table.

    Parameters
    ----------
    must : tuple of frozenset of str
        Explanations that belong to the set.
    may : tuple of frozenset of str
        Explanations that may be in it.
    nothing : float
        Distance of no effect at all; `agrees` is right below 20 and required below 4.
    own : float
        What the catalogue's form of the hidden effects leaves over.
    effects : dict
        The hidden effects' parameters in the catalogue's form.
    nearest : dict
        The nearest explanations and their distances, for a person who asks why.
    outside : bool
        Whether every single effect and pair is at least 25 away.
    """

    must: tuple[frozenset[str], ...]
    may: tuple[frozenset[str], ...]
    nothing: float
    own: float
    effects: Effects
    nearest: dict[str, float]
    outside: bool


def problem_of(experiment: Experiment, traces: list[Trace], *, known_input: bool) -> Problem:
    """The judge's problem for an experiment's runs."""
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
    return Problem(extended(table.input_mm, table.gap_mm, table.midline_mm, table.force_n), at, weights)


def curve_of(traces: list[Trace]) -> Curve:
    """Gap, midline and force without noise."""
    left, right = edges(traces)
    return right - left, (left + right) / 2, np.concatenate([t.force_n for t in traces])


def known_effects(experiment: Experiment, problem: Problem) -> list[Candidate]:
    """The candidates on this experiment."""
    return candidates(
        problem.model,
        problem.at,
        experiment.noise,
        time_restarts=experiment.design.time_restarts,
        has_force=experiment.plant.table.force_n is not None,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
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
            tries = [self.library.begin(self.known, (group,), signal)[0], *_more(candidate)]
            fits = [fit(self.problem, target, [candidate], [start], 40) for start in tries]
            found.append(min(fits, key=lambda f: f.distance))
        return sorted(found, key=lambda f: f.distance)

    def pairs(self, target: Curve, without: set[str], limit: float) -> tuple[list[Fit], float]:
        """Pairs refitted, and the smallest linear rest of those that were not."""
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

    def cautious(self, target: Curve, effects: Effects) -> float:
        answer = respond(self.problem.model, self.problem.at, effects)
        difference = [a - b for a, b in zip(answer, target, strict=True)]
        r = self.problem.weights.apply(*difference)
        return self.problem.weights.cautious(float(r @ r), difference[0])


def _more(candidate: Candidate) -> list[Array]:
    """Further beginnings where a search stands still easily: what has no amplitude."""
    if candidate.name in ("backlash", "stick_slip", "structural_resonance"):
        picked = np.linspace(0, len(candidate.starts) - 1, 4).astype(int)
        return [candidate.starts[k] for k in picked]
    if candidate.name == "large_deflection":
        return [np.array([3 * candidate.lower[0], c]) for c in (-0.7, 0.7)]
    return []


def _search_of(experiment: Experiment, traces: list[Trace]) -> _Search:
    problem = problem_of(experiment, traces, known_input=False)
    known = known_effects(experiment, problem)
    bare = respond(problem.model, problem.at, {})
    sure = problem_of(experiment, traces, known_input=True)
    return _Search(problem, sure, known, Library.of(problem, known), bare)


def own_fit(search: _Search, experiment: Experiment, target: Curve) -> Fit:
    """The hidden effects in the catalogue's form, at the parameters nearest to the truth."""
    names = [h.name for h in experiment.plant.hidden]
    chosen = [c for c in search.known if c.name in names]
    if not chosen:
        return Fit((), {}, search.problem.distance(target, {}))
    tries = []
    for h in experiment.plant.hidden:
        candidate = next((c for c in chosen if c.name == h.name), None)
        if candidate is None:
            raise ValueError(f"{h.name} is hidden, but this table's candidates do not hold it.")
        begin = [h.parameters[n] for n in candidate.names if n in h.parameters]
        if h.name == "end_stop":
            begin = [
                h.parameters.get("upper_mm", candidate.upper[0]),
                h.parameters.get("lower_mm", candidate.lower[1]),
            ]
        if h.name == "viscoelastic_creep":
            share = [h.parameters[f"share_{k}"] for k in range(5)]
            begin = [share[0], share[1] + share[2], share[3] + share[4], 0.01]
        tries.append((candidate, np.array(begin)))
    order = [c for c in search.known if c.name in names]
    starts = [next(b for c, b in tries if c.name == o.name) for o in order]
    first = fit(search.problem, target, order, starts, 200)
    if names == ["stick_slip"] or "stick_slip" in names:
        # The distance jumps with the jump's size: look around the plant's own value.
        place = [o.name for o in order].index("stick_slip")
        for factor in np.linspace(0.97, 1.03, 31):
            trial = dict(first.effects) | {"stick_slip": starts[place] * factor}
            distance = search.problem.distance(target, trial)
            if distance < first.distance:
                first = Fit(first.names, trial, distance)
    return first


def judge(experiment: Experiment) -> Judgement:
    """Find the right answers for one experiment."""
    traces = experiment.traces()
    search = _search_of(experiment, traces)
    target = curve_of(traces)
    own = own_fit(search, experiment, target)
    nothing = search.cautious(target, {})
    if not experiment.plant.hidden and experiment.plant.foreign is None:
        return Judgement((frozenset(),), (), 0.0, 0.0, {}, {}, outside=False)
    singles = search.singles(target)
    if experiment.plant.foreign is not None:
        nearest = {"+".join(f.names): round(f.distance, 1) for f in singles[:4]}
        pairs, skipped = search.pairs(target, set(), np.inf)
        nearest |= {"+".join(f.names): round(f.distance, 1) for f in pairs[:4]}
        least = min([search.cautious(target, f.effects) for f in singles + pairs] + [skipped])
        return Judgement((), (), nothing, own.distance, {}, nearest, outside=least >= OUTSIDE)
    # Distances are those between forms of the catalogue: the truth is taken at its nearest catalogue form.
    form = respond(search.problem.model, search.problem.at, own.effects)
    must, may, nearest = [frozenset(own.names)], [], {"+".join(own.names): round(own.distance, 2)}
    near_names: set[str] = set()
    for found in _among(search, form, singles, own):
        excess = found.distance
        nearest["+".join(found.names)] = round(excess, 2)
        verdict = _verdict(search, form, found, own, target)
        if verdict is None:
            continue
        near_names |= set(found.names) if len(found.names) == 1 else set()
        (must if verdict else may).append(frozenset(found.names))
    if len(own.names) == 2:
        smaller = [s for s in [*must, *may] if len(s) == 1]
        if smaller and any(s in must for s in smaller):
            # A single effect already explains the pair: only minimal explanations count.
            must, may = [s for s in must if len(s) == 1], [*may, frozenset(own.names)]
    pairs, _ = search.pairs(form, near_names | (set(own.names) if len(own.names) == 1 else set()), 150.0)
    for found in pairs:
        if frozenset(found.names) == frozenset(own.names):
            continue
        nearest["+".join(found.names)] = round(found.distance, 2)
        verdict = _verdict(search, form, found, own, target)
        if verdict is not None:
            # A pair against a single effect: the tool's order of preference may drop it.
            sure = verdict and len(own.names) == 2
            (must if sure else may).append(frozenset(found.names))
    if nothing < FAR:
        may, must = ([*may, *must], [frozenset()]) if nothing < NEAR else ([*may, frozenset()], must)
    nearest = dict(sorted(nearest.items(), key=lambda item: item[1])[:12])
    return Judgement(tuple(must), tuple(may), nothing, own.distance, own.effects, nearest, outside=False)


def _among(search: _Search, form: Curve, singles: list[Fit], own: Fit) -> list[Fit]:
    """Single explanations of the catalogue's form of the truth, refitted to it."""
    again = []
    for found in singles:
        if frozenset(found.names) == frozenset(own.names):
            continue
        chosen = [c for c in search.known if c.name in found.names]
        if found.distance - own.distance < max(400.0, 0.3 * own.distance):
            found = fit(search.problem, form, chosen, [found.effects[c.name] for c in chosen], 40)
        again.append(replace(found, names=tuple(found.names)))
    return again


def _verdict(search: _Search, form: Curve, found: Fit, own: Fit, target: Curve) -> bool | None:
    """True where the explanation must be in the set, False where it may, None where it must not."""
    away = search.cautious(form, found.effects)
    excess = search.problem.distance(target, found.effects) - own.distance
    if away > FAR and excess > FAR:
        chosen = [c for c in search.known if c.name in own.names]
        if away > 6 * FAR or not chosen:
            return None
        # The other way round: from the explanation at its estimate to the truth's form.
        other = respond(search.problem.model, search.problem.at, found.effects)
        back = fit(search.problem, other, chosen, [own.effects[c.name] for c in chosen], 40)
        if search.cautious(other, back.effects) > FAR:
            return None
        return False
    folded = any(
        LIMITING.get(a, set()) & set(own.names) or a in LIMITING.get(b, set()) for a in found.names for b in own.names
    )
    return bool(search.sure.distance(form, found.effects) < NEAR and not folded)
