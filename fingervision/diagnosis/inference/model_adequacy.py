"""Model adequacy: test for structure in the residual of the best explanation.

Significant structure leads to the verdict *unknown*.
"""

from dataclasses import dataclass

import numpy as np

from fingervision.diagnosis.inference.evidence import SURELY, choices, jumps_astray, noise_doubt
from fingervision.diagnosis.inference.hypothesis import SMALL_SHARE, Explanation, Problem
from fingervision.diagnosis.inference.map_identifiability import LINE_SHARE
from fingervision.diagnosis.inference.probe_basis import Probes, probes
from fingervision.diagnosis.inference.random_effect import FORM, estimated_coefficients
from fingervision.diagnosis.inference.signatures import tangents
from fingervision.diagnosis.input.record_nuisances import below_the_input
from fingervision.diagnosis.noise.run_offsets import WhitenedColumns
from fingervision.domain.effect import Array, Flags
from fingervision.effects.encoder_cyclic_error import ORDERS

LARGEST = 0.25
"""Ratio to the amplitude of the first harmonic above which another harmonic counts as a separate cause."""
VERY_STRONG = 10.0
"""Threshold of very strong evidence on the scale of BIC (Kass & Raftery 1995)."""


@dataclass(frozen=True, slots=True)
class Harmonic:
    """The strongest harmonic of a named cyclic error: its order, its share of the first, and its period (mm)."""

    order: int
    share: float
    period_mm: float

    @property
    def words(self) -> str:
        """Description of the harmonic."""
        return f"the screw's harmonic of order {self.order}, {100.0 * self.share:.0f} % of its first"


def strongest_harmonic(problem: Problem, best: Explanation) -> Harmonic | None:
    """Find the strongest harmonic among the errors of the formulas; None if there is none of very strong evidence."""
    errors, covariance = estimated_coefficients(problem, best, FORM)
    begin, found = 0, list[tuple[float, Harmonic]]()
    for name in best.names:
        effect, values = problem.effects[name], best.values[name]
        others = () if effect.inexact is None else effect.inexact(values)
        if effect.wave is not None and errors.size >= begin + len(others):
            for k, order in enumerate(ORDERS):
                own = begin + 2 * k + np.arange(2)
                told = float(errors[own] @ np.linalg.solve(covariance[np.ix_(own, own)], errors[own]))
                share = float(np.linalg.norm(errors[own])) / order**2
                found += [(share, Harmonic(order, share, values[effect.wave[1]] / order))] * (told > VERY_STRONG)
        begin += len(others)
    return max(found, key=lambda one: one[0])[1] if found and begin == errors.size else None


LONG = 4000
"""Number of samples above which fewer probes are used."""
SAME_SHAPE = 0.9
"""Correlation above which a probe has the same shape as an effect."""
STAND_INS = 2
"""Number of probes that may replace several effects: a bump's width may lie between two widths of the grid."""


def shapes_of(problem: Problem) -> Probes:
    """Choose the generic shapes (probes) for a problem; fewer of them for a long record."""
    history = problem.chain.history
    return probes(history, problem.whitener, 2400 if history.input_mm.size <= LONG else 800)


def _gains(problem: Problem, basis: WhitenedColumns, found: Explanation, taken: Array) -> tuple[Array, Array, Array]:
    """Reduction of chi-square by each column, in the residual of an explanation and of the columns already used.

    Returns
    -------
    gain, dot, norm : ndarray of float, shape (k,)
        `dot / norm` is the column's coefficient; both are zero if the column depends linearly on columns already used.
    """
    moves = np.hstack([tangents(problem, found), taken])
    dot, norm = basis.against(found.residual, problem.offsets.metric(found.sigma_mm), moves)
    usable = norm > 1e-3 * np.maximum(basis.squares, 1e-12)
    dot, norm = np.where(usable, dot, 0.0), np.where(usable, norm, 0.0)
    return np.where(usable, dot**2 / np.where(usable, norm, 1.0), 0.0), dot, norm


def _explained(problem: Problem, found: Explanation) -> float:
    """Squared whitened length of an explanation's change of the prediction, without the share of run offsets."""
    changed = problem.whitened(found.values) - problem.whitened({})
    return problem.offsets.squared(changed, problem.offsets.metric(found.sigma_mm))


def imitated(problem: Problem, shapes: Probes, found: Explanation, fewer: list[Explanation]) -> str | None:
    """Name the generic shapes that effects only imitate, in a sentence; None if the effects themselves are the cause.

    Three effects can fit almost any shape, and must therefore explain the data much better than generic shapes do. One
    or two effects count as imitations only if generic shapes fit much better, by more than the inexactness of the
    effects' formulas. An offset and a ratio beside one other effect do not count: a straight line fits no arbitrary
    shape.

    Parameters
    ----------
    found : Explanation
        The effects to be tested.
    fewer : list of Explanation
        Explanations with fewer effects, to which one or two shapes are added, each with a penalty for its amplitude and
        for the choice among all shapes (`choices`).
    """
    several = len(found.names) > 2 and _curved(problem, found) > 1
    columns, rows = shapes.columns, problem.measured.size
    basis = WhitenedColumns(columns, problem.offsets)
    # If the noise is known from repeats, a probe can also represent a play in readings at rest, including the
    # inexactness of the play's formula: such probes are excluded.
    same = several or problem.form_share > SMALL_SHARE
    barred = _is_an_effect_itself(problem, found, basis) if same else np.zeros(columns.shape[1], dtype=bool)
    each = float(np.log(rows)) + 2.0 * float(np.log(columns.shape[1]))
    ahead = VERY_STRONG if several else -max(VERY_STRONG, problem.form_share**2 * _explained(problem, found))
    least = found.bic + choices(problem, found) + ahead
    best = None
    for base in fewer:
        taken = np.zeros((rows, 0))
        cost = base.bic + choices(problem, base)
        words = list[str]()
        for _ in range(STAND_INS):
            gain = np.where(barred, 0.0, _gains(problem, basis, base, taken)[0])
            top = int(np.argmax(gain))
            taken = np.hstack([taken, columns[:, top : top + 1]])
            words.append(shapes.words[top])
            cost += each - float(gain[top])
            if cost < least:
                least, best = cost, " and ".join(words)
    return best


