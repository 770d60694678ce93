"""The judge of the benchmark: right answers for a table, from fits of every effect to the truth without noise.

A distance is the squared whitened distance D_jk of diagnosing.md. An explanation with a distance below 4 must be in the
answer, with a distance above 20 must not, and otherwise may be. Choices are made in favour of the diagnosis: for
explanations that must be in the answer, distances are computed without an error of the input, which is the largest
possible information; for explanations that must not be in the answer, with the whole error of the recorded input and
with profiled offsets of the runs.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.hidden.catalogue_chain import MAP, RUN_START, Effects, respond
from tests.benchmarks.hidden.experiment import Experiment
from tests.benchmarks.hidden.explanations import Search, search_of
from tests.benchmarks.hidden.fit import Curve, Fit, fit

Array = NDArray[np.float64]
NEAR, FAR, OUTSIDE = 4.0, 20.0, 25.0
LIMITING = {
    "friction_hysteresis": {"backlash"},
    "viscoelastic_creep": {"input_scale", "lever_ratio_error", "thermal_drift", "drive_lag", "camera_latency"},
    "large_deflection": {"input_scale", "lever_ratio_error"},
    "structural_resonance": {"drive_lag", "camera_latency"},
    "finger_contact": {"end_stop"},
    "end_stop": {"finger_contact"},
    "thermal_drift": {"rest_gap_error", "edge_bias", "camera_scale_drift"},
}
"""Effects with a simpler effect as a limiting case: a set may contain both effects, or the simpler effect only."""


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """Right answers for one table.

    Parameters
    ----------
    must : tuple of frozenset of str
        Explanations that must be in the set.
    may : tuple of frozenset of str
        Explanations that may be in it.
    nothing : float
        Distance of the model without an effect; `agrees` is right below 20 and required below 4.
    own : float
        Distance that the catalogue's formulas of the simulated effects leave.
    effects : dict
        Parameters of the simulated effects by the catalogue's formulas.
    nearest : dict
        The nearest explanations and their distances, for information.
    outside : bool
        Whether the distance of every single effect and pair is at least 25.
    rival : float
        Distance of the nearest other explanation from the truth, minus that of the simulated effects; negative if
        another explanation is nearer to the truth than the catalogue's formulas of the simulated effects.
    """

    must: tuple[frozenset[str], ...]
    may: tuple[frozenset[str], ...]
    nothing: float
    own: float
    effects: Effects
    nearest: dict[str, float]
    outside: bool
    rival: float = 0.0
    run_start: tuple[float, ...] = ()
    """Start states of plays and sliders in each run, by the catalogue's formulas of the simulated effects."""

    @property
    def acting(self) -> Effects:
        """Simulated effects by the catalogue's formulas, with their start states."""
        return self.effects | ({RUN_START: np.array(self.run_start)} if self.run_start else {})


