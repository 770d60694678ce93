"""Sets: every minimal explanation that these data cannot tell apart from the best."""

from fingervision.diagnosis.explanation import Explanation, Problem, fit
from fingervision.domain.effect import Array

INDISTINGUISHABLE = 9.0
BARE_MENTION = 3.0
"""Below this difference of BIC simplicity is no evidence (Kass & Raftery 1995): tables of a score of rows."""
ADMISSIBLE = 21.0
"""Chi-square by which a true explanation 9 away can come out worse, at 95 %: 9 + 1.96 * 2 * sqrt(9)."""


def indistinguishable(
    problem: Problem, best: Explanation, nothing: Explanation, pool: list[Explanation], pairs: list[Explanation]
) -> tuple[list[Explanation], dict[tuple[str, ...], float]]:
    """Collect every minimal explanation that cannot be told apart from the best."""
    members, distances = [best], {}
    target = problem.whitened(best.values)
    metric = problem.offsets.metric(best.sigma_mm)
    rows = max(2, int(problem.measured.size - problem.whitener.aside.sum()))

    def join(other: Explanation) -> None:
        if other.names == best.names or any(set(m.names) <= set(other.names) for m in members):
            return
        near = _squared(problem, target - problem.whitened(other.values), metric)
        if near > 400.0 and other.score - best.score > 200.0:
            return
        distance = near if near < INDISTINGUISHABLE else _distance(problem, best, other, best.sigma_mm)
        if distance >= INDISTINGUISHABLE and other.score - best.score < ADMISSIBLE:
            distance = min(distance, _distance(problem, other, best, best.sigma_mm))
        distances[other.names] = distance
        # One that leaves the data nearly as badly off as no effect at all explains nothing: the runs' scatter hides it.
        idle = nothing.score - other.score < 0.3 * (nothing.score - best.score)
        if distance < INDISTINGUISHABLE and not idle and other.score - best.score < ADMISSIBLE:
            members.append(other)

    def odds(explanation: Explanation) -> float:
        return explanation.bic(rows) + surprise(problem, explanation)

    for other in pool:
        join(other)
    if len(best.names) == 1:
        # Two effects beside one, only where every single one that would do is physically a surprise.
        most = min(odds(member) for member in members) + BARE_MENTION
        for pair in pairs:
            if odds(pair) < most:
                join(pair)
    return [m for m in members if not any(set(o.names) < set(m.names) for o in members)], distances


def _distance(problem: Problem, truth: Explanation, other: Explanation, sigma_mm: tuple[float, ...]) -> float:
    """D_jk: squared whitened distance of one explanation's prediction to another, over the other's parameters.

    Both directions count run offsets with the best explanation's spread: a worse one would hide its fault in them.
    """
    target = problem.whitened(truth.values)
    return fit(problem, other.names, other.values, target=target, sigma_mm=sigma_mm, iterations=12).score


def _squared(problem: Problem, whitened: Array, metric: Array) -> float:
    """Squared length of a whitened difference once run offsets are allowed."""
    shared = problem.offsets.design.T @ whitened
    return float(whitened @ whitened - shared @ metric @ shared)


def beside_foretold(problem: Problem, members: list[Explanation]) -> list[Explanation]:
    """Drop what only imitates an effect that came just as the drawing foretells it: that would be a coincidence.

    An end stop at the very input at which the drawn fingers meet is the drawn fingers' contact.
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


def surprise(problem: Problem, explanation: Explanation) -> float:
    """Sum the squares of the parameters over their physical priors."""
    return sum(
        ((explanation.values[name][p.name] - (p.neutral or 0.0)) / p.typical) ** 2
        for name, p in problem.parameters(explanation.names)
        if p.typical is not None
    )
