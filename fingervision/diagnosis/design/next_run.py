"""Propose the next run by the expected noncentrality per minute (T-optimality, Atkinson & Fedorov 1975)."""

from dataclasses import dataclass
from math import ceil

import numpy as np

from fingervision.diagnosis.design.augmented_dataset import PAUSE_S, REFITTED, AugmentedDataset
from fingervision.diagnosis.design.expected_gain import MOST, expected_gain
from fingervision.diagnosis.design.next_look import WORTH, static_check
from fingervision.diagnosis.design.protocols import (
    REZERO,
    Step,
    driven,
    measured_ends,
    protocols,
    repeated,
    rounding_s,
)
from fingervision.diagnosis.inference.evidence import surprise
from fingervision.diagnosis.inference.hypothesis import Explanation, Point, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.posterior import LEAST_STEPS, draws
from fingervision.diagnosis.input.observations import Observations
from fingervision.domain.effect import Array
from fingervision.domain.report import NextRun

REZERO_MIN = 1.5
"""Duration of re-zeroing the stage, in minutes."""
MOST_MIN, MOST_SAMPLES = 8.0, 6000
"""Longest run that is proposed, in minutes and in samples."""
NEEDED, BARELY = 30.0, 20.0
"""Predicted gain needed to decide between two explanations (9, plus an allowance for noise and parameter uncertainty),
and the gain that is just sufficient."""
MOST_TRUTHS, MOST_RIVALS = 4, 8
"""Largest number of explanations that are assumed true in turn, and of rivals of each: larger numbers cost time and
hardly ever change the choice."""
COMPARED = 6
"""Number of pairs among which the smallest gain is searched."""
WITHIN = 1.5
"""A pair counts as separated within the run if knowledge of the runs' offsets would increase the gain by no more than
this factor."""
LIKELY = 0.02
"""Smallest probability, relative to the most probable explanation, of an explanation that is assumed true."""
SCREENED = 1
"""Iterations of a rival's refit while many runs are compared: it starts at the refit to the present data."""
ALIKE = 0.03
"""Difference in the share of decided pairs below which two runs count as equally good."""


@dataclass(frozen=True, slots=True, eq=False)
class OpenSet:
    """Explanations that the data cannot distinguish, with the quantities needed to compare them on a proposed run.

    Parameters
    ----------
    members : list of Explanation
        Explanations, the best one first.
    odds : ndarray of float, shape (members,)
        Posterior probability of each explanation, with sum 1.
    refitted : list of list of Explanation, shape (truths, members)
        Each member refitted to each assumed truth's prediction of the present data; the assumed truths are the first
        members.
    """

    members: list[Explanation]
    odds: Array
    refitted: list[list[Explanation]]

    @property
    def truths(self) -> int:
        """Number of explanations that are taken as the truth in turn when a run is chosen."""
        return len(self.refitted)


