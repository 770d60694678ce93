"""The report of a diagnosis, composed from its result."""

import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.special import bdtrc

from fingervision.diagnosis.design.next_look import further_evidence, next_look
from fingervision.diagnosis.design.next_run import next_run
from fingervision.diagnosis.inference.held_out_prediction import left_out_rms_mm, rms_mm
from fingervision.diagnosis.inference.hypothesis import Explanation, Point
from fingervision.diagnosis.inference.measuring_chain import Settings
from fingervision.diagnosis.inference.model_adequacy import strongest_harmonic
from fingervision.diagnosis.inference.position_map import NAME
from fingervision.diagnosis.inference.search_state import Findings
from fingervision.diagnosis.inference.verdict import Answer, verdict
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.replicates import PureError
from fingervision.diagnosis.report.left_out_rows import outlier_rows, outliers
from fingervision.diagnosis.report.residual_localization import by_channel, places
from fingervision.diagnosis.report.sentences import (
    COVERAGE_FACTOR,
    answer,
    beyond_the_search,
    draws_of,
    input_dominates,
    limited,
    open_parameters,
    remaining,
    required_words,
    rows_beyond_model,
    tried,
)
from fingervision.domain.effect import Array, History
from fingervision.domain.model import PhysicalModel
from fingervision.domain.parameter import Estimate
from fingervision.domain.report import DiagnosisReport, Disagreement, NamedEffect, Verdict
from fingervision.effects import catalogue
from fingervision.motion.recorded_input import LEAST_HOLD, settled_halves

# Advise to measure the force, if it would separate explanations that the gap cannot separate.

SEEN = 0.002
"""Detectable difference of force as a share of the largest force: the repeatability of an ordinary force sensor,
averaged over a run."""


def force_hint(data: Observations, alternatives: tuple[Explanation, ...]) -> tuple[str, ...]:
    """Name explanations with equal gap but different force, if the table has no force.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    alternatives : tuple of Explanation
        Explanations that the data cannot distinguish, best first.
    """
    if data.chain.history.force or len(alternatives) < 2 or not isinstance(data.model.base, PhysicalModel):
        return ()
    chain = replace(data.chain, history=replace(data.chain.history, force=True))
    n = chain.history.input_mm.size
    forces = [chain.stacked(explanation.values)[-n:] for explanation in alternatives]
    largest = float(np.max(np.abs(forces[0])))
    apart = [float(np.sqrt(np.mean((force - forces[0]) ** 2))) for force in forces[1:]]
    told = ["+".join(e.names) for e, by in zip(alternatives[1:], apart, strict=True) if by > SEEN * largest]
    if not told:
        return ()
    least = min(by for by in apart if by > SEEN * largest)
    return (
        f"measure force_n too: {'+'.join(alternatives[0].names)} differs from {', '.join(told)} "
        f"by {least:.2g} N (RMS) of {largest:.2g} N.",
    )


# Sentence on an offset within one step of the encoder, which may be the encoder's own zero.


def encoder_zero(answered: Answer) -> tuple[str, ...]:
    """Sentence on the zero of the encoder, if an offset of less than one step is named, or remains without a name.

    An encoder reads the distance from its own first line, which may lie anywhere within a step. The motion across many
    lines shows by how much the record is off in all; it does not show whether the encoder or the stage is the cause.
    """
    history, best = answered.data.chain.history, answered.found.best
    step_mm = history.input_step_mm
    if step_mm == 0.0 or (answered.data.position_map is not None):
        return ()
    about = f"one step of the encoder ({1e3 * step_mm:.3g} um)"
    named = [name for name, effect in catalogue().items() if effect.like_wrong_zero and name in best.names]
    if named:
        changed_mm = answered.data.chain.stacked({name: best.values[name] for name in named})
        size_mm = _of_input(answered, changed_mm - answered.data.chain.stacked({}))[0]
        if abs(size_mm) > step_mm:
            return ()
        return (
            f"{' and '.join(named)}, {1e3 * size_mm:+.2g} um of input, cannot be distinguished from the encoder's own "
            f"zero, because the offset is smaller than {about}: unless the encoder was referenced, add "
            f"{1e3 * step_mm / np.sqrt(12.0):.2g} um of input to its standard uncertainty as a property of the stage.",
        )
    size_mm, u_mm = _of_input(answered, answered.data.stacked_mm - answered.data.chain.stacked(best.values))
    if abs(size_mm) > step_mm:
        return ()
    found = (
        f" (here {1e3 * size_mm:+.2g} um, U = {1e3 * COVERAGE_FACTOR * u_mm:.2g} um, on average over the table)"
        if abs(size_mm) > COVERAGE_FACTOR * u_mm
        else ""
    )
    return (
        f"an offset of the input below {about} cannot be distinguished from the encoder's own zero, and is not "
        f"named{found}.",
    )


