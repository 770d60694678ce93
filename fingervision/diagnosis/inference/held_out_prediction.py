"""Prediction of rows that a fit did not use: each run from the other runs, and one half of the table from the other."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import derivatives, fit
from fingervision.diagnosis.inference.random_effect import MAP, estimated_coefficients
from fingervision.diagnosis.inference.search_state import Findings
from fingervision.diagnosis.input.observations import Observations
from fingervision.domain.effect import Array, Flags

WORSE = 1.02
"""Ratio of the RMS on the unseen half, with effects and without any, above which the effects predict nothing. On tables
of other laboratories this ratio separated wrong names from right ones."""
BY_CHANCE = 2.0
"""Standard deviations by which noise alone changes the difference of the two sums of squares; less refutes nothing."""
LEVERAGE = 0.1
"""Least share of the square of each effect's change that must lie in the half that is fitted; a half in which an effect
hardly acts determines nothing."""
STEPS = 6
"""Most iterations of a fit to part of the rows, which starts at the fit to all of them."""


def rms_mm(residual_mm: Array, samples: int, edges: bool) -> float:
    """RMS residual (mm) of left and right finger if both are measured, else of the gap; without the midline's constant.

    Parameters
    ----------
    residual_mm : ndarray of float, shape (channels * samples,)
        Gap, then midline.
    samples : int
        Number of rows in one channel.
    edges : bool
        Whether the second channel is the midline.
    """
    gap = residual_mm[:samples]
    if not edges:
        return float(np.sqrt(np.mean(gap**2)))
    midline = residual_mm[samples : 2 * samples]
    midline = midline - np.mean(midline)
    return float(np.sqrt(np.mean(0.25 * gap**2 + midline**2)))


def left_out_rms_mm(data: Observations, problem: Problem, best: Explanation) -> tuple[float | None, float | None]:
    """RMS prediction error (mm) of runs left out of the fit in turn, without and with effects; None for one run."""
    history = data.chain.history
    n = history.input_mm.size
    if len(history.runs) < 2:
        return None, None
    before = data.stacked_mm - data.chain.stacked({})
    after = before.copy()
    for run in history.runs if best.names or data.position_map is not None else ():
        hidden = np.zeros(n, dtype=bool)
        hidden[run] = True
        rows = np.tile(hidden, before.size // n)
        after[rows] = (data.stacked_mm - _predicted(data, *_fitted_without(data, problem, best, hidden)))[rows]
    return rms_mm(before, n, history.both_edges), rms_mm(after, n, history.both_edges)


def fails_on_unseen_half(data: Observations, problem: Problem, explanation: Explanation) -> str | None:
    """Say that effects fitted to one half of the table predict the other half worse than no effect does, or None.

    The halves are every other run or, of a single run, its first and second half. A name that does not predict what it
    did not see describes this table and no property of the set-up.
    """
    n = data.chain.history.input_mm.size
    bare, whole = data.chain.stacked({}), explanation.values
    alone = [bare - data.chain.stacked({name: whole[name]}) for name in explanation.names]
    for hidden, words in _halves(data):
        seen = np.tile(~hidden & ~problem.whitener.aside[:n], bare.size // n)
        if any(float(np.sum(one[seen] ** 2)) < LEVERAGE * float(np.sum(one**2)) for one in alone):
            continue
        before, moved, doubt = _on_unseen(data, problem, explanation, hidden)
        old, new = float(np.sum(before**2)), float(np.sum((before - moved) ** 2))
        chance = BY_CHANCE * 2.0 * problem.whitener.noises[0].total_mm * float(np.linalg.norm(moved))
        if new > WORSE**2 * old and new - old > chance + BY_CHANCE**2 * doubt:
            rows = max(1, before.size)
            named = " and ".join(explanation.names)
            return (
                f"{named}, fitted to {words[0]}, predicts {words[1]} worse than no effect does "
                f"({1e3 * (new / rows) ** 0.5:.3g} um RMS against {1e3 * (old / rows) ** 0.5:.3g} um)"
            )
    return None


def foretold(data: Observations, found: Findings) -> Findings:
    """Keep the explanations that predict the half that they did not see; *unknown* if the best one does not."""
    if found.unknown is not None or not (found.best.names or data.position_map is not None):
        return found
    words = fails_on_unseen_half(data, found.problem, found.best)
    if words is not None:
        return replace(found, unknown=words, left_over=None, alternatives=(found.best,))
    others = [e for e in found.alternatives if e is not found.best and e.names]
    kept = tuple(e for e in others if fails_on_unseen_half(data, found.problem, e) is None)
    return replace(found, alternatives=(found.best, *kept)) if len(kept) < len(others) else found


def _on_unseen(
    data: Observations, problem: Problem, explanation: Explanation, hidden: Flags
) -> tuple[Array, Array, float]:
    """Disagreement of the gap in hidden rows without effects, and its change by effects fitted to the other rows.

    Returned last is the sum of the variances of this change by what the other rows leave open: half of a table may
    determine an effect so badly that its prediction says nothing about the other half, and refutes nothing.
    """
    bare, runs, n = data.chain.stacked({}), data.chain.history.runs, hidden.size
    counted = hidden & ~problem.whitener.aside[:n]
    rest, fitted = _fitted_without(data, problem, explanation, hidden)
    moved = (_predicted(data, rest, fitted) - bare)[:n]
    before = (data.stacked_mm - bare)[:n]
    slopes = derivatives(problem, fitted)[:n][counted]
    doubt = float(np.sum((slopes @ fitted.covariance) * slopes))
    return _without_run_means(before, counted, runs), _without_run_means(moved, counted, runs), doubt


def _fitted_without(
    data: Observations, problem: Problem, explanation: Explanation, hidden: Flags
) -> tuple[Problem, Explanation]:
    """Estimation problem without some hidden rows, and the explanation fitted to the others."""
    aside = problem.whitener.aside | np.tile(hidden, problem.whitener.aside.size // hidden.size)
    rest = problem.judged_by(replace(problem.whitener, aside=aside), data.aim_mm)
    return rest, fit(rest, explanation.names, explanation.values, sigma_mm=explanation.sigma_mm, iterations=STEPS)


def _predicted(data: Observations, rest: Problem, fitted: Explanation) -> Array:
    """Prediction of all rows by effects, and by a map, that were fitted without some hidden rows; shape (m,)."""
    predicted = data.chain.stacked(fitted.values)
    curve = data.position_map
    if curve is None:
        return predicted
    numbers, _ = estimated_coefficients(rest, fitted, MAP)
    return np.asarray(predicted + curve.columns_mm @ numbers)


def _halves(data: Observations) -> list[tuple[Flags, tuple[str, str]]]:
    """Rows hidden in turn, and words for the rows that are fitted and for those that are predicted."""
    runs, n = data.chain.history.runs, data.chain.history.input_mm.size
    first = np.zeros(n, dtype=bool)
    names = ("the first half", "the second half")
    if len(runs) > 1:
        names = ("every other run", "the runs between them")
        for run in runs[::2]:
            first[run] = True
    else:
        first[: n // 2] = True
    return [(~first, names), (first, names[::-1])]


def _without_run_means(values: Array, kept: Flags, runs: Sequence[slice]) -> Array:
    """Kept values; with several runs without the mean of each, because the offset of an unseen run is not foretold."""
    parts = [values[run][kept[run]] for run in runs]
    if len(runs) > 1:
        parts = [part - part.mean() for part in parts if part.size]
    return np.concatenate(parts)
