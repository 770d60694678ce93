"""The whole loop: where they disagree, which effect is missing, how much it explains, what remains."""

import time
from dataclasses import dataclass

import numpy as np

from fingervision.diagnosis.design.further_evidence import other_evidence
from fingervision.diagnosis.design.next_run import next_run
from fingervision.diagnosis.inference.cross_validation import rms_mm, unseen_rms_mm
from fingervision.diagnosis.inference.hypothesis_fit import Explanation, Problem
from fingervision.diagnosis.inference.refitted_search import refitted_search
from fingervision.diagnosis.inference.search import Findings, Progress
from fingervision.diagnosis.input.observations import BenchData, prepare
from fingervision.diagnosis.report.force_hint import force_hint
from fingervision.diagnosis.report.residual_localization import where
from fingervision.domain.effect import Array
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.parameter import Estimate
from fingervision.domain.report import DiagnosisReport, Disagreement, NamedEffect, Place, Verdict
from fingervision.models.corrected import CorrectedModel

ODD_SIGMAS = 2.5
"""In a table of a few rows a person wants to know of any row this far off, even where it was not set aside."""


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """The report with the arrays that its figures are drawn from.

    Parameters
    ----------
    report : DiagnosisReport
        The answer.
    bench : BenchData
        Measurement and model.
    before_mm, after_mm : ndarray of float, shape (channels * n,)
        Measured minus predicted, without and with the answer.
    """

    report: DiagnosisReport
    bench: BenchData
    before_mm: Array
    after_mm: Array


def by_channel(bench: BenchData, stacked: Array) -> dict[str, Array]:
    """Split a stacked residual into gap and, where they were measured, left, right and midline."""
    n = bench.chain.history.input_mm.size
    gap = stacked[:n]
    out = {"gap": gap}
    if bench.chain.history.both_edges:
        midline = stacked[n : 2 * n] - np.median(stacked[n : 2 * n])
        out |= {"left": midline - 0.5 * gap, "right": midline + 0.5 * gap, "midline": midline}
    if bench.chain.history.force:
        out["force"] = stacked[-n:]
    return out


def places(bench: BenchData, problem: Problem, residual: Array, rng: np.random.Generator) -> tuple[Place, ...]:
    """Say where a residual cannot be noise."""
    noises = dict(zip(bench.channels, problem.whitener.noises, strict=True))
    n = bench.chain.history.input_mm.size
    aside = problem.whitener.aside[:n]
    return where(by_channel(bench, residual), noises, bench.chain.history, aside, rng)


def diagnose(
    table: MeasuredTable,
    model: CorrectedModel,
    *,
    seed: int = 1,
    forced: frozenset[str] = frozenset(),
    without: frozenset[str] = frozenset(),
    progress: Progress = lambda _: None,
) -> Diagnosis:
    """Explain a measured table by a model and the catalogue's effects.

    Parameters
    ----------
    table : MeasuredTable
        Measurement.
    model : CorrectedModel
        Model, with the effects that it already has.
    seed : int
        Of the bootstrap; the same seed gives the same report.
    forced, without : frozenset of str
        Effects that the user insists on, or rules out.
    progress : callable
        Told the share that is done.
    """
    begin = time.perf_counter()
    rng = np.random.default_rng(seed)
    refitted = refitted_search(prepare(table, model, without), rng, forced, progress)
    bench, found, best = refitted.bench, refitted.found, refitted.found.best
    history = bench.chain.history
    n = history.input_mm.size
    before = bench.stacked_mm - bench.chain.stacked({})
    after = bench.stacked_mm - bench.chain.stacked(best.values)
    unseen = unseen_rms_mm(bench, found.problem, best)
    noises = [noise.total_mm for noise in found.problem.whitener.noises]
    edges = history.both_edges
    noise_rms = float(np.sqrt(0.25 * noises[0] ** 2 + noises[1] ** 2)) if edges else noises[0]
    channels = {
        name: {
            f"before_rms_{_unit(name)}": float(np.sqrt(np.mean(a**2))),
            f"after_rms_{_unit(name)}": float(np.sqrt(np.mean(b**2))),
        }
        for (name, a), b in zip(by_channel(bench, before).items(), by_channel(bench, after).values(), strict=True)
    }
    disagreement = Disagreement(rms_mm(before, n, edges), rms_mm(after, n, edges), noise_rms, *unseen, channels)
    effects = _named(found)
    proposal = next_run(bench, found.problem, [e for e in found.alternatives if e.names], refitted.posterior, rng)
    report = DiagnosisReport(
        verdict=found.verdict,
        sentence=_sentence(found, effects, disagreement),
        effects=effects,
        alternatives=tuple(e.names for e in found.alternatives if e.names),
        where=places(bench, found.problem, before, rng),
        disagreement=disagreement,
        smallest_seen=found.smallest,
        unknown=found.unknown,
        remaining=_remaining(found, disagreement),
        next_run=proposal,
        excluded=tuple({"name": name, "reason": reason} for name, reason in bench.excluded.items()),
        outliers=_outliers(bench, found.problem, after),
        runners_up=tuple(
            {
                "effects": list(e.names),
                "chi_square_more_than_best": e.score - best.score,
                "distance": found.distances.get(e.names),
            }
            for e in found.singles[:8]
            if e.names != best.names
        ),
        notes=(
            *bench.notes,
            *bench.refitted(),
            *force_hint(bench, found.alternatives),
            *other_evidence(found.alternatives),
            *_beyond(bench, best),
            *_input_dominates(bench, found.problem),
        ),
        seconds=time.perf_counter() - begin,
    )
    progress(1.0)
    return Diagnosis(report, bench, before, after)


