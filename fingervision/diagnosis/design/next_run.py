"""Propose the next run by the expected noncentrality per minute (T-optimality, Atkinson & Fedorov 1975)."""

import numpy as np

from fingervision.diagnosis.design.expected_gain import MODERATE, ExpectedGain, expected_gain
from fingervision.diagnosis.design.experiment_design import RunChoice, RunPlan, open_set
from fingervision.diagnosis.design.protocols import REZERO, measured_ends
from fingervision.diagnosis.design.static_checks import WORTH, static_check
from fingervision.diagnosis.inference.hypothesis import Explanation, Point, Problem
from fingervision.diagnosis.inference.posterior import draws
from fingervision.diagnosis.input.observations import Observations
from fingervision.domain.report import NextRun


def next_run(
    data: Observations,
    problem: Problem,
    members: list[Explanation],
    found: tuple[Point, ...],
    rng: np.random.Generator,
) -> NextRun | None:
    """Choose the run that decides most of the open pairs in the least experiment time.

    Runs within the measured range are tried first: outside this range an explanation's formula is not verified, so that
    a predicted gain is not reliable. The stated gain belongs to the pair of explanations that the run separates least.

    Parameters
    ----------
    members : list of Explanation
        Explanations that the data cannot distinguish, the best one first.
    found : tuple of dict
        Posterior draws of the best explanation's parameters.
    rng : numpy Generator
        Generator for the interval of the predicted gain.

    Returns
    -------
    NextRun or None
        None if there is nothing to decide, or no possible run would separate the explanations.
    """
    if len(members) < 2:
        return None
    special = static_check(data, problem, members[0], members[1:])
    if data.chain.history.time_s is None:
        return special
    choose = RunChoice(data, problem, open_set(problem, members))
    plan = choose.best(measured_ends(data.table.input_mm, data.model.input_range_mm))
    if plan is None or plan.worst(WORTH) == 0.0:
        plan = choose.best(data.model.input_range_mm)
    if plan is None or plan.worst(WORTH) == 0.0:
        return special
    return _promised(choose, plan, members, found, rng) or special


def _promised(
    choose: RunChoice, plan: RunPlan, members: list[Explanation], found: tuple[Point, ...], rng: np.random.Generator
) -> NextRun | None:
    """Predict the gain of a run; if a large predicted gain would be unreliable, reduce the run."""
    listed, odds = choose.open.members, choose.open.odds
    walks: dict[int, tuple[Point, ...]] = {0: found}

    def stated(run: RunPlan, pair: tuple[int, int]) -> ExpectedGain:
        j, k = pair
        for each in pair:
            if each not in walks:
                walks[each] = draws(choose.problem, listed[each], rng)
        share = float(odds[j] / (odds[j] + odds[k]))
        both, chance, drawn = (listed[j], listed[k]), (share, 1.0 - share), (walks[j], walks[k])
        rezeroed = REZERO in run.steps
        return expected_gain(choose.data, choose.problem, run.input_mm, both, chance, drawn, rng, rezeroed=rezeroed)

    worst = choose.least(plan)
    if worst is None:
        return None
    separated = worst[1]
    promised = stated(plan, separated)
    for less in choose.smaller(plan) if not promised.sound else ():
        worst = choose.least(less)
        if worst is not None and worst[0] < MODERATE:
            again = stated(less, worst[1])
            if again.sound:
                plan, separated, promised = less, worst[1], again
                break
    j, k = separated
    pair = ("+".join(listed[j].names), "+".join(listed[k].names))
    words = f"{plan.name}: it separates {' from '.join(pair)} by an expected chi-square of {promised.stated:.0f}"
    leading = "+".join(listed[0].names)
    apart = [e for i, e in enumerate(listed) if i and plan.apart(0, i) >= WORTH]
    also = ["+".join(e.names) for e in apart if separated != (0, listed.index(e))]
    left = ["+".join(e.names) for e in members[1:] if all(e is not one for one in apart)]
    words += f", and {leading} from {', '.join(also)}" if also else ""
    words += f"; none of the candidate protocols separates {leading} from {', '.join(left)}." if left else "."
    return NextRun(plan.name, tuple(plan.steps), promised.stated, promised.interval, pair, words)
