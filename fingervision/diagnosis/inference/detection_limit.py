"""Detection limit of each effect: the smallest size that would have been detected in these data."""

from collections.abc import Mapping

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.signatures import Signatures

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
