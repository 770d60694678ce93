"""The result as sentences: what the model lacks, what remains unexplained, which rows were excluded."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from fingervision.diagnosis.inference.evidence import speaks_for
from fingervision.diagnosis.inference.hypothesis import Explanation, Point, Problem
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.position_map import NAME
from fingervision.diagnosis.inference.verdict import UNDECIDED, Standing
from fingervision.diagnosis.input.observations import Observations
from fingervision.domain.effect import Array
from fingervision.domain.parameter import Estimate, Parameter
from fingervision.domain.report import Disagreement, NamedEffect, Place, Verdict

COVERAGE_FACTOR = 2.0
"""Coverage factor of an expanded uncertainty: about 95 % for a normal distribution (JCGM 100:2008, 6.2)."""
VISIBLE = 0.1
"""Relative difference of the disagreement as the verdict counts it from that over all rows above which a sentence
states both values; a smaller difference does not matter to a reader."""
MOST_IN_UM_MM = 1.0
"""Residual from which it is stated in millimetres; below, in micrometres, as the page and `measure` state an U."""
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


def in_one_unit(*sizes_mm: float) -> tuple[str, list[str]]:
    """Unit in which the largest of some residuals or noises is easily read, and each of them in it, to three digits."""
    unit, in_mm = ("mm", 1.0) if max(sizes_mm) >= MOST_IN_UM_MM else ("µm", 1e-3)
    return unit, [f"{float(f'{size_mm / in_mm:.3g}'):.12g}" for size_mm in sizes_mm]


def with_unit(size_mm: float) -> str:
    """A residual or a noise with its unit."""
    unit, (size,) = in_one_unit(size_mm)
    return f"{size} {unit}"


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
    unit, (before, after, all_before, all_after) = in_one_unit(before_mm, after_mm, d.before_rms_mm, d.after_rms_mm)
    noise = with_unit(d.noise_rms_mm)
    fall = f"the disagreement falls from {before} to {after} {unit} RMS{of} at a random noise of {noise}"
    if without:
        fall += f", {without} (all rows: {all_before} to {all_after} {unit})"
    all_rows = f", {without}; all rows: {all_before} {unit}" if without else ""
    what = phrase(effects[0]) if len(effects) == 1 else " and ".join(effect.name for effect in effects)
    if verdict is Verdict.AGREES:
        return (
            f"Simulation and measurement agree within the random noise of {noise} "
            f"(RMS disagreement {before} {unit}{of}{all_rows})."
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


def remaining(stands: Standing, left_over: str | None, harmonic: str, scatter_mm: tuple[float, ...]) -> str:
    """Sentence about the residual that remains beside the named effects and the harmonics of a cyclic error."""
    if stands.is_noise:
        what = "random noise only" if stands.noise_is_known else "random noise or an error of the model"
        words = f"The remaining difference is {with_unit(stands.after_mm)} RMS: {what}"
    else:
        words = (
            f"The remaining difference is {with_unit(stands.after_mm)} RMS, {100.0 * stands.share:.0f} % of the "
            f"disagreement; {with_unit(stands.noise_mm)} of it would be random noise"
        )
    if left_over is not None:
        words += f"; the largest part of it is {left_over}, small compared with the explained part"
    if harmonic:
        words += f"; it does not contain {harmonic}, which was fitted too"
    if max(scatter_mm, default=0.0) > 0.0:
        words += f"; the runs have offsets of {with_unit(scatter_mm[0])} RMS in the gap"
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


def required_words(
    data: Observations, problem: Problem, best: Explanation, forced: frozenset[str], *, mapped: bool
) -> tuple[str, ...]:
    """Sentences on effects that the user required: what speaks against each that the data do not show."""
    kept, said = {*best.names, *((NAME,) if mapped else ())}, []
    for name in sorted(forced):
        others = " and ".join(sorted(kept - {name}))
        low = f"the odds for it{' beside ' if others else ''}{others} are below 20 to 1"
        rest = {other: values for other, values in best.values.items() if other != name}
        if name not in kept:
            said.append(f"{name} was required (--with) and is not in the result: {data.excluded.get(name, low)}.")
        elif name in best.names and not speaks_for(problem, [best], fit(problem, tuple(rest), rest)):
            said.append(f"{name} was required (--with) and stays in the result, but {low}.")
    return tuple(said)


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


# Parameters that may lie beyond their search range, such as the time constant of a warming longer than the table.


COVERED = 2.0
"""Standard uncertainties that must fit between a value and the end of its range: the usual expanded uncertainty."""
TAIL = 0.05
"""Probability beyond a one-sided 95 % limit."""


def open_parameters(best: Explanation, problem: Problem) -> list[tuple[str, Parameter]]:
    """Find time constants and widths for which the data give no upper limit within their search range.

    Beyond the upper end of the search range of a time constant, the effect does not change: an exponential at its
    beginning is a straight line, of which only the slope is known. If the posterior were limited to the search range,
    the stated uncertainties of time constant and amplitude would be too small.

    Parameters
    ----------
    best : Explanation
        The best explanation, with its covariance.
    problem : Problem
        Estimation problem with the search ranges.

    Returns
    -------
    list of (str, Parameter)
        Effects with the parameter.
    """
    listed = [entry for entry in problem.parameters(best.names) if entry[1].run is None]
    u = np.sqrt(np.maximum(np.diag(best.covariance), 0.0))
    return [
        (name, parameter)
        for i, (name, parameter) in enumerate(listed)
        if parameter.unit == "s"
        and parameter.neutral is None
        and best.values[name][parameter.name] + COVERED * u[i] >= parameter.upper
    ]


def limited(value: float, parameter: Parameter, drawn: Array, open_ended: Array) -> Estimate:
    """State a parameter by a one-sided limit, on the side opposite to that on which another parameter is unbounded.

    The posterior ends where the search range ends. Beyond the search range, all values of the parameter are farther
    from the limit, so that the quantile within the range is also a limit for the whole posterior.

    Parameters
    ----------
    value : float
        Value with which the prediction was computed.
    parameter : Parameter
        The parameter.
    drawn, open_ended : ndarray of float, shape (k,)
        Posterior draws of this parameter and of the open one (the same, for the open parameter itself).
    """
    if not drawn.size:
        return Estimate(value, None, parameter.unit)
    along = float(np.mean((drawn - drawn.mean()) * (np.log(open_ended) - np.log(open_ended).mean())))
    if along == 0.0:
        return Estimate(value, None, parameter.unit)
    if along > 0.0:
        return Estimate(value, None, parameter.unit, at_least=float(np.quantile(drawn, TAIL)))
    return Estimate(value, None, parameter.unit, at_most=float(np.quantile(drawn, 1.0 - TAIL)))


def draws_of(posterior: tuple[Point, ...], effect: str, parameter: str) -> Array:
    """Posterior draws of one parameter, shape (k,); empty if the parameter was not sampled."""
    return np.array([point[effect][parameter] for point in posterior if parameter in point.get(effect, {})])


# Differences between opening and closing that the uncertain offset between two clocks explains.


ALIKE = 0.25
"""Largest relative difference between the offsets that opening and closing require. Their mean, the only possible
offset, then leaves at most a seventh of each difference."""
STILL = 0.05
"""Share of the largest speed below which the input counts as at rest, as in the search for places."""
WAYS = {"input, opening": 1.0, "input, closing": -1.0}
"""Variables of regions that exist in one direction of the input only, with the sign of the input's speed."""


