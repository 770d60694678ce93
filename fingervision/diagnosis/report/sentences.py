"""The result as sentences: what the model lacks, what remains unexplained, which rows were excluded."""

from collections.abc import Mapping

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.verdict import UNDECIDED, Standing
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.report.open_parameters import open_parameters
from fingervision.domain.parameter import Estimate
from fingervision.domain.report import Disagreement, NamedEffect, Verdict

COVERAGE_FACTOR = 2.0
"""Coverage factor of an expanded uncertainty: about 95 % for a normal distribution (JCGM 100:2008, 6.2)."""
VISIBLE = 0.1
"""Relative difference of the disagreement as the verdict counts it from that over all rows above which a sentence
states both values; a smaller difference does not matter to a reader."""
EDGES = " of each finger's edge"
QUESTION = "Please check the table first"
"""Beginning of the sentence about a mistake in the table that explains more than any effect."""
LEAST_SHARE = 0.05
"""Share of the squared disagreement below which an effect alone is not worth a word."""
FEW_NAMES = 3
"""Number of explanations up to which the sentence of an ambiguous result names them; more are only counted."""


def phrase(effect: NamedEffect) -> str:
    """Name an effect with its parameters, by display names, and their expanded uncertainties (k = 2)."""
    parts = []
    for key, e in effect.parameters.items():
        unit = f" {e.unit}" if e.unit else ""
        u = "" if e.u is None else f", U = {COVERAGE_FACTOR * e.u:.2g}{unit}"
        size = limit_words(e) or f"{e.value:.4g}{unit}{u}"
        parts.append(f"{effect.display_name(key)} {size}")
    coverage = "; k = 2" if any(e.u is not None for e in effect.parameters.values()) else ""
    return f"{effect.name} ({'; '.join(parts)}{coverage})"


def limit_words(e: Estimate) -> str:
    """State a one-sided limit in words; the text is empty for a parameter that the data limit on both sides."""
    unit = f" {e.unit}" if e.unit else ""
    if e.at_least is not None:
        return f"at least {e.at_least:.4g}{unit} (95 %)"
    return "" if e.at_most is None else f"at most {e.at_most:.4g}{unit} (95 %)"


def answer(
    verdict: Verdict,
    unknown: str | None,
    effects: tuple[NamedEffect, ...],
    alternatives: tuple[tuple[str, ...], ...],
    d: Disagreement,
    *,
    mistaken: bool = False,
) -> str:
    """The whole result in one or two sentences; `mistaken` if a mistake in the table explains more than any effect.

    The sizes of several effects are stated in separate lines (`detail_lines`), so that the sentence stays short.
    """
    (before_mm, after_mm), without = _said(d)
    of = EDGES if d.of == "edges" else ""
    fall = f"the disagreement falls from {before_mm:.3g} to {after_mm:.3g} mm RMS{of}"
    fall += f" at a random noise of {d.noise_rms_mm:.2g} mm"
    if without:
        fall += f", {without} (all rows: {d.before_rms_mm:.3g} to {d.after_rms_mm:.3g} mm)"
    all_rows = f", {without}; all rows: {d.before_rms_mm:.3g} mm" if without else ""
    what = phrase(effects[0]) if len(effects) == 1 else " and ".join(effect.name for effect in effects)
    if verdict is Verdict.AGREES:
        return (
            f"Simulation and measurement agree within the random noise of {d.noise_rms_mm:.2g} mm "
            f"(RMS disagreement {before_mm:.3g} mm{of}{all_rows})."
        )
    if verdict is Verdict.NAMED:
        return f"The model lacks {what}; {fall}."
    if verdict is Verdict.AMBIGUOUS:
        names = "; ".join(" + ".join(names) for names in alternatives)
        which = f": {names}" if len(alternatives) <= FEW_NAMES else ""
        return f"These data cannot distinguish {len(alternatives)} explanations{which}. With the best fit, {fall}."
    if unknown is not None and unknown.startswith(UNDECIDED):
        return f"{unknown}."
    if mistaken:
        return f"{QUESTION}: {unknown}."
    part = f" {what} explain{'s' if len(effects) == 1 else ''} a part; {fall}." if effects else ""
    return f"There is a difference that no effect of the catalogue explains: {unknown}.{part}"


