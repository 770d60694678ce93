"""Model adequacy: test for structure in the residual of the best explanation.

Significant structure leads to the verdict *unknown*.
"""

from dataclasses import dataclass

import numpy as np

from fingervision.diagnosis.inference.evidence import SURELY, choices, jumps_astray, noise_doubt
from fingervision.diagnosis.inference.hypothesis import SMALL_SHARE, Explanation, Problem
from fingervision.diagnosis.inference.map_identifiability import LINE_SHARE
from fingervision.diagnosis.inference.probe_basis import Probes, probes
from fingervision.diagnosis.inference.random_effect import evidence_of, normal_equations
from fingervision.diagnosis.inference.signatures import tangents
from fingervision.diagnosis.input.record_nuisances import below_the_input
from fingervision.diagnosis.noise.run_offsets import WhitenedColumns
from fingervision.domain.effect import Array, Flags
from fingervision.effects import catalogue

ORDERS = (2, 3, 4, 5, 6, 7)
"""Orders of the harmonics that accompany the first harmonic of a screw or resolver."""
LARGEST = 0.25
"""Ratio to the amplitude of the first harmonic above which another harmonic counts as a separate cause."""
VERY_STRONG = 10.0
"""Threshold of very strong evidence on the scale of BIC (Kass & Raftery 1995)."""


@dataclass(frozen=True, slots=True, eq=False)
class Harmonics:
    """Harmonics of a named cyclic error, and the part of the residual that they explain.

    Parameters
    ----------
    columns : ndarray of float, shape (m, k)
        Whitened changes of the prediction, sine and cosine of each order.
    fitted_mm : ndarray of float, shape (m,)
        Change of the prediction by the harmonics.
    words : str
        Description of the strongest harmonic; empty if there are none.
    """

    columns: Array
    fitted_mm: Array
    words: str = ""


def harmonics(problem: Problem, best: Explanation) -> Harmonics:
    """Fit the harmonics of a named cyclic error; none if they are not significant, or too large to belong to it.

    Parameters
    ----------
    problem : Problem
        Data and observation model.
    best : Explanation
        The named explanation.
    """
    rows = problem.measured.size
    none = Harmonics(np.zeros((rows, 0)), np.zeros(rows))
    periodic = [(name, effect.wave) for name, effect in catalogue().items() if name in best.names and effect.wave]
    if not periodic:
        return none
    chain, history = problem.chain, problem.chain.history
    name, wave_names = periodic[0]
    amplitude_mm, period_mm = (best.values[name][key] for key in wave_names)
    base = chain.stacked(best.values)
    # The harmonics of a periodic curve without jumps fall with the square of their order.
    sds = 1.0 / np.array(ORDERS) ** 2
    waves = []
    for order, sd in zip(ORDERS, sds.tolist(), strict=True):
        phase = 2.0 * np.pi * order * history.input_mm / period_mm
        for wave in (np.sin(phase), np.cos(phase)):
            moved = chain.with_input(history.input_mm + sd * amplitude_mm * wave)
            waves.append(moved.stacked(best.values) - base)
    waves_mm = np.stack(waves, axis=1)
    gram, aim = normal_equations(problem, best, waves_mm)
    share = np.linalg.solve(gram + np.eye(aim.size), aim)
    sizes = sds * np.hypot(share[0::2], share[1::2])
    strongest = int(np.argmax(sizes))
    if evidence_of(gram, aim) < VERY_STRONG or sizes[strongest] > LARGEST:
        return none
    words = f"the screw's harmonic of order {ORDERS[strongest]}, {100.0 * sizes[strongest]:.0f} % of its first"
    return Harmonics(problem.whitener.columns(waves_mm)[0], waves_mm @ share, words)


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
    own = harmonics(problem, best)
    gain, dot, norm = _gains(problem, WhitenedColumns(shapes.columns, problem.offsets), best, own.columns)
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
