"""Plausibility checks for mistakes in a table: a mirrored or rescaled column, or exchanged directions."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import binom

from fingervision.diagnosis.inference.hypothesis import FORM_SHARE, Explanation, Problem
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.replicates import resolution
from fingervision.diagnosis.noise.run_offsets import RunOffsets
from fingervision.domain.effect import Array, DriveEffect, Flags
from fingervision.effects.play_operator import play

LEAST_CORRELATION = 0.5
"""Least correlation of measured and predicted gap; below it the model does not describe the motion at all."""
LARGEST_RATIO = 3.0
"""Largest ratio of measured to predicted motion (or its inverse) before a wrong unit or model is reported: the
catalogue's scale, lever and input errors together reach 1.3 * 1.3 * 1.2 = 2.03."""
ENDS = (0.05, 0.95)
"""Quantiles of the gap whose difference is taken as its motion."""
DELAYS_S = (0.0, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0)
"""Delays at which the measured motion is compared."""
SWAPPED_SIGMAS = 6.0
"""Standard errors by which the gap must lead at reversals before exchanged directions are suspected: the residual of
any other effect leads by far less."""
SWAPPED_SHARE = 0.5
"""Least share of the squared disagreement that a leading play must explain: the rest may be due to other effects."""
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


@dataclass(frozen=True, slots=True)
class Finding:
    """A mistake in the table, as a sentence; if `blocks` is True, no effect can be named until it is corrected."""

    words: str
    blocks: bool


def gross_mistake(data: Observations) -> Finding | None:
    """Compare measured and predicted motion as a whole: sign, unit, and whether they are related at all."""
    gap, predicted = data.table.gap_mm, data.chain.respond({}).gap_mm
    if np.ptp(predicted) == 0.0:
        return None
    # Ranks and quantiles are robust against wrong rows; for a stage with a delay, several delays are tried.
    order = max((_order(gap, late) for late in _later(data)), key=abs)
    way, predicted_way = (float(np.diff(np.quantile(values, ENDS))[0]) for values in (gap, predicted))
    if order < -LEAST_CORRELATION:
        return Finding(
            "the measured gap falls where the model predicts a rise: input_mm or the gap is mirrored (its sign is "
            "wrong), or the model belongs to another test bed.",
            blocks=True,
        )
    if abs(order) < LEAST_CORRELATION:
        return Finding(
            f"the measured gap does not follow the model (rank correlation {order:.2f}): the model does not belong to "
            "these data, or most rows are wrong; check the columns first.",
            blocks=True,
        )
    ratio = way / max(predicted_way, 1e-300)
    if not 1.0 / LARGEST_RATIO < ratio < LARGEST_RATIO:
        return Finding(
            f"the measured gap moves {ratio:.3g} times as far as the model predicts: check the units of the gap and of "
            "the model (a factor of 1000 means micrometres instead of millimetres), because no effect of the "
            "catalogue is so large.",
            blocks=True,
        )
    return None


def mixed_rows(data: Observations, found: Explanation, problem: Problem) -> Finding | None:
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
    if between < SHARES[0] and binom.cdf(round(between * count), count, NORMAL_SHARE) < BY_CHANCE:
        above = residual_mm > np.mean(residual_mm)
        apart_mm = float(np.mean(residual_mm[above]) - np.mean(residual_mm[~above]))
        words = f"the residual consists of two groups about {apart_mm:.2g} mm apart"
    elif together > SHARES[1] and binom.sf(round(together * count) - 1, count, NORMAL_SHARE) < BY_CHANCE:
        words = (
            f"{100.0 * together:.0f} % of the rows agree, and the remaining rows differ from them by {sigma:.2g} mm or "
            "more"
        )
    else:
        return None
    return Finding(
        f"the rows are not one measurement with one noise: {words}; check the rows that differ first.",
        blocks=True,
    )


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


def swapped_directions(data: Observations, problem: Problem) -> Finding | None:
    """Check for play of the wrong sign: the gap leads the input at reversals instead of lagging behind."""
    history = data.chain.history if data.chain.path is None else data.chain.path.history
    rows = np.arange(history.input_mm.size) if data.chain.path is None else data.chain.path.rows
    if history.time_s is None:
        return None
    residual = problem.nothing().residual
    offsets, metric = problem.offsets, problem.offsets.metric(problem.nothing().sigma_mm)
    reach = 1e-3 * history.input_span_mm
    n = data.chain.history.input_mm.size
    low, high = (data.chain.with_input(data.chain.history.input_mm + way).stacked({}) for way in (-reach, reach))
    slope = (high - low) / (2.0 * reach)
    constant = np.ones(n)
    line = data.chain.history.input_mm - data.chain.history.input_mm.mean()
    beside = np.stack([slope * np.tile(shape, slope.size // n) for shape in (constant, line)], axis=1)
    whitened = problem.whitener.columns(beside)[0]
    alone = _without(residual, whitened, offsets, metric)
    best: tuple[float, float, float] | None = None
    for width in history.input_span_mm * np.geomspace(1e-5, 0.3, WIDTHS):
        lag = np.empty_like(history.input_mm)
        for run in history.runs:
            first = np.sign(np.diff(history.input_mm[run])[np.flatnonzero(np.diff(history.input_mm[run]))[:1]].sum())
            lag[run] = play(history.input_mm[run], width, -float(first)) - history.input_mm[run]
        column = problem.whitener.one(slope * np.tile(lag[rows], slope.size // n))
        own = _without(column, whitened, offsets, metric)
        norm = offsets.squared(own, metric)
        if norm > LEAST_NORM * max(float(column @ column), 1e-300):
            moved = own - offsets.design @ (metric @ (offsets.design.T @ own))
            coefficient = float(moved @ residual) / norm
            if best is None or coefficient**2 * norm > best[0]:
                best = coefficient**2 * norm, coefficient * width, coefficient * float(np.sqrt(norm))
    if best is None:
        return None
    gain, size_mm, sigmas = best
    stands = offsets.squared(alone, metric)
    scatter = float(np.sqrt(max((stands - gain) / max(1, residual.size), 1.0)))
    if sigmas > -SWAPPED_SIGMAS * scatter or gain < SWAPPED_SHARE * stands:
        return None
    return Finding(
        f"at reversals the gap leads the input by {1e3 * abs(size_mm):.3g} um instead of lagging behind it, which no "
        "mechanism does: are the directions swapped, or is the sign of the gap wrong?",
        blocks=True,
    )


def _without(values: Array, columns: Array, offsets: RunOffsets, metric: Array) -> Array:
    """Project whitened values off the given columns; the shape is unchanged."""
    moved = columns - offsets.design @ (metric @ (offsets.design.T @ columns))
    return np.asarray(values - columns @ np.linalg.lstsq(moved.T @ columns, moved.T @ values, rcond=1e-10)[0])


def _later(data: Observations) -> list[Array]:
    """Predicted gap for a stage without delay, and for delays up to a second."""
    late = [name for name, effect in data.effects.items() if isinstance(effect, DriveEffect) and effect.act_curved]
    if not late:
        return [data.chain.respond({}).gap_mm]
    return [data.chain.respond({late[0]: {"delay_s": delay_s}}).gap_mm for delay_s in DELAYS_S]


def _order(gap: Array, predicted: Array) -> float:
    return float(np.corrcoef(_ranks(gap), _ranks(predicted))[0, 1]) if np.ptp(predicted) > 0.0 else 0.0


def _ranks(values: Array) -> Array:
    return np.argsort(np.argsort(values, kind="stable"), kind="stable").astype(np.float64)
