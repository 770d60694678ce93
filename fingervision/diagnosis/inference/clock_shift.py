"""Offset between the clocks of input and pictures, fitted jointly with an explanation."""

from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from fingervision.diagnosis.inference.hypothesis import Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.random_effect import PATH, estimated_coefficients
from fingervision.diagnosis.inference.search import Look, Searched
from fingervision.diagnosis.inference.search_state import Findings
from fingervision.diagnosis.inference.uncertain_dimensions import BENT
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.input.record_nuisances import FREEDOM
from fingervision.domain.measured_table import ONE_CLOCK

MOST_SEARCHES = 2
"""Most searches at another offset: the second one follows an effect that only the first one could find."""
NEXT_FIT = 5
"""Most iterations of the fit at each offset: it begins at the fit before, which is near."""
SETTLED = 0.05
"""Precision of the offset, as a share of its standard uncertainty."""


def beside_clock(state: Searched, look: Look) -> Searched:
    """Search at the offset of the clocks that fits the explanation best, if the linearised offset does not reach it.

    A recording of one reversal shows play and offset only in the few frames in which the play is taken up. There the
    prediction changes its slope within a frame, so that a straight line in the offset does not hold over its
    uncertainty: with an offset that was 2.9 ms off (u = 2.1 ms), a play of 30 um was named as 28.2 um, u = 0.4 um.

    Parameters
    ----------
    state : Searched
        Search at the offset that the table states.
    look : Look
        Settings of searches.
    """
    if state.data.table.clock.u_s == 0.0 or state.data.recorded.commanded:
        return state
    for _ in range(MOST_SEARCHES):
        moved = _nearer(state.data, state.found)
        if moved is None:
            break
        state = look.again(moved, state.found.best)
    return state


def _nearer(data: Observations, found: Findings) -> Observations | None:
    """Observations at the offset that fits best; None where the linearised offset predicts the same gap."""
    best, problem = found.best, found.problem
    known = replace(data, table=replace(data.table, clock=ONE_CLOCK))
    aside = np.split(problem.whitener.aside, len(data.channels))
    alone = known.judged_by(problem.whitener.noises, aside, best.values)
    prior_s = FREEDOM * data.table.clock.u_s

    def at(by_s: float) -> Problem:
        return replace(alone, chain=known.later(by_s).chain)

    def cost(share: float) -> float:
        there = at(share * prior_s)
        one = fit(there, best.names, best.values, iterations=NEXT_FIT) if best.names else there.nothing()
        return one.score + share**2

    share = float(minimize_scalar(cost, bounds=(-1.0, 1.0), method="bounded", options={"xatol": SETTLED / FREEDOM}).x)
    there = at(share * prior_s)
    values = fit(there, best.names, best.values, iterations=NEXT_FIT).values if best.names else best.values
    column = data.path_errors_mm(best.values)[:, 0]
    linear = float(estimated_coefficients(problem, best, PATH)[0][0])
    missed = alone.whitener.one(there.chain.stacked(values) - problem.chain.stacked(best.values) - linear * column)
    if float(missed @ missed) <= BENT:
        return None
    words = (
        f"the offset between the clocks was fitted together with the effects: the stage moved "
        f"{abs(share) * prior_s:.2g} s {'later' if share > 0.0 else 'earlier'} than the table states."
    )
    return replace(data.later(share * prior_s), notes=(*data.notes, words))
