"""Mistakes in a table as hypotheses beside the effects: a mirrored or rescaled column, or exchanged directions."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import bdtr, bdtrc

from fingervision.diagnosis.inference.evidence import STRONG, odds
from fingervision.diagnosis.inference.hypothesis import FORM_SHARE, Explanation, Problem
from fingervision.diagnosis.inference.search import Look
from fingervision.diagnosis.inference.search_state import Findings
from fingervision.diagnosis.inference.verdict import standing_of
from fingervision.diagnosis.input.column_mistakes import HALF, UNITS, exchanged_gap_mm
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.replicates import resolution
from fingervision.diagnosis.noise.run_offsets import WhitenedColumns
from fingervision.domain.effect import Array, Flags
from fingervision.effects.play_operator import play

LARGEST_RATIO = 2.03
"""Largest ratio of measured to predicted motion (or its inverse) that effects may cause, where none was fitted: the
catalogue's scale, lever and input errors together reach 1.3 * 1.3 * 1.2."""
LEAST_NORM = 1e-6
"""Least share of a play's shape that remains after fitting an offset and a ratio, so that the play is distinguishable
from these."""
WIDTHS = 25
"""Number of widths of the play that are tried."""


NARROW = 0.25
"""Standard deviations about zero within which values are counted: normal noise has 20 % there, Laplace's 30 %,
Student's with three degrees of freedom 31 %, a sinusoid 11 %."""
SHARES = (0.05, 0.4)
"""Share of values within `NARROW` below which the values form two groups, and share above which most values repeat far
better than the rest. No single noise distribution named above has such shares."""
FEW = 0.02
"""Share of the values that are too few for a mixture of right and wrong rows: 4 of 249 rows before a delayed motion had
begun made most others seem to agree far better than the rest."""
STRETCH_SIGMAS = 3.0
"""Significance, in standard deviations of 1 / sqrt(n), of the correlation of neighbouring rows above which rows lie in
stretches. A servo, for example, repeats far better at rest than in motion; such rows are not wrong."""
FEWEST_VALUES = 30
"""Least number of values with which such a share can be distinguished from that of normal noise (`BY_CHANCE`)."""
NORMAL_SHARE = 0.2
"""Share of normal values within `NARROW` standard deviations."""
BY_CHANCE = 1e-3
"""Probability of such an extreme count under normal noise above which the count is attributed to chance: in 42 rows of
one noise, rounded to a quarter of the noise, 40 % agreed by chance (probability 0.002)."""


UNRELATED = (
    "the measured gap does not follow the input at all: check which columns hold the input and the gap, and whether "
    "they belong to the same measurement."
)
"""Question about a gap that has nothing to do with the input."""


EXCHANGED = (
    "the columns of input and gap fit the model far better if they are exchanged: check which of them holds the input, "
    "and whether the model belongs to this measurement."
)
"""Question about exchanged columns."""
ONE_KIND = 2.0 * float(np.log(4.0))
"""-2 log of the prior probability of a kind of mistake (`_choice`)."""


