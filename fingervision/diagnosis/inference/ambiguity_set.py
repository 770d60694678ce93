"""Ambiguity set: all minimal explanations that the data cannot distinguish from the best one."""

import numpy as np

from fingervision.diagnosis.inference.evidence import STRONG, noise_doubt, odds
from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import MANY_STEPS, fit

INDISTINGUISHABLE = 12.0
"""Chi-square below which two explanations count as indistinguishable. A distance of 4 from the truth must be detected,
and the estimate from which the distance is measured deviates from the truth by 1.5 standard deviations: (sqrt(4) +
1.5)^2."""
SURELY = 2.05
"""Standard deviations that are allowed for: the true explanation is then lost in one table of fifty."""
SPARE = 3.0
"""Chi-square that the best explanation gains from the noise in excess of the true explanation."""
ADMISSIBLE = 15.0
"""Largest chi-square by which an explanation at distance 4 from the truth is worse than the best: 4 + SURELY * 2 *
sqrt(4) + SPARE."""
OUT_OF_REACH = (400.0, 200.0)
"""Squared distance from the best explanation, and chi-square above it, from which no refit is tried: the explanation is
20 standard deviations away, and its chi-square is larger by more than any refit has ever gained (ten times
`INDISTINGUISHABLE` and `ADMISSIBLE`)."""
IDLE_SHARE = 0.3
"""Share of the best explanation's gain below which another explanation counts as explaining nothing."""


def ambiguity_set(
    problem: Problem, best: Explanation, nothing: Explanation, pool: list[Explanation], pairs: list[Explanation]
) -> tuple[list[Explanation], dict[tuple[str, ...], float]]:
    """Collect every minimal explanation that is indistinguishable from the best."""
    members, distances = [best], {}
    target = problem.whitened(best.values)
    metric = problem.offsets.metric(best.sigma_mm)
    # If the noise is poorly known, so are all differences in chi-square.
    admissible = ADMISSIBLE * (1.0 + noise_doubt(problem))

    def join(other: Explanation) -> None:
        if other.names == best.names or any(set(m.names) <= set(other.names) for m in members):
            return
        near = problem.offsets.squared(target - problem.whitened(other.values), metric)
        if near > OUT_OF_REACH[0] and other.score - best.score > OUT_OF_REACH[1]:
            return
        distance = near
        if near >= INDISTINGUISHABLE:
            imitation = _imitation(problem, best, other, best.sigma_mm)
            distance = imitation.score
            if distance < INDISTINGUISHABLE and other.score - best.score >= admissible:
                # An explanation that can imitate the best one must explain the data nearly as well: its own search had
                # stopped too early, and is continued.
                again = fit(problem, other.names, imitation.values, iterations=MANY_STEPS)
                other = min(other, again, key=lambda explanation: explanation.score)
        worse = other.score - best.score
        # If the best explanation is true, its chi-square is smaller by about this distance. If it is smaller by far
        # less, its formula is inexact too; an explanation that fits nearly as well, with no more effects, is then
        # equally acceptable.
        most = max(STRONG, min(admissible, -_least_refuted(distance)))
        contested = worse < most and len(other.names) <= len(best.names)
        if distance >= INDISTINGUISHABLE and worse < admissible:
            distance = min(distance, _imitation(problem, other, best, best.sigma_mm).score)
        distances[other.names] = distance
        # An explanation that gains little over no effect at all explains nothing: the scatter of the runs hides its
        # misfit. The average gain of its parameters from noise is subtracted (Akaike 1974).
        idle = _net(nothing, other) < IDLE_SHARE * _net(nothing, best)
        close = distance < INDISTINGUISHABLE and not idle and worse < admissible
        # An explanation with more effects always fits better, whatever is true.
        unrefuted = len(other.names) <= len(best.names) and worse < _least_refuted(distance)
        if close or unrefuted or (contested and not idle):
            members.append(other)

    for other in pool:
        join(other)
    if len(best.names) == 1:
        # Two effects are an alternative to one effect only if every acceptable single effect is physically less
        # probable.
        most = min(odds(problem, member) for member in members)
        for pair in pairs:
            if odds(problem, pair) < most:
                join(pair)
    return [m for m in members if not any(set(o.names) < set(m.names) for o in members)], distances


def _net(nothing: Explanation, explanation: Explanation) -> float:
    """Gain in chi-square over the model without effects, minus the gain that noise alone would give on average."""
    return nothing.score - explanation.score - 2.0 * explanation.free


def _least_refuted(distance: float) -> float:
    """Difference in chi-square above which an explanation counts as refuted in favour of another.

    If an explanation is true, the chi-square of the other explanation is larger by `distance` on average, with a
    standard deviation of 2 sqrt(distance) (Cox 1961). Two explanations are both kept if the present data favour
    neither, even if data of this kind could distinguish them.
    """
    return -distance + SURELY * 2.0 * float(np.sqrt(max(0.0, distance))) + SPARE


def _imitation(problem: Problem, truth: Explanation, other: Explanation, sigma_mm: tuple[float, ...]) -> Explanation:
    """Fit one explanation to another's prediction; the score is the squared whitened distance that remains.

    Whichever of two explanations is assumed true, the run offsets have the spread found for the best explanation,
    because a worse explanation would hide its misfit in a larger spread.
    """
    target = problem.whitened(truth.values)
    return fit(problem, other.names, other.values, target=target, sigma_mm=sigma_mm, iterations=12)


def beside_foretold(problem: Problem, members: list[Explanation]) -> list[Explanation]:
    """Drop explanations that only imitate an effect that the drawing predicts and that is found as predicted.

    If an imitation were the true explanation, the agreement of the fitted effect with the drawing's prediction would be
    a coincidence. For example, an apparent end stop at exactly the input at which the fingers meet in the drawing is
    the contact of the fingers.
    """

    def foretold(explanation: Explanation, name: str) -> bool:
        ranges, values = problem.effects[name].foretold, explanation.values[name]
        return bool(ranges) and all(low <= values[key] <= high for key, (low, high) in ranges.items())

    def imitates(other: Explanation, member: Explanation) -> bool:
        own, theirs = set(member.names) - set(other.names), set(other.names) - set(member.names)
        return (
            bool(own and theirs)
            and len(member.names) <= len(other.names)
            and all(foretold(member, name) for name in own)
            and not any(foretold(other, name) for name in theirs)
        )

    return [other for other in members if not any(imitates(other, member) for member in members)]
