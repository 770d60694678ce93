"""The judge: which answers are right for a table, from fits of every effect to the truth without noise.

A distance is the squared whitened distance D_jk of diagnosing.md. An explanation nearer than 4 belongs to the answer,
one farther than 20 does not, in between it may or may not. What rests on a choice is decided in favour of the tool:
distances that must be in are taken with the input's error switched off (all the information there could be), those that
must be out with the recorded input's whole error and with profiled offsets of the runs.
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
    rival : float
        How much farther than the hidden effects the nearest other explanation is from the truth itself; negative where
        another explanation comes nearer to the plant than the catalogue's form of what is hidden.
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
    """Where plays and sliders start each run in the catalogue's form of what is hidden."""

    @property
    def acting(self) -> Effects:
        """The hidden effects in the catalogue's form, with their starts."""
        return self.effects | ({RUN_START: np.array(self.run_start)} if self.run_start else {})


def own_fit(search: Search, experiment: Experiment, target: Curve) -> Fit:
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
    # Distances are those between forms of the catalogue: the truth is taken at its nearest catalogue form.
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
            # A pair against a single effect: the tool's order of preference may drop it.
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
    """Part off what only repeats another right answer at its limit: friction without reach beside a play."""
    kept = list(must)
    for names in must[1:]:
        simpler = set().union(*(LIMITING.get(name, set()) for name in names)) if len(names) == 1 else set()
        if any(other <= simpler for other in kept if other != names):
            kept.remove(names)
    return kept, [names for names in must if names not in kept]


def _among(search: Search, form: Curve, singles: list[Fit], own: Fit) -> list[Fit]:
    """Single explanations of the catalogue's form of the truth, refitted to it."""
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
    """True where the explanation must be in the set, False where it may, None where it must not."""
    away = search.cautious(form, found.effects)
    excess = search.problem.distance(target, found.effects) - own.distance
    if away > FAR and excess > FAR:
        chosen = [c for c in search.known if c.name in own.names]
        if away > 6 * FAR or not chosen:
            return None
        # The other way round: from the explanation at its estimate to the truth's form.
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