def _of_input(answered: Answer, change_mm: Array) -> tuple[float, float]:
    """Offset of the input (mm) that causes a change of the gap, by generalised least squares, and its uncertainty."""
    problem, chain = answered.found.problem, answered.data.chain
    offsets, whitener = problem.offsets, problem.whitener
    # The offsets of the runs are the quantity itself here, and are not fitted.
    metric = offsets.metric((0.0,) * offsets.channels)
    columns = whitener.columns(np.stack([chain.slope, change_mm], axis=1))[0]
    slope, change = columns.T
    bent = offsets.beside(slope, metric)
    normal = float(bent @ slope)
    return float(bent @ change) / normal, normal**-0.5


# Describe a stage that rests away from its commanded position: the dead band of a servo.

BY_CHANCE = 1e-3
"""Significance level: probability of the observed sides of rest if they did not depend on the side of approach."""
SHORT_SHARE = 0.8
"""Share of holds that must end short of the command: a stage that comes to rest on both sides has no dead band."""
FEWEST_IDLE = 2
"""Least number of steps without a response: a single one may be a wrong row."""
AT_REST = 3.0
"""Ratio of the distance from the command to the motion within the settled half of a hold, below which the stage is
still on its way: an exponential approach covers half of its remaining distance in that time."""
SIGMAS = 4.0
"""Distance, in standard errors of the means of two holds, above which the stage followed a step."""


def dead_band_hint(data: Observations, before_mm: Array, verdict: Verdict) -> tuple[str, ...]:
    """Sentence that the stage rests within a band about its commands, if the diagnosis found no effect for it.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    before_mm : ndarray of float, shape (channels * n,)
        Measured minus predicted by the given model.
    verdict : Verdict
        Result of the diagnosis.
    """
    history = data.chain.history
    if verdict is not Verdict.UNKNOWN or not history.commanded:
        return ()
    gap = data.chain.stacked({})[: history.input_mm.size]
    words = band_words(history, gap, before_mm[: history.input_mm.size])
    return () if words is None else (words,)


def band_words(history: History, gap_of_input_mm: Array, residual_mm: Array) -> str | None:
    """Describe where the stage rests after each step of a command; None if there is no dead band.

    A servo with a dead band stops short of its command, on the side from which it came, or does not answer small steps.
    The mean over all holds is subtracted, because an offset is no dead band.

    Parameters
    ----------
    history : History
        Commands.
    gap_of_input_mm, residual_mm : ndarray of float, shape (n,)
        Gap that the model predicts for the commands, and measured minus predicted gap.
    """
    slope = float(np.polyfit(history.input_mm, gap_of_input_mm, 1)[0])
    steps, rests, answers, errors, creeps = _holds(
        history, residual_mm / (slope or 1.0), gap_of_input_mm / (slope or 1.0)
    )
    if steps.size < LEAST_HOLD:
        return None
    followed = np.abs(answers) > SIGMAS * errors
    idle = np.abs(steps[~followed])
    words = []
    if idle.size >= FEWEST_IDLE and float(idle.max()) < float(np.min(np.abs(steps[followed]), initial=np.inf)):
        words.append(f"{idle.size} steps of up to {idle.max():.2g} mm had no response, but all larger steps had")
    away = (rests - rests.mean())[followed] * np.sign(steps[followed])
    short = int(np.sum(away < 0.0))
    chance = float(bdtrc(short - 1, away.size, 0.5)) if away.size else 1.0
    band = float(np.median(-away[away < 0.0])) if short else 0.0
    still = AT_REST * float(np.median(np.abs(creeps[followed]))) if away.size else 0.0
    if chance < BY_CHANCE and short >= SHORT_SHARE * away.size and band > still:
        words.append(
            f"after {short} of {away.size} steps the stage stopped short of the command, on the side from which it "
            f"came, by {band:.2g} mm (median)"
        )
    if not words:
        return None
    return f"the stage comes to rest away from its commands, like a servo with a dead band: {'; '.join(words)}."