def mistaken_column(data: Observations, problem: Problem, rivals: Sequence[Explanation]) -> str | None:
    """Ask about sign or unit of a column, if that alone explains the table far better than any physical explanation.

    A mistaken column is a hypothesis beside the effects: the gap follows the model with a gain of -1, of a ratio of
    units, or of any other size, or the columns of input and gap are exchanged, and no effect acts. It is asked about if
    it leaves less than half of the variance and if its odds against the most probable explanation by effects are 20 to
    1 or more. How large a gain effects may cause is part of these odds, by the physical priors of their parameters. A
    gain of 0 is a gap that has nothing to do with the input.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    problem : Problem
        Estimation problem with its noise.
    rivals : sequence of Explanation
        Explanations by effects, and the model without effects. If there is none but the latter, only gains are asked
        about that no effect has; a delay, for example, can mirror a motion. Effects that leave as much of the gap as a
        mistake may not leave either explain no gap: an end stop that holds a model in micrometres nearly still.
    """
    units = [each for unit in UNITS for each in (unit, 1.0 / unit)]
    gains = [(gain, 0) for gain in (0.0, -1.0, *units, *(-each for each in units))]
    free = _free_gain(data, problem)
    gains += [] if free is None else [(free, 1)]
    if not any(rival.names for rival in rivals):
        gains = [each for each in gains if each[0] > 0.0 and not 1.0 / LARGEST_RATIO < each[0] < LARGEST_RATIO]
    able = [each for each in gains if _leaves_less(data, problem, each[0] * _moved(data))]
    tried = [(_cost(data, problem, gain * _moved(data), free) + _choice(gain), _asked(gain)) for gain, free in able]
    following = _exchanged(data)
    if following is not None and _leaves_less(data, problem, following):
        tried.append((_cost(data, problem, following, 0) + ONE_KIND, EXCHANGED))
    if not tried:
        return None
    cost, asked = min(tried)
    explaining = [each for each in rivals if not each.names or _explains(data, problem, each)]
    return asked if cost < _physical(problem, explaining) - STRONG else None


def mistaken_beside_effects(data: Observations, found: Findings, look: Look) -> str | None:
    """Ask about sign or unit of a column, if the corrected table is explained far better than the table as it is.

    A stage that lags by a quarter of its motion hides that its gap is in inches: no gain alone explains half of it, and
    a speed limit at a fraction of the speed, with another rest gap, imitates it. The table is corrected by a gain and
    searched for effects, like the table itself; the odds of the two are compared. This is done if the table as it is
    remains unexplained, or if its gap moves by more or less than effects cause where no gain was fitted.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    found : Findings
        Findings of the search of the table as it is.
    look : Look
        Settings of the search of the corrected table.
    """
    problem, n = found.problem, data.chain.history.input_mm.size
    kept = ~problem.whitener.aside[:n]
    moved = float(np.std(_moved(data)[:n][kept]))
    ratio = float(np.std(data.table.gap_mm[kept])) / moved if moved > 0.0 else 0.0
    plausible = 1.0 / LARGEST_RATIO < ratio < LARGEST_RATIO
    if not ratio or (plausible and found.unknown is None and standing_of(data, found).is_little):
        return None
    size = _nearest_unit(ratio)
    nothing = np.zeros_like(data.stacked_mm)
    tried = [(_cost(data, problem, nothing, 0) + _choice(0.0), 0.0)] if _leaves_less(data, problem, nothing) else []
    for gain in (-size,) if plausible else (size, -size):
        best = look.again(_corrected(data, gain)).found
        changed = data.chain.stacked(best.best.values) - data.chain.stacked({})
        changed[:n] *= gain
        following = gain * _moved(data) + changed
        if _leaves_less(data, problem, following):
            price = odds(best.problem, best.best) - best.best.score + _choice(gain)
            tried.append((_cost(data, problem, following, abs(gain) == ratio) + price, gain))
    explaining = [e for e in (found.nothing, found.nearest, found.best, *found.singles) if _explains(data, problem, e)]
    rival = _physical(problem, [found.nothing, *explaining])
    return _asked(min(tried)[1]) if tried and min(tried)[0] < rival - STRONG else None


def _nearest_unit(ratio: float) -> float:
    """The ratio of units that differs from a ratio by no more than effects cause, or else the ratio itself."""
    near = min((1.0, *UNITS, *(1.0 / unit for unit in UNITS)), key=lambda unit: abs(np.log(ratio / unit)))
    return near if 1.0 / LARGEST_RATIO < ratio / near < LARGEST_RATIO else ratio


def _corrected(data: Observations, gain: float) -> Observations:
    """Return the observations with a gap that moves by the inverse of a gain as far, about its mean."""
    n = data.chain.history.input_mm.size
    middle_mm = float(np.mean(data.chain.stacked({})[:n]))
    gap_mm = middle_mm + (data.table.gap_mm - np.mean(data.table.gap_mm)) / gain
    known = data.table.u_random_mm
    table = replace(data.table, gap_mm=gap_mm, u_random_mm=None if known is None else known / abs(gain))
    stacked = np.concatenate([gap_mm, data.stacked_mm[n:]])
    return replace(data, table=table, stacked_mm=stacked, position_map=None, run_gains=None)


