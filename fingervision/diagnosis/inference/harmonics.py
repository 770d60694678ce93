"""Harmonics of a named cyclic error: a real screw has harmonics that the catalogue's sine does not include.

Small harmonics are attributed to the named cyclic error.
"""

from dataclasses import dataclass

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.domain.effect import Array
from fingervision.effects import catalogue

ORDERS = (2, 3)
"""Orders of the harmonics that accompany the first harmonic of a screw or resolver."""
LARGEST = 0.25
"""Ratio to the amplitude of the first harmonic above which another harmonic counts as a separate cause."""


@dataclass(frozen=True, slots=True, eq=False)
class Harmonics:
    """Harmonics of a named cyclic error, and the part of the residual that they explain.

    Parameters
    ----------
    columns : ndarray of float, shape (m, k)
        Whitened changes of the prediction, sine and cosine of each order.
    words : str
        Description of the strongest harmonic.
    gain : float
        Chi-square that the harmonics explain.
    """

    columns: Array
    words: str = ""
    gain: float = 0.0


def harmonics(problem: Problem, best: Explanation) -> Harmonics:
    """Fit the harmonics of a named cyclic error; none if they are too large to belong to it.

    Parameters
    ----------
    problem : Problem
        Data and observation model.
    best : Explanation
        The named explanation.
    """
    none = Harmonics(np.zeros((problem.measured.size, 0)))
    periodic = [(name, effect.wave) for name, effect in catalogue().items() if name in best.names and effect.wave]
    if not periodic:
        return none
    chain, history = problem.chain, problem.chain.history
    name, wave_names = periodic[0]
    amplitude_mm, period_mm = (best.values[name][key] for key in wave_names)
    base = chain.stacked(best.values)
    waves = []
    for order in ORDERS:
        phase = 2.0 * np.pi * order * history.input_mm / period_mm
        for wave in (np.sin(phase), np.cos(phase)):
            moved = chain.with_input(history.input_mm + LARGEST * amplitude_mm * wave)
            waves.append(moved.stacked(best.values) - base)
    columns = problem.whitener.columns(np.stack(waves, axis=1))[0]
    metric = problem.offsets.metric(best.sigma_mm)
    bent = columns - problem.offsets.design @ (metric @ (problem.offsets.design.T @ columns))
    taken = bent.T @ best.residual
    share = np.linalg.pinv(columns.T @ bent) @ taken
    sizes = LARGEST * np.hypot(share[0::2], share[1::2])
    if np.max(sizes) > LARGEST:
        return none
    strongest = int(np.argmax(sizes))
    words = f"the screw's harmonic of order {ORDERS[strongest]}, {100.0 * sizes[strongest]:.0f} % of its first"
    return Harmonics(columns, words, float(share @ taken))