def _said(d: Disagreement) -> tuple[tuple[float, float], str]:
    """RMS before and after for a sentence, with a remark on left-out rows; no remark if the difference is small."""
    counted_mm, whole_mm = d.counted_mm, (d.before_rms_mm, d.after_rms_mm)
    differs = any(abs(one - all_mm) > VISIBLE * all_mm for one, all_mm in zip(counted_mm, whole_mm, strict=True))
    if d.rows_left_out:
        # Runs can be left out of the fit in turn only if there are several runs.
        offsets = "" if d.unseen_before_rms_mm is None else " and the runs' own offsets removed"
        return counted_mm, f"with {d.rows_left_out} of {d.rows} rows left out as outliers{offsets}"
    return (counted_mm, "with the runs' own offsets removed") if differs else (whole_mm, "")


def detail_lines(
    verdict: Verdict, effects: tuple[NamedEffect, ...], alternatives: tuple[tuple[str, ...], ...]
) -> tuple[str, ...]:
    """Lines below the printed result: each possible explanation if there are several, and each fitted effect's size.

    A single effect of a result that is not ambiguous has no line, because the sentence of the result states its size.
    """
    if verdict is Verdict.AMBIGUOUS:
        possible = [f"possible: {' + '.join(names)}" for names in alternatives] if len(alternatives) > FEW_NAMES else []
        return (*possible, *(f"best fit: {phrase(effect)}" for effect in effects))
    return tuple(f"size: {phrase(effect)}" for effect in effects) if len(effects) > 1 else ()


def remaining(stands: Standing, left_over: str | None, scatter_mm: tuple[float, ...]) -> str:
    """Sentence about the residual that remains."""
    if stands.is_noise:
        what = "random noise only" if stands.noise_is_known else "random noise or an error of the model"
        words = f"The remaining difference is {stands.after_mm:.3g} mm RMS: {what}"
    else:
        words = (
            f"The remaining difference is {stands.after_mm:.3g} mm RMS, {100.0 * stands.share:.0f} % of the "
            f"disagreement; {stands.noise_mm:.2g} mm of it would be random noise"
        )
    if left_over is not None:
        words += f"; the largest part of it is {left_over}, small compared with the explained part"
    if max(scatter_mm, default=0.0) > 0.0:
        words += f"; the runs have offsets of {scatter_mm[0]:.2g} mm RMS in the gap"
    return words + "."


def tried(singles: tuple[Mapping[str, object], ...]) -> str:
    """Sentence with the share of the disagreement that each of the best single effects explains alone."""
    shares = [
        (" + ".join(map(str, one["effects"])), float(str(one["explained_share"])))  # type: ignore[call-overload]
        for one in singles
    ]
    told = [f"{name} {100.0 * share:.0f} %" for name, share in shares if share >= LEAST_SHARE][:FEW_NAMES]
    if not told:
        return f"no single effect explains more than {100.0 * LEAST_SHARE:.0f} % of the squared disagreement."
    return f"alone, of the squared disagreement {', '.join(told)} would be explained; pairs and triples were tried too."


def required_words(data: Observations, best: Explanation, forced: frozenset[str], *, mapped: bool) -> tuple[str, ...]:
    """Sentences on effects that the user required and that are not in the result: what speaks against each."""
    kept = {*best.names, *(("position_error_map",) if mapped else ())}
    beside = " beside " + " and ".join(sorted(kept)) if kept else ""
    return tuple(
        f"{name} was required (--with) and is not in the result: "
        + data.excluded.get(name, f"{beside.strip() or 'without any effect'} it does not lower the disagreement")
        + "."
        for name in sorted(forced - kept)
    )


def rows_beyond_model(data: Observations, best: Explanation) -> tuple[str, ...]:
    """Sentence with the number of rows at which the model was extrapolated."""
    low, high = data.model.input_range_mm
    moved = data.chain.driven_mm(best.values)
    rows = int(np.sum((moved < low) | (moved > high)))
    return (
        (f"for {rows} rows beyond the inputs of the model, the model was extrapolated by a straight line.",)
        if rows
        else ()
    )


def beyond_the_search(best: Explanation, problem: Problem) -> tuple[str, ...]:
    """Sentences on parameters that may lie beyond the range in which they were searched."""
    return tuple(
        f"{effect}: the {parameter.words} may lie beyond {parameter.upper:.4g} {parameter.unit}, the end of its search "
        "range: it is longer than these data can show, so that the effect's parameters are limited on one side only; "
        "the change that the effect causes within the table is known."
        for effect, parameter in open_parameters(best, problem)
    )


def input_dominates(data: Observations, problem: Problem) -> tuple[str, ...]:
    """Sentence for a table whose noise comes mainly from the error of the recorded input."""
    error = float(np.median(data.recorded.error_mm))
    if error > problem.whitener.noises[0].total_mm:
        return (
            f"the error of the recorded input ({error:.2g} mm of gap) is larger than the error of the measured gap.",
        )
    return ()
