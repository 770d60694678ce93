"""The gate of *unknown*: structure that the best explanation leaves, found by generic probes."""

import numpy as np

from fingervision.diagnosis.bootstrap import linear_threshold
from fingervision.diagnosis.explanation import Explanation, Problem
from fingervision.diagnosis.input_error import below_the_input
from fingervision.diagnosis.probes import probes
from fingervision.diagnosis.signatures import tangents

SMALL_SHARE = 0.05
"""What the catalogue's form leaves over of the truth's is a few per cent of what was explained, no second name."""


def unexplained(problem: Problem, best: Explanation, rng: np.random.Generator) -> tuple[str | None, str | None]:
    """Test the largest of many probes; returns what is unknown, or what is left over but small."""
    samples = problem.chain.history.input_mm.size
    shapes = probes(problem.chain.history, problem.whitener, 2400 if samples <= 4000 else 800)
    offsets, metric = problem.offsets, problem.offsets.metric(best.sigma_mm)
    moved = shapes.columns - offsets.design @ (metric @ (offsets.design.T @ shapes.columns))
    dot = moved.T @ best.residual
    norm = np.einsum("ij,ij->j", shapes.columns, moved)
    if best.names:
        moves = tangents(problem, best)
        bent = moves - offsets.design @ (metric @ (offsets.design.T @ moves))
        cross = bent.T @ shapes.columns
        inverse = np.linalg.pinv(moves.T @ bent)
        dot = dot - cross.T @ (inverse @ (bent.T @ best.residual))
        norm = norm - np.einsum("ij,ij->j", cross, inverse @ cross)
    usable = norm > 1e-3 * np.maximum(np.einsum("ij,ij->j", shapes.columns, shapes.columns), 1e-12)
    gain = np.where(usable, dot**2 / np.where(usable, norm, 1.0), 0.0)
    threshold = linear_threshold(problem, shapes.columns[:, usable], best.sigma_mm, rng)
    top = int(np.argmax(gain))
    if gain[top] <= threshold:
        return None, None
    words = f"{shapes.words[top]} ({np.sqrt(gain[top]):.1f} sigma)"
    changed = problem.whitened(best.values) - problem.whitened({})
    explained = float(changed @ changed)
    size_mm = abs(float(dot[top])) / float(norm[top]) * shapes.rms[top]
    if below_the_input(problem, size_mm):
        return None, words
    if best.names and gain[top] < SMALL_SHARE**2 * explained:
        return None, words
    return words, None