def _choice(gain: float) -> float:
    """-2 log of the prior probability of a mistake.

    Four kinds are equally likely beforehand: a column of something else, a sign, exchanged columns, and one of many
    ratios.
    """
    return ONE_KIND + (0.0 if gain in (0.0, -1.0) else 2.0 * float(np.log(4.0 * len(UNITS))))


def _asked(gain: float) -> str:
    """The question about a column whose gap moves by a gain as far as the model."""
    if gain == 0.0:
        return UNRELATED
    if gain < 0.0:
        far = "" if gain == -1.0 else f", and {-gain:.3g} times as far"
        return (
            f"the measured gap falls where the model predicts a rise{far}: input_mm or the gap is mirrored (its sign "
            "is wrong), or the model belongs to another test bed."
        )
    return (
        f"the measured gap moves {gain:.3g} times as far as the model predicts: check the units of the gap, the "
        "input and the model (a factor of 1000 means micrometres instead of millimetres, 25.4 means inches), "
        "because effects of the catalogue are hardly so large."
    )


def _physical(problem: Problem, rivals: Sequence[Explanation]) -> float:
    """-2 log odds of the most probable explanation by effects, at a noise whose level is unknown."""
    return min(_at_any_noise(problem, rival.score) + odds(problem, rival) - rival.score for rival in rivals)


def _at_any_noise(problem: Problem, score: float) -> float:
    """-2 log of the likelihood, integrated over the level of the noise.

    The noise was estimated from what the effects leave, and may contain the mistake.
    """
    return problem.rows * float(np.log(max(score, 1e-300) / problem.rows))


def _moved(data: Observations) -> Array:
    """Predicted motion about the mean of each channel, shape (channels * n,); zero for a force."""
    parts = data.chain.stacked({}).reshape(-1, data.chain.history.input_mm.size).copy()
    parts -= parts.mean(axis=1, keepdims=True)
    if data.chain.history.force:
        parts[-1] = 0.0
    return parts.ravel()


def _exchanged(data: Observations) -> Array | None:
    """Motion of each channel about its mean if input and gap are exchanged; None if the model does not allow it.

    The recorded gap is then the input, which the other channels follow.
    """
    gap_mm, input_mm = data.table.gap_mm, data.chain.history.input_mm
    following_mm = exchanged_gap_mm(data.model.base, data.model.input_range_mm, input_mm, gap_mm)
    if following_mm is None:
        return None
    parts = [following_mm]
    parts += [data.model.base.respond(gap_mm).midline_mm] if data.chain.history.both_edges else []
    parts += [np.zeros_like(gap_mm)] if data.chain.history.force else []
    return np.concatenate([part - part.mean() for part in parts])


def _constants(data: Observations, problem: Problem) -> Array:
    """Whitened constant of each channel, shape (channels * n, channels)."""
    channels = data.stacked_mm.size // data.chain.history.input_mm.size
    columns: Array = np.kron(np.eye(channels), np.ones((data.chain.history.input_mm.size, 1))).astype(np.float64)
    return problem.whitener.columns(columns)[0]


def _beside_constants(data: Observations, problem: Problem, values: Array) -> Array:
    """Project the constants of the channels off a column, which is then whitened."""
    constants, whitened = _constants(data, problem), problem.whitener.one(values)
    return np.asarray(whitened - constants @ np.linalg.lstsq(constants, whitened, rcond=1e-10)[0])


def _free_gain(data: Observations, problem: Problem) -> float | None:
    """Ratio of measured to predicted motion, by least squares; None if the model does not move."""
    column = _beside_constants(data, problem, _moved(data))
    power = float(column @ column)
    return float(column @ _beside_constants(data, problem, data.stacked_mm)) / power if power > 0.0 else None


