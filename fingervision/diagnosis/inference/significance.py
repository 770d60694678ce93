"""Significance of a gain: whether noise alone would give one more effect the same gain."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.null_bootstrap import exceeds_noise, jumps_astray, linear_thresholds, price
from fingervision.diagnosis.inference.signatures import Signatures
from fingervision.diagnosis.input.record_nuisances import below_the_input

SUSPECTS = 2
"""Number of explanations of the measurement that are also tried on every draw of noise."""
CLEARLY = 2.5
"""Ratio of a gain to the linear threshold above which no bootstrap is needed."""


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Thresholds and simulations for judging gains.

    Parameters
    ----------
    problem, atoms
        The estimation problem, and the effects' signatures.
    thresholds : mapping of str to float
        Least chi-square gain of each effect.
    rng : numpy Generator
        Generator for draws of noise.
    """

    problem: Problem
    atoms: Signatures
    thresholds: Mapping[str, float]
    rng: np.random.Generator

    @classmethod
    def of(cls, problem: Problem, atoms: Signatures, nothing: Explanation, rng: np.random.Generator) -> "Evidence":
        """Compute the significance thresholds from simulated noise."""
        columns, sigma = atoms.columns, nothing.sigma_mm
        return cls(problem, atoms, linear_thresholds(problem, atoms.names, columns, sigma, rng), rng)

    def speaks_for(self, found: list[Explanation], base: Explanation) -> bool:
        """Whether the best of some explanations gains more in chi-square over `base` than noise alone would."""
        asked = {e.names: price(self.thresholds, base, e.names) for e in found}
        ranked = sorted(found, key=lambda e: e.score + asked[e.names])
        if not ranked:
            return False
        gained = base.score - ranked[0].score
        least = asked[ranked[0].names]
        if gained <= least:
            return False
        if gained > CLEARLY * least and not (jumps_astray(self.problem, base.names) or self._averages(ranked[0], base)):
            return True
        suspects = [
            {name: e.values[name] for name in e.names if name not in base.names}
            for e in ranked[:SUSPECTS]
            if set(base.names) <= set(e.names)
        ]
        return exceeds_noise(gained - least, self.problem, self.atoms, self.thresholds, base, suspects, self.rng)

    def _averages(self, one: Explanation, base: Explanation) -> bool:
        """Whether an explanation may gain only because it averages the errors of the recorded input.

        An effect with memory averages errors of the recorded input if its change is smaller than these errors. In noise
        alone, a lag by a sixth of a sample gained 120 in chi-square, ten times its linear threshold.
        """
        if not (self.problem.whitener.passing_mm.any() or self.problem.whitener.input_mm.any()):
            return False
        if not any(self.problem.effects[name].memory for name in one.names if name not in base.names):
            return False
        change = self.problem.chain.stacked(one.values) - self.problem.chain.stacked(base.values)
        return below_the_input(self.problem, float(np.sqrt(np.mean(change**2))))