def within_clock(places: Sequence[Place], data: Observations) -> tuple[Place, ...]:
    """Add a remark to regions whose difference between opening and closing a clock offset explains.

    A clock that is late by t changes the gap by the speed of the gap times t, and so by opposite amounts for opening
    and closing. A difference is attributed to the clocks only if it is found in both directions, and if the clock
    offset that it requires is within the expanded uncertainty of the clocks.

    Parameters
    ----------
    places : sequence of Place
        Regions where measurement and model disagree.
    data : Observations
        Measurement and model.
    """
    expanded_s = COVERAGE_FACTOR * data.table.clock.u_s
    if expanded_s == 0.0 or data.chain.history.time_s is None:
        return tuple(places)
    gap_mm_s = _gap_speed(data)
    late_s = {i: _late_s(place, data, gap_mm_s) for i, place in enumerate(places)}
    # Take the largest region of each direction; the smaller ones were found after its subtraction.
    first: dict[str, tuple[int, float]] = {}
    for i, by_s in late_s.items():
        if by_s is not None and abs(by_s) <= expanded_s:
            first.setdefault(places[i].variable, (i, by_s))
    if len(first) < len(WAYS):
        return tuple(places)
    (one, by_s), (other, too_s) = first.values()
    if abs(by_s - too_s) > ALIKE * max(abs(by_s), abs(too_s)):
        return tuple(places)
    words = (
        f" (clocks {1e3 * abs(by_s + too_s) / 2.0:.2g} ms apart would cause the same difference in both directions; "
        f"the offset of the clocks has U = {1e3 * expanded_s:.2g} ms, k = 2)"
    )
    return tuple(
        replace(place, words=place.words + words) if i in (one, other) else place for i, place in enumerate(places)
    )


def _gap_speed(data: Observations) -> Array:
    """Speed (mm/s) of the predicted gap, shape (n,)."""
    return data.chain.history.rate_of(data.chain.respond({}).gap_mm)


def _late_s(place: Place, data: Observations, gap_mm_s: Array) -> float | None:
    """Offset between the clocks (s) that would explain the difference in a region; None for all other regions."""
    if place.channel != "gap" or place.variable not in WAYS:
        return None
    history = data.chain.history
    input_mm = history.input_mm
    speed = history.rate_of(input_mm)
    moves = WAYS[place.variable] * speed > STILL * np.max(np.abs(speed))
    inside = moves & (input_mm >= place.start) & (input_mm <= place.end)
    typical = float(np.median(gap_mm_s[inside])) if inside.any() else 0.0
    return None if typical == 0.0 else place.size / typical
