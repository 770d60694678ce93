"""Explanations that the judge did not list: each is fitted before it counts as wrong."""

from dataclasses import replace

from tests.benchmarks.hidden.catalogue_chain import MAP, respond
from tests.benchmarks.hidden.diagnose_adapter import Answer
from tests.benchmarks.hidden.experiment import Experiment
from tests.benchmarks.hidden.explanations import more_beginnings, search_of
from tests.benchmarks.hidden.fit import Fit, fit
from tests.benchmarks.hidden.oracle import Judgement, verdict_on
from tests.benchmarks.hidden.table_cache import JudgedTable

LINE = frozenset({"input_offset", "rest_gap_error", "edge_bias", "input_scale", "lever_ratio_error", "scale_error"})
"""Effects to which the straight line of a map of position errors is equivalent."""


def admitted(experiment: Experiment, judgement: Judgement, names: frozenset[str]) -> bool:
    """Whether an explanation that the judge did not list may nevertheless be in the set.

    The explanation is fitted with creep that is not relaxed at the start of runs, and with a map of position errors,
    which the judge's list does not include. An explanation that contains the truth is no alternative.
    """
    search, target = search_of(experiment, experiment.traces(), known_input=False, with_map=MAP in names)
    chosen = [c for c in search.known if c.name in names]
    contains = frozenset(judgement.effects) < names
    if len(chosen) != len(names) or not chosen or contains or len(names) > 2:
        return False
    own = Fit(tuple(judgement.effects), judgement.acting, judgement.own)
    form = respond(search.problem.model, search.problem.at, own.effects)
    signal = search.signal(form)
    groups = [
        next((g for _, (g,) in search.library.left_over(signal, 1) if search.library.owner[g] == k), None)
        for k, c in enumerate(search.known)
        if c in chosen
    ]
    begins = [[own.effects.get(c.name, c.starts[k * (len(c.starts) - 1) // 2]) for c in chosen] for k in range(3)]
    if None not in groups:
        begins.append(search.library.begin(search.known, tuple(int(g) for g in groups if g is not None), signal))
    if len(chosen) == 1:
        begins += [[start] for start in more_beginnings(chosen[0])]
    fits = (fit(search.problem, form, chosen, begin, 60, begun=own.effects, creep_starts=True) for begin in begins)
    best = min(fits, key=lambda found: found.distance)
    return verdict_on(search, form, best, own, target) is not None


def widened(table: JudgedTable, answer: Answer, hidden: frozenset[str]) -> Judgement:
    """The judgement, extended by explanations of the answer that are admitted although the judge did not list them."""
    judgement = table.judgement
    if not hidden or answer.verdict not in ("named", "ambiguous"):
        return judgement
    listed = {*judgement.must, *judgement.may}
    more = []
    for names in dict.fromkeys(answer.sets):
        # A map has no straight line over its travel; that of the diagnosis, with other weights, may have one.
        bare = names - LINE if MAP in hidden & names else names
        if names not in listed and (bare in listed or admitted(table.experiment, judgement, names)):
            more.append(names)
    return replace(judgement, may=(*judgement.may, *more))
