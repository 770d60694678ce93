"""Ideal method for noisy data: noise and true input are known, but not the simulated effects.

The ideal method shows which answers the tables allow. A right answer that this method misses is due to the noise or to
a fault of the benchmark. The method has no verdict `unknown`, so that rows with effects outside the catalogue do not
apply.
"""

import numpy as np

from tests.benchmarks.hidden.catalogue_chain import respond
from tests.benchmarks.hidden.diagnose_adapter import Answer
from tests.benchmarks.hidden.explanations import search_of
from tests.benchmarks.hidden.fit import Curve, Fit, fit
from tests.benchmarks.hidden.measured_table import read_measured
from tests.benchmarks.hidden.table_cache import JudgedTable

CLAIM = 20.0
"""Gain in chi-square, in addition to the number of parameters, that a named effect requires; some hundred shapes are
tried."""
ONE_SET = 9.0


def _noisy(table: JudgedTable, truth: Curve) -> Curve:
    """Measured curve, without gross errors, which are found by comparison with the truth."""
    measured = read_measured(table.folder / "measured.csv")
    noise = table.experiment.noise
    out = []
    for values, exact in zip((measured.gap_mm, measured.midline_mm), truth[:2], strict=True):
        away = values - exact
        away = away - (np.median(away) if exact is truth[1] else 0.0)
        gross = np.abs(away) > 5 * noise.edge_mm + 3 * noise.run_offset_mm + noise.pixel_mm
        out.append(exact + np.where(gross, 0.0, away))
    return out[0], out[1], measured.force_n if measured.has_force else np.zeros_like(out[0])


def ideal(table: JudgedTable) -> Answer:
    """Best explanation by BIC among no effect, single effects and the most promising pairs; the set contains distances
    below 9.
    """
    traces = table.experiment.traces()
    search, truth = search_of(table.experiment, traces, known_input=True)
    target = _noisy(table, truth)
    bare = search.problem.distance(target, {})
    singles = search.singles(target)
    pairs = search.pairs(target, set(), np.inf)[0]
    price = np.log(len(target[0]) * 2)
    size = {c.name: len(c.lower) for c in search.known}

    def score(found: Fit) -> float:
        return found.distance + sum(size[n] for n in found.names) * price

    best = min(singles, key=score)
    both = min(pairs, key=score)
    if bare - best.distance < CLAIM and bare - both.distance < 1.5 * CLAIM:
        return Answer("agrees", (), 0.0, {})
    if best.distance - both.distance > CLAIM:
        best = both
    form = respond(search.problem.model, search.problem.at, best.effects)
    sets = [frozenset(best.names)]
    for found in singles if len(best.names) == 1 else pairs:
        if frozenset(found.names) in sets or found.distance - best.distance > 60:
            continue
        chosen = [c for c in search.known if c.name in found.names]
        again = fit(search.problem, form, chosen, [found.effects[c.name] for c in chosen], 50)
        if again.distance < ONE_SET:
            sets.append(frozenset(found.names))
    return Answer("named" if len(sets) == 1 else "ambiguous", tuple(sets), 0.0, {})