@dataclass(frozen=True, slots=True, eq=False)
class RunPlan:
    """A proposed run, with the chi-square distance that it adds between explanations of the ambiguity set."""

    name: str
    steps: list[Step]
    times: int
    input_mm: Array
    gains: Array
    minutes: float

    @property
    def uneven(self) -> float:
        """Largest ratio between the two gains of a pair (the first or the second explanation being true).

        The larger the ratio of the two gains is, the wider is the interval of the predicted gain.
        """
        ahead, back = (np.maximum(g, 1.0) for g in (self.gains[0, 1 : self.gains.shape[0]], self.gains[1:, 0]))
        return float(np.max(np.maximum(ahead / back, back / ahead), initial=1.0))

    def apart(self, j: int, k: int) -> float:
        """Gain between two explanations, of which the first is assumed true; the smaller gain if either may be true."""
        back = self.gains[k, j] if k < len(self.gains) else np.inf
        return float(min(self.gains[j, k], back))

    def pairs(self) -> list[tuple[int, int]]:
        """Pairs of explanations that the run separates, in ascending order of their separation."""
        truths, members = self.gains.shape
        found = [(j, k) for j in range(truths) for k in range(j + 1, members) if self.apart(j, k) >= WORTH]
        return sorted(found, key=lambda pair: self.apart(*pair))

    def worst(self, floor: float) -> float:
        """Smallest gain among the gains that are at least `floor`; 0 if there is none."""
        settled = self.gains[(self.gains >= floor) & np.isfinite(self.gains)]
        return float(settled.min()) if settled.size else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class RunChoice:
    """Proposes runs that separate the explanations which the measured table cannot distinguish."""

    data: Observations
    problem: Problem
    open: OpenSet

    @property
    def step_s(self) -> float:
        """Time between samples."""
        return self.data.chain.history.sample_time_s

    def planned(self, name: str, steps: list[Step], iterations: int, times: int = 1) -> RunPlan | None:
        """Evaluate a run; the result is None if the run takes too long."""
        history = self.data.chain.history
        inputs = driven(steps, self.step_s, rounding_s(self.data.table.input_mm, self.step_s, history.runs))
        if inputs.size > MOST_SAMPLES:
            return None
        rezeroed = REZERO in steps
        run = AugmentedDataset.of(self.data, self.problem, inputs, rezeroed=rezeroed)
        gains = np.full((self.open.truths, len(self.open.members)), np.inf)
        for j, rivals in enumerate(self.open.refitted):
            for k, rival in enumerate(rivals):
                if j != k:
                    apart = run.distance(self.open.members[j].values, rival, iterations=iterations)
                    gains[j, k] = max(0.0, apart - rival.score)
        minutes = (PAUSE_S + inputs.size * self.step_s) / 60.0 + REZERO_MIN * rezeroed
        return RunPlan(name, steps, times, inputs, gains, minutes)

    def settled(self, gains: Array, needed: float = NEEDED) -> float:
        """Fraction of pairs of explanations that given gains separate, weighted by the explanations' probabilities."""
        part = np.where(np.isfinite(gains), np.minimum(gains / needed, 1.0), 0.0)
        odds = self.open.odds[: self.open.truths]
        return float(odds @ part.sum(axis=1) / odds.sum() / max(1, len(self.open.members) - 1))

    def shown(self, run: RunPlan, second: AugmentedDataset, j: int, k: int) -> float:
        """Expected gain between two explanations if the more probable one is true and the runs have no offsets."""
        if REZERO in run.steps:
            return run.apart(j, k)
        true, other = (j, k) if self.open.odds[j] >= self.open.odds[k] or k >= self.open.truths else (k, j)
        truth, rival = self.open.members[true].values, self.open.refitted[true][other]
        return second.distance(truth, rival, sigma_mm=self.open.members[other].sigma_mm) - rival.score

    def least(self, run: RunPlan) -> tuple[float, tuple[int, int]] | None:
        """The separated pair of explanations with the smallest gain, and this gain; None if no pair is separated.

        Pairs of explanations that are separated within the new run come first; a difference in offset between the new
        run and the old data could also be due to re-zeroing the stage.
        """
        second = AugmentedDataset.of(self.data, self.problem, run.input_mm, rezeroed=REZERO in run.steps)
        found = [(self.shown(run, second, *pair), pair) for pair in run.pairs()[:COMPARED]]
        within = [each for each in found if each[0] < WITHIN * run.apart(*each[1])]
        return min(within or found, default=None)

    def best(self, ends: tuple[float, float]) -> RunPlan | None:
        """Choose protocol and number of repetitions that decide most pairs; among equally good ones, the shortest."""
        found: list[tuple[float, float, int, RunPlan]] = []
        for name, steps in protocols(*ends, self.step_s):
            once = self.planned(name, steps, SCREENED)
            if once is None:
                continue
            most = max(1, int(min((MOST_MIN - PAUSE_S / 60.0) / once.minutes, MOST_SAMPLES / once.input_mm.size)))
            times = max(1, ceil(NEEDED / max(once.worst(NEEDED / most), NEEDED / most)))
            found.append((self.settled(times * once.gains), times * once.minutes * once.uneven, times, once))
        if not found:
            return None
        top = max(settled for settled, *_ in found)
        _, _, times, once = min((each for each in found if each[0] >= top - ALIKE), key=lambda each: each[1])
        return self.planned(once.name, repeated(once.steps, times), REFITTED, times)


def open_set(problem: Problem, members: list[Explanation]) -> OpenSet:
    """Order the indistinguishable explanations by their probability given the data; the best one stays first."""
    cost = {id(e): e.bic + surprise(problem, e) for e in members}
    best, others = members[0], sorted(members[1:], key=lambda e: cost[id(e)])[:MOST_RIVALS]
    listed = [best, *others]
    costs = np.array([cost[id(e)] for e in listed])
    odds = np.exp(-0.5 * (costs - costs.min()))
    truths = 1 + int(np.count_nonzero(odds[1:MOST_TRUTHS] >= LIKELY))
    targets = [problem.whitened(truth.values) for truth in listed[:truths]]
    refitted = [
        [fit(problem, e.names, e.values, target=target, iterations=REFITTED) for e in listed] for target in targets
    ]
    return OpenSet(listed, odds / odds.sum(), refitted)


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
    """State the run, and the gain that it promises."""
    listed, odds = choose.open.members, choose.open.odds
    worst = choose.least(plan)
    if worst is None:
        return None
    j, k = separated = worst[1]
    first, second = (
        found if each == 0 else draws(choose.problem, listed[each], rng, LEAST_STEPS) for each in separated
    )
    share = float(odds[j] / (odds[j] + odds[k]))
    both, chance = (listed[j], listed[k]), (share, 1.0 - share)
    gain, interval = expected_gain(
        choose.data, choose.problem, plan.input_mm, both, chance, (first, second), rng, rezeroed=REZERO in plan.steps
    )
    pair = ("+".join(listed[j].names), "+".join(listed[k].names))
    size = f"{gain:.0f}{' or more' * (gain >= MOST)}"
    words = f"{plan.name}: it separates {' from '.join(pair)} by an expected chi-square of {size}"
    leading = "+".join(listed[0].names)
    apart = [e for i, e in enumerate(listed) if i and plan.apart(0, i) >= WORTH]
    also = ["+".join(e.names) for e in apart if separated != (0, listed.index(e))]
    left = ["+".join(e.names) for e in members[1:] if all(e is not one for one in apart)]
    words += f", and {leading} from {', '.join(also)}" if also else ""
    words += f"; none of the candidate protocols separates {leading} from {', '.join(left)}." if left else "."
    return NextRun(plan.name, tuple(plan.steps), gain, interval, pair, words)