def _cost(data: Observations, problem: Problem, following_mm: Array, fitted: int) -> float:
    """BIC of a gap that follows a curve, with `fitted` numbers; the constant of each channel is fitted."""
    residual = _beside_constants(data, problem, data.stacked_mm - following_mm)
    sigma, penalty = problem.offsets.spread(residual)
    free = fitted + data.stacked_mm.size // data.chain.history.input_mm.size
    score = problem.offsets.squared(residual, problem.offsets.metric(sigma)) + penalty
    return _at_any_noise(problem, score) + free * float(np.log(max(2, residual.size)))


def _leaves_less(data: Observations, problem: Problem, following_mm: Array) -> bool:
    """Whether a curve leaves less than half of the variance of the disagreement and, unless it is 0, of the gap."""
    n = data.chain.history.input_mm.size
    kept = ~problem.whitener.aside[:n]
    gap, moved, following = data.table.gap_mm[kept], _moved(data)[:n][kept], following_mm[:n][kept]
    left, disagreement, all_of_it = (float(np.var(each)) for each in (gap - following, gap - moved, gap))
    return left < HALF * (min(disagreement, all_of_it) if following.any() else disagreement)


def _explains(data: Observations, problem: Problem, found: Explanation) -> bool:
    """Whether effects leave less than half of the variance of the measured gap."""
    n = data.chain.history.input_mm.size
    kept = ~problem.whitener.aside[:n]
    left = (data.stacked_mm - data.chain.stacked(found.values))[:n][kept]
    return float(np.var(left)) < HALF * float(np.var(data.stacked_mm[:n][kept]))


def mixed_rows(data: Observations, found: Explanation, problem: Problem) -> str | None:
    """Check whether the residual has one noise level: a mixture of right and wrong rows would have two levels.

    Parameters
    ----------
    data : Observations
        Measurement and model.
    found : Explanation
        The answer.
    problem : Problem
        Estimation problem with its noise; gross errors that were set aside do not count.
    """
    n = data.chain.history.input_mm.size
    kept = ~problem.whitener.aside[:n]
    # A run that was zeroed anew differs by a constant, which is no second level of noise.
    left_mm, whitened = (data.stacked_mm - data.chain.stacked(found.values))[:n], found.residual[:n]
    residual_mm = _about_each_run(left_mm, data, kept)
    if residual_mm.size < FEWEST_VALUES or data.position_map is not None or data.run_gains is not None:
        return None
    sigma = float(np.std(residual_mm))
    explained_mm = float(np.std((data.chain.stacked(found.values) - data.chain.stacked({}))[:n]))
    # What a formula typically misses is larger while the stage moves than while it rests.
    if sigma < FORM_SHARE * explained_mm:
        return None
    # If the digits of the readings are coarser than the band, either all values or none lie in it.
    if NARROW * sigma < resolution(data.table.gap_mm):
        return None
    both = (residual_mm, _about_each_run(whitened, data, kept))
    between = max(_share_near(values, float(np.mean(values))) for values in both)
    together = min(_share_near(values, float(np.median(values))) for values in map(_without_few, both))
    if data.chain.history.time_s is not None and any(_in_stretches(values) for values in both):
        return None
    count = residual_mm.size
    if between < SHARES[0] and bdtr(round(between * count), count, NORMAL_SHARE) < BY_CHANCE:
        above = residual_mm > np.mean(residual_mm)
        apart_mm = float(np.mean(residual_mm[above]) - np.mean(residual_mm[~above]))
        words = f"the residual consists of two groups about {apart_mm:.2g} mm apart"
    elif together > SHARES[1] and bdtrc(round(together * count) - 1, count, NORMAL_SHARE) < BY_CHANCE:
        words = (
            f"{100.0 * together:.0f} % of the rows agree, and the remaining rows differ from them by {sigma:.2g} mm or "
            "more"
        )
    else:
        return None
    return f"the rows are not one measurement with one noise: {words}; check the rows that differ first."


