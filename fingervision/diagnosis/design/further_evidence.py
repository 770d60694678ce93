"""What tells look-alikes apart that no motion of the stage does: a sentence of advice a pair, without a promised gain.

Each effect states which checks it shows in and which it stays out of; a check tells two apart where they differ.
"""

from fingervision.diagnosis.inference.hypothesis import Explanation
from fingervision.domain.further_check import FurtherCheck
from fingervision.effects import catalogue


def further_evidence(alternatives: tuple[Explanation, ...]) -> tuple[str, ...]:
    """Say what else would tell explanations apart that differ by one effect each; a sentence a pair of effects.

    Parameters
    ----------
    alternatives : tuple of Explanation
        What the data cannot tell apart.
    """
    found: dict[tuple[frozenset[str], FurtherCheck], None] = {}
    for one in alternatives:
        for other in alternatives:
            differing = frozenset(one.names) ^ frozenset(other.names)
            if len(differing) == 2 and len(one.names) == len(other.names):
                found.update({(differing, check): None for check in checks_between(*differing)})
    return tuple(f"{' or '.join(sorted(pair))}: {check.value}." for pair, check in found)


def checks_between(one: str, other: str) -> tuple[FurtherCheck, ...]:
    """Give the checks in which one effect shows and the other stays out."""
    first, second = (catalogue()[name].checks for name in (one, other))
    return tuple(check for check in FurtherCheck if {first.get(check), second.get(check)} == {True, False})