def own_fit(search: Search, experiment: Experiment, target: Curve) -> Fit:
    """Fit of the catalogue's formulas of the simulated effects to the truth."""
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
        if h.name == MAP:
            begin = [0.0] * len(candidate.names)
        if h.name == "viscoelastic_creep":
            share = [h.parameters[f"share_{k}"] for k in range(5)]
            begin = [share[0], share[1] + share[2], share[3] + share[4], 0.01]
        tries.append((candidate, np.array(begin)))
    order = [c for c in search.known if c.name in names]
    starts = [next(b for c, b in tries if c.name == o.name) for o in order]
    first = fit(search.problem, target, order, starts, 200)
    if names == ["stick_slip"] or "stick_slip" in names:
        # The distance is a discontinuous function of the jump's size: values around the simulated size are tried.
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
    search, target = search_of(experiment, traces, known_input=False)
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
    # Distances are between formulas of the catalogue: the truth is represented by its nearest catalogue formula.
    form = respond(search.problem.model, search.problem.at, own.effects)
    must, may, nearest = [frozenset(own.names)], [], {"+".join(own.names): round(own.distance, 2)}
    surely_single: set[str] = set(own.names) if len(own.names) == 1 else set()
    rival = np.inf
    for found in _among(search, form, singles, own):
        nearest["+".join(found.names)] = round(found.distance, 2)
        rival = min(rival, search.problem.distance(target, found.effects) - own.distance)
        verdict = verdict_on(search, form, found, own, target)
        if verdict is None:
            continue
        surely_single |= set(found.names) if verdict else set()
        (must if verdict else may).append(frozenset(found.names))
    pairs = search.pairs(form, surely_single, max(150.0, 0.05 * nothing))[0] + search.exchanged(form, own)
    for found in pairs:
        names = frozenset(found.names)
        if names in must + may or names & surely_single:
            continue
        nearest["+".join(found.names)] = round(found.distance, 2)
        if len(own.names) == 2:
            rival = min(rival, search.problem.distance(target, found.effects) - own.distance)
        verdict = verdict_on(search, form, found, own, target)
        if verdict is not None:
            # A pair may be dropped from the answer because a single effect is preferred.
            sure = verdict and len(own.names) == 2
            (must if sure else may).append(names)
    must, folded = _foldable(must)
    may += folded
    if nothing < FAR:
        may, must = ([*may, *must], [frozenset()]) if nothing < NEAR else ([*may, frozenset()], must)
    nearest = dict(sorted(nearest.items(), key=lambda item: item[1])[:12])
    starts = tuple(float(v) for v in own.effects.get(RUN_START, np.zeros(0)))
    return Judgement(
        tuple(must), tuple(may), nothing, own.distance, own.alone, nearest,
        outside=False, rival=float(rival), run_start=starts,
    )  # fmt: skip


def _foldable(must: list[frozenset[str]]) -> tuple[list[frozenset[str]], list[frozenset[str]]]:
    """Separate explanations that only repeat another right answer in a limiting case (friction without reach)."""
    kept = list(must)
    for names in must[1:]:
        simpler = set().union(*(LIMITING.get(name, set()) for name in names)) if len(names) == 1 else set()
        if any(other <= simpler for other in kept if other != names):
            kept.remove(names)
    return kept, [names for names in must if names not in kept]


def _among(search: Search, form: Curve, singles: list[Fit], own: Fit) -> list[Fit]:
    """Fits of single effects to the truth in the catalogue's formulas."""
    again = []
    for found in singles:
        if frozenset(found.names) == frozenset(own.names):
            continue
        chosen = [c for c in search.known if c.name in found.names]
        if found.distance - own.distance < max(400.0, 0.3 * own.distance):
            begin = [found.effects[c.name] for c in chosen]
            found = fit(search.problem, form, chosen, begin, 40, begun=found.effects)
        again.append(replace(found, names=tuple(found.names)))
    return again


def verdict_on(search: Search, form: Curve, found: Fit, own: Fit, target: Curve) -> bool | None:
    """True if the explanation must be in the set, False if it may be, None if it must not be."""
    away = search.cautious(form, found.effects)
    excess = search.problem.distance(target, found.effects) - own.distance
    if away > FAR and excess > FAR:
        chosen = [c for c in search.known if c.name in own.names]
        if away > 6 * FAR or not chosen:
            return None
        # The opposite distance: from the explanation at its estimate to the formula of the truth.
        other = respond(search.problem.model, search.problem.at, found.effects)
        back = fit(search.problem, other, chosen, [own.effects[c.name] for c in chosen], 40, begun=own.effects)
        if search.cautious(other, back.effects) > FAR:
            return None
        return False
    folded = any(
        LIMITING.get(a, set()) & set(own.names) or a in LIMITING.get(b, set()) for a in found.names for b in own.names
    )
    priced = MAP in found.names and MAP not in own.names
    return bool(search.sure.distance(form, found.effects) < NEAR and not folded and not priced)