def _about_each_run(values: Array, data: Observations, kept: Flags) -> Array:
    """Kept values, shape (n,), minus the mean of each run."""
    out = values.copy()
    for run in data.chain.history.runs:
        inside = values[run][kept[run]]
        out[run] -= inside.mean() if inside.size else 0.0
    return out[kept]


def _without_few(values: Array) -> Array:
    """Values without the `FEW` farthest from the median, such as the rows before a delayed motion has begun."""
    apart = np.abs(values - np.median(values))
    return np.asarray(values[apart <= np.quantile(apart, 1.0 - FEW)])


def _in_stretches(values: Array) -> bool:
    """Whether rows near the median are neighbours, as for a stage that moves and rests; wrong rows are scattered."""
    near = (np.abs(values - np.median(values)) < NARROW * np.std(values)).astype(np.float64)
    near -= near.mean()
    power = float(near @ near)
    return power > 0.0 and float(near[:-1] @ near[1:]) / power > STRETCH_SIGMAS / float(np.sqrt(near.size))


def _share_near(values: Array, middle: float) -> float:
    """Share of values within `NARROW` standard deviations of a middle."""
    return float(np.mean(np.abs(values - middle) < NARROW * float(np.std(values))))


def swapped_directions(data: Observations, problem: Problem, rivals: Sequence[Explanation]) -> str | None:
    """Ask about play of the wrong sign, by which the gap leads the input at reversals, if no effect explains as much.

    Exchanged directions are a hypothesis beside the effects: a leading play, with an offset and a ratio, must explain
    half of the disagreement, and its odds against the most probable explanation by effects must be 20 to 1 or more.
    """
    history, rows = data.chain.along.history, data.chain.along.rows
    if history.time_s is None:
        return None
    nothing = problem.nothing()
    residual, metric = nothing.residual, problem.offsets.metric(nothing.sigma_mm)
    n, slope = data.chain.history.input_mm.size, data.chain.slope
    constant = np.ones(n)
    line = data.chain.history.input_mm - data.chain.history.input_mm.mean()
    beside = np.stack([slope * np.tile(shape, slope.size // n) for shape in (constant, line)], axis=1)
    widths = history.input_span_mm * np.geomspace(1e-5, 0.3, WIDTHS)
    lags = np.empty((history.input_mm.size, WIDTHS))
    for run in history.runs:
        moves = np.diff(history.input_mm[run])
        first = float(np.sign(moves[np.flatnonzero(moves)[:1]].sum()))
        for k, width in enumerate(widths.tolist()):
            lags[run, k] = play(history.input_mm[run], width, -first) - history.input_mm[run]
    own, lines = (problem.whitener.columns(each)[0] for each in (
        slope[:, None] * np.tile(lags[rows], (slope.size // n, 1)), beside))  # fmt: skip
    tried = WhitenedColumns(own, problem.offsets)
    dot, norm = tried.against(residual, metric, lines)
    told = norm > LEAST_NORM * np.maximum(tried.squares, 1e-300)
    # A swapped play leads by its whole width at most: the loop of a friction damper is larger.
    size = np.where(told, np.clip(dot / np.where(told, norm, 1.0), -1.0, 0.0), 0.0)
    gains = size * (2.0 * dot - size * norm)
    best = int(np.argmax(gains))
    gain, size_mm = float(gains[best]), float(size[best] * widths[best])
    stands = float(WhitenedColumns(residual[:, None], problem.offsets).against(residual, metric, lines)[1][0])
    # Four numbers are fitted: offset and ratio, size and width of the play.
    cost = (
        _at_any_noise(problem, stands - gain)
        + 4.0 * float(np.log(residual.size))
        + 2.0 * float(np.log(len(problem.effects)))
    )
    if gain < HALF * stands or cost > _physical(problem, rivals) - STRONG:
        return None
    return (
        f"at reversals the gap leads the input by {1e3 * abs(size_mm):.3g} um instead of lagging behind it, which no "
        "mechanism does: are the directions swapped, or is the sign of the gap wrong?"
    )