def _unit(channel: str) -> str:
    return "n" if channel == "force" else "mm"


def _named(found: Findings) -> tuple[NamedEffect, ...]:
    listed = [entry for entry in found.problem.parameters(found.best.names) if entry[1].run is None]
    root = np.sqrt(np.maximum(np.diag(found.best.covariance), 0.0))
    out = []
    for name in found.best.names:
        parameters = {
            parameter.name: Estimate(
                found.best.values[name][parameter.name], float(root[i]) if root[i] > 0.0 else None, parameter.unit
            )
            for i, (owner, parameter) in enumerate(listed)
            if owner == name
        }
        out.append(NamedEffect(name, str(found.problem.effects[name].stage), parameters))
    return tuple(out)


def _phrase(effect: NamedEffect) -> str:
    parts = []
    for name, e in effect.parameters.items():
        u = "" if e.u is None else f" +-{e.u:.2g}"
        parts.append(f"{name} = {e.value:.4g}{u}{' ' + e.unit if e.unit else ''}")
    return f"{effect.name} ({', '.join(parts)})"


def _sentence(found: Findings, effects: tuple[NamedEffect, ...], d: Disagreement) -> str:
    fall = f"the disagreement falls from {d.before_rms_mm:.3g} to {d.after_rms_mm:.3g} mm"
    fall += f" at {d.noise_rms_mm:.2g} mm of noise"
    what = " and ".join(_phrase(effect) for effect in effects)
    if found.verdict is Verdict.AGREES:
        return (
            f"Simulation and measurement agree within the noise of {d.noise_rms_mm:.2g} mm "
            f"(RMS disagreement {d.before_rms_mm:.3g} mm)."
        )
    if found.verdict is Verdict.NAMED:
        return f"The model lacks {what}; {fall}."
    if found.verdict is Verdict.AMBIGUOUS:
        names = " or ".join("+".join(e.names) for e in found.alternatives)
        return f"This data cannot tell {names} apart; with {what}, {fall}."
    part = f" {what} explains a part; {fall}." if effects else ""
    return f"There is structure that no effect of the catalogue explains: {found.unknown}.{part}"


def _remaining(found: Findings, d: Disagreement) -> str:
    beyond = float(np.sqrt(max(0.0, d.after_rms_mm**2 - d.noise_rms_mm**2)))
    words = f"{d.after_rms_mm:.3g} mm remain, {beyond:.2g} mm of it beyond the noise from sample to sample"
    if found.left_over is not None:
        words += f"; the largest part, {found.left_over}, is small beside what was explained"
    spread = found.best.sigma_mm
    if max(spread, default=0.0) > 0.0:
        words += f"; runs are offset against each other by {spread[0]:.2g} mm in the gap"
    return words + "."


def _outliers(bench: BenchData, problem: Problem, after: Array) -> tuple[str, ...]:
    n = bench.chain.history.input_mm.size
    aside = np.flatnonzero(problem.whitener.aside[:n])
    out = [f"{aside.size} of {n} samples were set aside as outliers."] if aside.size else []
    if n <= 60:
        gap = after[:n] - np.median(after[:n])
        scale = 1.4826 * float(np.median(np.abs(gap)))
        out += [
            f"the row at input {bench.table.input_mm[i]:g} mm lies {gap[i]:+.3g} mm off the others "
            f"({'set aside' if i in aside else 'kept'})."
            for i in np.flatnonzero(np.abs(gap) > ODD_SIGMAS * scale)
        ]
    return tuple(out)


def _beyond(bench: BenchData, best: Explanation) -> tuple[str, ...]:
    low, high = bench.model.input_range_mm
    u = bench.chain.history.input_mm
    moved = u + best.values.get("input_offset", {}).get("offset_mm", 0.0)
    moved = moved * (1.0 + best.values.get("input_scale", {}).get("ratio", 0.0))
    rows = int(np.sum((moved < low) | (moved > high)))
    return (f"for {rows} rows the model was extended by a straight line beyond its inputs.",) if rows else ()


def _input_dominates(bench: BenchData, problem: Problem) -> tuple[str, ...]:
    error = float(np.median(bench.recorded.error_mm))
    if error > problem.whitener.noises[0].total_mm:
        return (f"the recorded input's own error ({error:.2g} mm of gap) is larger than the measurement's.",)
    return ()