def _holds(history: History, error_mm: Array, path_mm: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Steps of the command with the settled halves of the holds before and after them; each of shape (k,), in mm.

    Returns
    -------
    steps, rests, answers, errors, creeps : ndarray of float
        Height of the step; settled distance from the command after it; change of the settled position; standard error
        of this change; change of the position from the third to the last quarter of the hold.
    """
    out: list[tuple[float, float, float, float, float]] = []
    for run in history.runs:
        for one, other in pairwise(settled_halves(history.input_mm, run)):
            if min(one.stop - one.start, other.stop - other.start) < LEAST_HOLD // 2:
                continue
            step = float(history.input_mm[other.start] - history.input_mm[one.start])
            place = [path_mm[part] + error_mm[part] for part in (one, other)]
            scatter = float(np.sqrt(sum(np.var(part, ddof=1) / part.size for part in place)))
            answer = float(place[1].mean() - place[0].mean())
            middle = place[1].size // 2
            creep = float(place[1][middle:].mean() - place[1][:middle].mean()) if middle else 0.0
            out.append((step, float(error_mm[other].mean()), answer, scatter, creep))
    columns = np.array(out).reshape(-1, 5)
    return columns[:, 0], columns[:, 1], columns[:, 2], columns[:, 3], columns[:, 4]


MEMBERS_SEPARATED = 5
"""Number of explanations, best first, that the next run is designed to separate; the computing time grows with its
square."""

LOOKED_AT = 1
"""Seed for the regions of the remaining residual, so that the draws for the next run stay those of the diagnosis."""
RUNNERS_UP = 8
"""Number of single effects, best first, that a report lists in addition to its result."""


def diagnosis_report(
    answered: Answer,
    posterior: tuple[Point, ...],
    mistake: str | None,
    forced: frozenset[str],
    rng: np.random.Generator,
    begin_s: float,
) -> DiagnosisReport:
    """Compose the report of a result, with its evidence and the next run.

    Parameters
    ----------
    answered : Answer
        Findings, and the remaining share of the disagreement.
    posterior : tuple of dict
        Posterior draws of the best explanation's parameters, for predicting the next run.
    mistake : str or None
        Mistake found in the table itself.
    forced : frozenset of str
        Effects that the user requires.
    rng : numpy.random.Generator
        Generator of the bootstrap.
    begin_s : float
        Start time of the diagnosis, on the clock of `time.perf_counter`.
    """
    data, found, stands = answered.data, answered.found, answered.stands
    best, mapped = found.best, data.position_map is not None
    decided, unknown = verdict(found, mapped=mapped, stands=stands)
    disagreement = _disagreement(answered)
    rows = outlier_rows(data, found.problem, answered.after_mm, stands.left_out)
    effects = _named(data, found, posterior)
    errors = data.measured_pure_errors(np.split(found.problem.whitener.aside, len(data.channels)))
    members = tuple(e for e in found.alternatives if e.names)
    alternatives = tuple(_with_map(e.names, mapped=mapped) for e in members) or (((NAME,),) if mapped else ())
    proposal = next_run(data, found.problem, list(members[:MEMBERS_SEPARATED]), posterior, rng)
    mistaken = mistake is not None
    harmonic = strongest_harmonic(found.problem, best)
    left = places(data, found.problem, answered.after_mm, np.random.default_rng(LOOKED_AT))
    runners_up = _runners_up(data, found)
    return DiagnosisReport(
        verdict=decided,
        sentence=answer(decided, unknown, effects, alternatives, disagreement, mistaken=mistaken),
        effects=effects,
        alternatives=alternatives,
        where=places(data, found.problem, answered.before_mm, rng),
        disagreement=disagreement,
        explained_share=stands.explained_share,
        standing_share=stands.share,
        pure_error_mm=None if errors is None else errors[0].sd_mm,
        smallest_seen=found.smallest,
        unknown=unknown,
        remaining=remaining(stands, found.left_over, "" if harmonic is None else harmonic.words, best.sigma_mm),
        next_run=proposal,
        excluded=tuple({"name": name, "reason": reason} for name, reason in data.excluded.items()),
        outliers=outliers(data, found.problem, rows, answered.after_mm),
        outlier_rows=rows,
        runners_up=runners_up,
        notes=(
            *((tried(runners_up),) if decided is Verdict.UNKNOWN and not mistaken else ()),
            *required_words(data, found.problem, best, forced, mapped=mapped),
            *data.notes,
            *data.refitted(),
            *(() if mistake is None else (mistake,)),
            *_trend(errors),
            *force_hint(data, found.alternatives),
            *further_evidence(found.alternatives),
            *beyond_the_search(best, found.problem),
            *rows_beyond_model(data, best),
            *input_dominates(data, found.problem),
            *encoder_zero(answered),
            *dead_band_hint(data, answered.before_mm, decided),
        ),
        seconds=time.perf_counter() - begin_s,
        next_step=next_look(data, decided, proposal, left, mistaken=mistaken),
    )


def _runners_up(data: Observations, found: Findings) -> tuple[dict[str, object], ...]:
    """Single effects, best first, each with the share of the gap's squared disagreement that it explains alone."""
    n = data.chain.history.input_mm.size
    kept = ~found.problem.whitener.aside[:n]

    def squared(values: Settings) -> float:
        return float(np.sum((data.stacked_mm - data.chain.stacked(values))[:n][kept] ** 2))

    before = max(squared({}), 1e-300)
    return tuple(
        {
            "effects": list(e.names),
            "explained_share": float(np.clip(1.0 - squared(e.values) / before, 0.0, 1.0)),
            "chi_square_more_than_best": e.score - found.best.score,
            "distance": found.distances.get(e.names),
        }
        for e in found.singles[:RUNNERS_UP]
        if e.names != found.best.names
    )


def _disagreement(answered: Answer) -> Disagreement:
    """Disagreement without and with the named effects: over all rows, by channel, and over the rows of the verdict."""
    data, found = answered.data, answered.found
    before, after = answered.before_mm, answered.after_mm
    n, edges = data.chain.history.input_mm.size, data.chain.history.both_edges
    channels = {
        name: {
            f"before_rms_{_unit(name)}": float(np.sqrt(np.mean(a**2))),
            f"after_rms_{_unit(name)}": float(np.sqrt(np.mean(b**2))),
        }
        for (name, a), b in zip(by_channel(data, before).items(), by_channel(data, after).values(), strict=True)
    }
    unseen = left_out_rms_mm(data, found.problem, found.best)
    stands = answered.stands
    return Disagreement(
        rms_mm(before, n, edges),
        rms_mm(after, n, edges),
        stands.noise_mm,
        *unseen,
        channels,
        counted_before_rms_mm=stands.before_mm,
        counted_after_rms_mm=stands.after_mm,
        rows=n,
        rows_left_out=len(stands.left_out),
        of="edges" if edges else "gap",
    )


def _with_map(names: tuple[str, ...], *, mapped: bool) -> tuple[str, ...]:
    return tuple(name for name in catalogue() if name in names or (mapped and name == NAME))


def _trend(errors: list[PureError] | None) -> tuple[str, ...]:
    """Sentence for repeated readings that change gradually, which indicates a drift or a run-in."""
    if errors is None or not errors[0].has_trend:
        return ()
    return (
        "repeated readings at the same position drift or run in (neighbouring visits agree better than distant "
        f"visits, by {errors[0].trend_sigmas:.1f} standard deviations): this trend was subtracted from the pure error.",
    )


def _unit(channel: str) -> str:
    return "n" if channel == "force" else "mm"


def _named(data: Observations, found: Findings, posterior: tuple[Point, ...]) -> tuple[NamedEffect, ...]:
    listed = [entry for entry in found.problem.parameters(found.best.names) if entry[1].run is None]
    root = np.sqrt(np.maximum(np.diag(found.best.covariance), 0.0))
    open_ended = dict(open_parameters(found.best, found.problem))
    out = {}
    for name in found.best.names:
        known = {
            parameter.name: Estimate(
                found.best.values[name][parameter.name], float(root[i]) if root[i] > 0.0 else None, parameter.unit
            )
            for i, (owner, parameter) in enumerate(listed)
            if owner == name
        }
        if name in open_ended:
            far = draws_of(posterior, name, open_ended[name].name)
            known = {
                p.name: limited(known[p.name].value, p, draws_of(posterior, name, p.name), far)
                for owner, p in listed
                if owner == name
            }
        effect = found.problem.effects[name]
        # Parameters that these data cannot show keep their neutral value.
        still = {p.name: Estimate(p.neutral or 0.0, None, p.unit) for p in effect.parameters if p.name not in known}
        ordered = {p.name: {**known, **still}[p.name] for p in effect.parameters}
        shown = {p.name: p.words for p in (*effect.parameters, *(p for owner, p in listed if owner == name))}
        out[name] = NamedEffect(name, str(effect.stage), {**ordered, **known}, shown=shown)
    curve = data.position_map
    if curve is not None:
        described = {"rms_mm": curve.rms_mm, "length_mm": curve.length_mm}
        points = tuple(zip(curve.nodes_mm.tolist(), curve.curve_mm.tolist(), strict=True))
        entry = catalogue()[NAME]
        shown = {p.name: p.words for p in entry.parameters}
        out[NAME] = NamedEffect(NAME, str(entry.stage), described, points, shown=shown)
    return tuple(out[name] for name in catalogue() if name in out)
