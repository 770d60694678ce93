"""Drop effects that are not needed to explain the disagreement, and replace curves by straight lines."""

from dataclasses import replace

from scipy.stats import f as fisher

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.model_adequacy import is_a_line, own_shapes
from fingervision.diagnosis.inference.search_state import Findings
from fingervision.diagnosis.inference.verdict import LACK_OF_FIT, standing_of
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.independent_values import independent_values

NEEDED = 1.1
"""Factor by which dropping an effect may increase the residual (RMS); an effect that reduces the residual by more is
kept."""
AS_MUCH = 2.0**0.5
"""Factor by which a straight line may leave more residual (RMS) than a curve if there is unknown structure: twice the
power, because a richer formula also fits part of that structure."""
LINE = ("rest_gap_error", "lever_ratio_error")
"""Offset and ratio that together are any straight line over the input."""
BY_STRUCTURE = LACK_OF_FIT
"""Probability (p-value) above which an effect is dropped: the probability that remaining structure alone reduces the
residual as much as this effect does."""


def without_unneeded_effects(data: Observations, found: Findings) -> Findings:
    """Drop effects that explain less than the remaining residual: they may only imitate a part of that residual.

    If structure remains in addition to several effects, the fit of each effect also absorbs part of that structure.
    """
    rows = int(found.problem.measured.size - found.problem.whitener.aside.sum())
    while len(found.best.names) > 1 and (found.unknown is not None or found.left_over is not None):
        best = found.best
        less = min((_without(found, name) for name in best.names), key=lambda explanation: explanation.score)
        fewer = replace(found, best=less, alternatives=(less,))
        needed = standing_of(data, fewer).after_mm > NEEDED * standing_of(data, found).after_mm
        if less.score - best.score > best.score - rows or needed:
            break
        found = fewer
    return found


def without_fits_to_structure(data: Observations, found: Findings) -> Findings:
    """Drop effects, down to two, that the remaining structure could imitate by chance; the verdict is then *unknown*.

    If structure remains, the gain of an effect cannot be compared with the noise. The gain is compared with the
    residual without the effect, which consists of a few bumps of many rows each: an F test is used, whose degrees of
    freedom are the number of independent values in this residual. For one turn of a rotary table, for example, a
    warming within two seconds and an arc fitted such bumps in addition to the friction.
    """
    while len(found.best.names) > 2 and found.left_over is not None and found.unknown is None:
        fewer = [_without(found, name) for name in found.best.names]
        less = min(fewer, key=lambda explanation: explanation.score)
        power = (_stands(data, found, less) / max(_stands(data, found, found.best), 1e-300)) ** 2
        freed = _freedom(found.best) - _freedom(less)
        left = _independent_values(data, less) - _freedom(found.best)
        if left > 0.0 and fisher.sf((power - 1.0) / freed * left, freed, left) < BY_STRUCTURE:
            break
        found = replace(found, best=less, alternatives=(less,), unknown=found.left_over, left_over=None)
    return found


def with_simpler_parts(data: Observations, found: Findings) -> Findings:
    """If there is unknown structure, replace an effect by a straight line that leaves about as much residual.

    A richer formula gains by fitting unexplained structure: an apparent warming within two seconds may only be an
    offset and one unusual part of the record.
    """
    most_mm = AS_MUCH * standing_of(data, found).after_mm if found.unknown is not None else 0.0
    while found.unknown is not None:
        simpler = [e for e in _with_a_line(found) if _stands(data, found, e) <= most_mm]
        if not simpler:
            break
        best = min(simpler, key=lambda e: e.score)
        found = replace(found, best=best, alternatives=(best,))
    return found


def _with_a_line(found: Findings) -> list[Explanation]:
    """Explanations in which a straight line over the input replaces one curved effect of the best explanation.

    The line is one effect or, for a curved effect with several parameters, an offset together with a ratio.
    """
    best, problem = found.best, found.problem
    curved = [n for n, s in zip(best.names, own_shapes(problem, best), strict=True) if not is_a_line(problem, s)]
    simple = [(n,) for n in problem.effects if n not in best.names and _is_linear(problem, n)]
    out = []
    for name in curved:
        kept = {other: best.values[other] for other in best.names if other != name}
        both = [LINE] if len(best.values[name]) > len(LINE) and all((n,) in simple for n in LINE) else []
        for line in (*simple, *both):
            fitted = fit(problem, (*kept, *line), {**kept, **{other: {} for other in line}}, iterations=20)
            shapes = dict(zip(fitted.names, own_shapes(problem, fitted), strict=True))
            if all(is_a_line(problem, shapes[other]) for other in line):
                out.append(fitted)
    return out


def _is_linear(problem: Problem, name: str) -> bool:
    listed = problem.parameters((name,))
    return len(listed) == 1 and listed[0][1].starts == 1


def _independent_values(data: Observations, explanation: Explanation) -> float:
    history = data.chain.history
    residual = (data.stacked_mm - data.chain.stacked(explanation.values))[: history.input_mm.size]
    return independent_values(residual, history.runs)


def _stands(data: Observations, found: Findings, explanation: Explanation) -> float:
    return standing_of(data, replace(found, best=explanation, alternatives=(explanation,))).after_mm


def _freedom(explanation: Explanation) -> int:
    return sum(len(values) for values in explanation.values.values())


def _without(found: Findings, name: str) -> Explanation:
    kept = {other: found.best.values[other] for other in found.best.names if other != name}
    refit = fit(found.problem, tuple(kept), kept, iterations=20)
    known = [e for e in found.singles if e.names == refit.names]
    return min([refit, *known], key=lambda e: e.score)
