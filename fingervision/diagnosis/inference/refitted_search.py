"""The search beside a drawing: what is missing and the drawing's uncertain numbers are found in turn."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fingervision.diagnosis.inference.hypothesis_fit import Explanation, Point, Problem, fit
from fingervision.diagnosis.inference.posterior import settled
from fingervision.diagnosis.inference.reference_gauge import told_by_slots
from fingervision.diagnosis.inference.search import Findings, Progress, search
from fingervision.diagnosis.input.intersample_interpolation import along_likelier_path
from fingervision.diagnosis.input.observations import BenchData

MOST_SEARCHES = 3
"""The second is nearly always the last, and none is needed where the drawing's numbers act along a straight line."""


@dataclass(frozen=True, slots=True, eq=False)
class Refitted:
    """What was found, with the measurement beside the refitted gripper.

    Parameters
    ----------
    bench : BenchData
        Measurement and model; the drawing's uncertain numbers stand where they explain the most.
    found : Findings
        What the search found.
    posterior : tuple of dict
        Draws of the best explanation's parameters.
    """

    bench: BenchData
    found: Findings
    posterior: tuple[Point, ...]


def _problem(bench: BenchData, explanation: Explanation | None) -> Problem:
    values = {} if explanation is None else explanation.values
    free = 0 if explanation is None else explanation.free
    return bench.problem(bench.stacked_mm - bench.chain.stacked(values), free, explained=explanation is not None)


def refitted_search(bench: BenchData, rng: np.random.Generator, forced: frozenset[str], progress: Progress) -> Refitted:
    """Search; where a drawing's numbers are uncertain, redraw it and search again until neither changes the other.

    Parameters
    ----------
    bench : BenchData
        Measurement and model.
    rng : numpy Generator
        For the bootstrap and the posterior.
    forced : frozenset of str
        Effects that the user insists on.
    progress : callable
        Told the share that is done.
    """
    found, said = told_by_slots(bench, search(partial(_problem, bench), rng, forced, progress))
    likelier = along_likelier_path(bench, found.problem, found.best)
    if likelier is not bench:
        bench = likelier
        found, said = told_by_slots(bench, search(partial(_problem, bench), rng, forced, progress))
    if not bench.refit.moved:
        best, posterior = settled(found.problem, found.best, rng)
        return Refitted(_with_notes(bench, said), _with_best(found, best), posterior)
    for _ in range(MOST_SEARCHES - 1):
        nearer = bench.redrawn(found.problem, found.best)
        straight = nearer.straight(bench, found.problem)
        bench = nearer
        if straight:
            break
        found, said = told_by_slots(bench, search(partial(_problem, bench), rng, forced, progress))
    found = replace(found, problem=_problem(bench, found.best))
    refit = fit(found.problem, found.best.names, found.best.values, iterations=20) if found.best.names else found.best
    best, posterior = settled(found.problem, refit, rng)
    found = _with_best(found, best)
    bench = bench.redrawn(found.problem, best if best.names else found.problem.nothing())
    return Refitted(_with_notes(bench, said), replace(found, problem=_problem(bench, best)), posterior)


def _with_notes(bench: BenchData, said: tuple[str, ...]) -> BenchData:
    return replace(bench, notes=(*bench.notes, *said))


def _with_best(found: Findings, best: Explanation) -> Findings:
    others = tuple(best if explanation is found.best else explanation for explanation in found.alternatives)
    return replace(found, best=best, alternatives=others)