def _curved(problem: Problem, found: Explanation) -> int:
    """Number of effects that are no straight line over the input: a line fits no arbitrary shape."""
    bare = problem.whitened({})
    alone = [problem.whitened({name: values}) - bare for name, values in found.values.items()]
    return sum(not is_a_line(problem, shape) for shape in alone)


def _size_in_runs(problem: Problem, change: Array) -> float:
    """RMS of a change of the stacked channels, shape (m,), about its mean in every run (mm): a mean is an offset."""
    channels = np.split(change, change.size // problem.chain.history.input_mm.size)
    apart = [part[run] - part[run].mean() for part in channels for run in problem.chain.history.runs]
    return float(np.sqrt(np.mean(np.concatenate(apart) ** 2)))


def _is_an_effect_itself(problem: Problem, found: Explanation, basis: WhitenedColumns) -> Flags:
    """Mark the probes that have the shape of one of the effects, or are straight lines; shape (k,).

    For example, in readings at rest, play is merely a difference between the two directions, and a probe that describes
    this difference is not another explanation. A ramp over time in addition to an offset has the shape of warming; in
    addition to a map of position errors, every function of position counts as a line.
    """
    metric = problem.offsets.metric(found.sigma_mm)
    shapes = own_shapes(problem, found)
    lines = np.stack([np.zeros(basis.columns.shape[0]), *(s for s in shapes if is_a_line(problem, s))], axis=1)
    left = basis.against(found.residual, metric, lines)[1]
    own: Flags = np.asarray(left <= (1.0 - SAME_SHAPE**2) * np.maximum(basis.lengths(metric), 1e-12))
    for shape in shapes:
        alone = WhitenedColumns(shape[:, None], problem.offsets).against(shape, metric, lines)[1][0]
        own |= (basis.against(shape, metric, lines)[0] ** 2 > SAME_SHAPE**2 * left * alone) & (alone > 0.0)
    return own


def own_shapes(problem: Problem, explanation: Explanation) -> list[Array]:
    """Change of the whitened prediction by each effect of an explanation, with the other effects present.

    The change by each effect has shape (m,).
    """
    whole, values = problem.whitened(explanation.values), explanation.values
    others = [{other: values[other] for other in explanation.names if other != name} for name in explanation.names]
    return [whole - problem.whitened(rest) for rest in others]


def is_a_line(problem: Problem, shape: Array) -> bool:
    """Whether a whitened shape is a straight line over the input in every channel."""
    input_mm = problem.chain.history.input_mm
    line = np.stack([np.ones_like(input_mm), input_mm - input_mm.mean()], axis=1)
    lines = problem.whitener.columns(np.kron(np.eye(shape.size // input_mm.size), line))[0]
    left = shape - lines @ np.linalg.lstsq(lines, shape, rcond=None)[0]
    return float(left @ left) < LINE_SHARE * float(shape @ shape)


def remaining_structure(problem: Problem, shapes: Probes, best: Explanation) -> tuple[str | None, str | None]:
    """Test the largest gain among many probes; return unknown structure, or structure that is known to be small."""
    own = strongest_harmonic(problem, best)
    if own is not None and own.share > LARGEST:
        return f"a wave over the input with a period of {own.period_mm:.3g} mm", None
    none = np.zeros((problem.measured.size, 0))
    gain, dot, norm = _gains(problem, WhitenedColumns(shapes.columns, problem.offsets), best, none)
    # A shape is one of many, and its size is fitted; the noise is as large as it may be.
    price = float(np.log(problem.rows)) + 2.0 * float(np.log(shapes.columns.shape[1]))
    threshold = price * float(np.exp(SURELY * noise_doubt(problem)))
    top = int(np.argmax(gain))
    if jumps_astray(problem, best.names):
        # A jump that went astray, and all that follow it, are a noise of their own level.
        gain = gain * min(1.0, problem.rows / best.score)
    if gain[top] <= threshold:
        return None, None
    size_mm = _size_in_runs(problem, float(dot[top]) / float(norm[top]) * shapes.before_whitening(top))
    words = f"{shapes.words[top]} ({1e3 * size_mm:.2g} um RMS)"
    if below_the_input(problem, size_mm):
        return None, words
    # A small part of the explained change is attributed to the inexactness of an effect's formula, or of a map between
    # its nodes.
    if gain[top] < problem.form_share**2 * (_explained(problem, best) + problem.mapped):
        return None, words
    return words, None
