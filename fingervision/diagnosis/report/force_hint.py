"""Advise to measure the force, if it would separate explanations that the gap cannot separate."""

from dataclasses import replace

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation
from fingervision.diagnosis.input.observations import Observations
from fingervision.domain.model import PhysicalModel

SEEN = 0.002
"""Detectable difference of force as a share of the largest force: the repeatability of an ordinary force sensor,
averaged over a run."""


def force_hint(data: Observations, alternatives: tuple[Explanation, ...]) -> tuple[str, ...]:
    """Name explanations with equal gap but different force, if the table has no force.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    alternatives : tuple of Explanation
        Explanations that the data cannot distinguish, best first.
    """
    if data.chain.history.force or len(alternatives) < 2 or not isinstance(data.model.base, PhysicalModel):
        return ()
    chain = replace(data.chain, history=replace(data.chain.history, force=True))
    n = chain.history.input_mm.size
    forces = [chain.stacked(explanation.values)[-n:] for explanation in alternatives]
    largest = float(np.max(np.abs(forces[0])))
    apart = [float(np.sqrt(np.mean((force - forces[0]) ** 2))) for force in forces[1:]]
    told = ["+".join(e.names) for e, by in zip(alternatives[1:], apart, strict=True) if by > SEEN * largest]
    if not told:
        return ()
    least = min(by for by in apart if by > SEEN * largest)
    return (
        f"measure force_n too: {'+'.join(alternatives[0].names)} differs from {', '.join(told)} "
        f"by {least:.2g} N (RMS) of {largest:.2g} N.",
    )
