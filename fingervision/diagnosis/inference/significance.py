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
        if gained <= max(least, self._averaging_gains(ranked[0], base)):
            return False
        if gained > CLEARLY * least and not (jumps_astray(self.problem, base.names) or self._averages(ranked[0], base)):
            return True
        suspects = [
            {name: e.values[name] for name in e.names if name not in base.names}
            for e in ranked[:SUSPECTS]
            if set(base.names) <= set(e.names)
        ]
        return exceeds_noise(gained - least, self.problem, self.atoms, self.thresholds, base, suspects, self.rng)

    def _averaging_gains(self, one: Explanation, base: Explanation) -> float:
        """Largest gain of an effect that only removes the errors of the recorded input: with memory, or at an end.

        It is at most what the errors that differ from row to row contribute to chi-square: a play of two standard
        uncertainties of the record removed the noise of all readings at rest, an end stop that of a rest at an end.
        What smoothing has left is common to `input_samples` rows, and is not removed.
        """
        added = [self.problem.effects[name] for name in one.names if name not in base.names]
        if not any(effect.memory or effect.stands_at for effect in added):
            return 0.0
        whitener = self.problem.whitener
        errors = whitener.passing_mm**2 + whitener.input_mm**2
        share = errors / (errors + whitener.noises[0].total_mm ** 2)
        return float(np.sum(share)) / max(1.0, whitener.input_samples)

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


SEEN_SIGMAS = 1.645
"""Standard deviations above the threshold at which nineteen of twenty effects are detected."""


def detection_limits(
    problem: Problem, atoms: Signatures, nothing: Explanation, thresholds: Mapping[str, float]
) -> dict[str, dict[str, object]]:
    """Compute the detection limit of each effect."""
    metric = problem.offsets.metric(nothing.sigma_mm)
    shared = problem.offsets.design.T @ atoms.columns
    norm = np.einsum("ij,ij->j", atoms.columns, atoms.columns) - np.einsum("ij,ij->j", shared, metric @ shared)
    out: dict[str, dict[str, object]] = {}
    for name in problem.effects:
        if name not in thresholds:
            continue
        needed = float(np.sqrt(thresholds[name])) + SEEN_SIGMAS
        amplitudes = {p.name: p for _, p in problem.parameters((name,)) if p.neutral is not None and p.run is None}
        sizes: list[tuple[float, str]] = []
        for k in (k for k, owner in enumerate(atoms.names) if owner == name and norm[k] > 0.0):
            grow = atoms.grows[k]
            if grow is not None:
                sizes.append((abs(grow[2]) * needed / float(np.sqrt(norm[k])), grow[0]))
            elif norm[k] > needed**2:
                sizes += [
                    (abs(atoms.starts[k][p.name] - (p.neutral or 0.0)), p.name)
                    for p in amplitudes.values()
                    if atoms.starts[k][p.name] != p.neutral
                ]
        if sizes:
            size, parameter = min(sizes)
            out[name] = {"parameter": parameter, "size": size, "unit": amplitudes[parameter].unit}
    return out
