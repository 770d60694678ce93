"""Evidence other than stage motion that distinguishes explanations: one sentence of advice per pair of effects.

Each effect declares the checks in which it is visible; a check distinguishes two effects if only one of them is visible
in it.
"""

from fingervision.diagnosis.inference.hypothesis import Explanation
from fingervision.domain.further_check import FurtherCheck
from fingervision.effects import catalogue


def further_evidence(alternatives: tuple[Explanation, ...]) -> tuple[str, ...]:
    """Advise how to distinguish explanations that differ by one effect each; one sentence per pair of effects.

    Parameters
    ----------
    alternatives : tuple of Explanation
        Explanations that the data cannot distinguish.
    """
    found: dict[tuple[frozenset[str], FurtherCheck], None] = {}
    for one in alternatives:
        for other in alternatives:
            differing = frozenset(one.names) ^ frozenset(other.names)
            if len(differing) == 2 and len(one.names) == len(other.names):
                found.update({(differing, check): None for check in checks_between(*differing)})
    return tuple(f"{' or '.join(sorted(pair))}: {check.value}." for pair, check in found)


def checks_between(one: str, other: str) -> tuple[FurtherCheck, ...]:
    """Checks in which one effect is visible and the other is not."""
    first, second = (catalogue()[name].checks for name in (one, other))
    return tuple(check for check in FurtherCheck if {first.get(check), second.get(check)} == {True, False})
