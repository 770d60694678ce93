"""Find where measurement and model disagree: regions whose residual is more than noise, each described once."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Problem
from fingervision.diagnosis.input.observations import Observations
from fingervision.diagnosis.noise.noise_model import Noise
from fingervision.domain.effect import Array, Flags, History
from fingervision.domain.report import Place

BINS = 16
"""Number of parts of each variable's range: regions are found in these parts, then their ends are refined within
parts."""
ENDS = 200
"""Number of positions that are tried for each end of a region."""
DRAWS, QUANTILE = 200, 0.99
"""Number of draws of noise, and quantile of their maximum: a region is reported in one table of noise in a hundred."""
MOST = 8
"""Most regions reported; the residual after these is too small to be localised."""
SMALL = 0.05
"""Significance relative to that of the first region below which a region is an artefact of the first one's
subtraction."""
BEYOND_DOUBT = 10.0
"""Standard deviations above which a sentence does not state them: the tails of no noise are known so far, and the size
in mm says more about a systematic difference."""
NEAR = 0.85
"""Significance relative to the largest above which regions count as equally significant: the simplest of them is
reported."""
SHARES = {
    "gap": {"gap": 1.0, "left": -0.5, "right": 0.5},
    "midline": {"midline": 1.0, "left": 1.0, "right": 1.0},
    "left": {"left": 1.0, "gap": -1.0, "midline": 0.5},
    "right": {"right": 1.0, "gap": 1.0, "midline": 0.5},
    "force": {"force": 1.0},
}
"""Effect of a shift of one channel on the others, simplest channel first."""


@dataclass(frozen=True, slots=True, eq=False)
class Axis:
    """A variable over which the residual is examined: name, unit, values, and the samples in each part of its range."""

    name: str
    unit: str
    values: Array
    parts: tuple[np.ndarray[tuple[int], np.dtype[np.intp]], ...]

    def scores(self, residual: Array, sd: float) -> Array:
        """Sum of the residual over each part of the range, divided by its standard deviation."""
        return np.array([residual[p].sum() / (sd * np.sqrt(p.size)) for p in self.parts])

    def inside(self, residual: Array, first: int, last: int) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
        """Samples from part `first` to part `last` of the range, with the ends chosen to maximise the sum."""
        order = np.concatenate(self.parts)
        total = np.concatenate([[0.0], np.cumsum(residual[order])])
        bounds = np.concatenate([[0], np.cumsum([p.size for p in self.parts])])
        begin, end = (
            np.unique(np.linspace(bounds[max(0, k - 1)], bounds[min(k + 1, len(self.parts))], ENDS).astype(np.intp))
            for k in (first, last + 1)
        )
        length = end[None, :] - begin[:, None]
        sums = np.where(length > 0, np.abs(total[end] - total[begin][:, None]) / np.sqrt(np.maximum(length, 1)), 0.0)
        i, j = np.unravel_index(np.argmax(sums), sums.shape)
        return np.asarray(order[begin[i] : end[j]])


def _scan(score: Array) -> tuple[Array, Array, Array]:
    """Largest absolute sum of a residual over a contiguous stretch, in standard deviations, and that stretch."""
    n = score.shape[-1]
    total = np.concatenate([np.zeros((*score.shape[:-1], 1)), np.cumsum(score, axis=-1)], axis=-1)
    first, end = np.triu_indices(n + 1, 1)
    sums = np.abs(total[..., end] - total[..., first]) / np.sqrt(end - first)
    best = np.argmax(sums, axis=-1)
    return np.max(sums, axis=-1), first[best], end[best] - 1


def _axes(history: History, aside: Flags) -> list[Axis]:
    """Variables: input (both directions, opening, closing), time and speed, the simplest first."""
    n = history.input_mm.size
    variables: list[tuple[str, str, Array, Flags]] = [("input", "mm", history.input_mm, np.ones(n, dtype=bool))]
    if history.time_s is not None:
        speed = history.rate_of(history.input_mm)
        still = 0.05 * np.max(np.abs(speed))
        variables += [
            ("input, opening", "mm", history.input_mm, speed > still),
            ("input, closing", "mm", history.input_mm, speed < -still),
        ]
        if history.shared_clock:
            variables.append(("time", "s", history.clock_s, np.ones(n, dtype=bool)))
        variables.append(("speed", "mm/s", speed, np.ones(n, dtype=bool)))
    axes = []
    for name, unit, values, used in variables:
        rows = np.flatnonzero(used & ~aside)
        if rows.size >= 4 and np.ptp(values[rows]) > 0.0:
            order = rows[np.argsort(values[rows], kind="stable")]
            axes.append(Axis(name, unit, values, tuple(np.array_split(order, min(BINS, order.size)))))
    return axes


def _rounded(value: float, axis: Axis) -> float:
    """Round a position on an axis to a ten-thousandth of the range; smaller differences are artefacts of smoothing."""
    decimals = 4 - int(np.floor(np.log10(float(np.ptp(axis.values)))))
    return round(value, decimals) + 0.0


def _words(place: Place, axis: Axis, everywhere: bool, runs: str) -> str:
    if everywhere:
        span = "everywhere"
    elif place.start == place.end:
        span = f"at {_rounded(place.start, axis):.3g} {axis.unit}"
    else:
        span = f"between {_rounded(place.start, axis):.3g} and {_rounded(place.end, axis):.3g} {axis.unit}"
    what = ("larger", "smaller") if place.channel in ("gap", "force") else ("farther right", "farther left")
    doubt = f", {place.sigma:.0f} sigma" if place.sigma < BEYOND_DOUBT else ""
    return (
        f"over the {axis.name}, {span}, the {place.channel} is {abs(place.size):.3g} {place.unit} "
        f"{what[0] if place.size > 0.0 else what[1]} than simulated{doubt}{runs}"
    )


def _standard_deviations(noises: Mapping[str, Noise]) -> dict[str, float]:
    """Standard deviation of one sample within a mean of many, per channel; correlated noise averages out less."""
    out = {}
    for channel, noise in noises.items():
        stretch = (1.0 + noise.correlation) / (1.0 - noise.correlation)
        out[channel] = float(np.sqrt(noise.white_mm**2 + noise.correlated_mm**2 * stretch))
    if "midline" in out:
        out["left"] = out["right"] = float(np.hypot(0.5 * out["gap"], out["midline"]))
    return out


def where(
    residual_mm: Mapping[str, Array],
    noises: Mapping[str, Noise],
    history: History,
    aside: Flags,
    rng: np.random.Generator,
) -> tuple[Place, ...]:
    """Find the regions over input, time and speed whose residual is more than noise.

    The input is examined in both directions together, and for opening and closing separately. A disagreement is visible
    in several channels and over several variables. Each disagreement is reported where it is most significant, then
    subtracted from all channels, and the remainder is searched again.

    Parameters
    ----------
    residual_mm : dict of ndarray of float, shape (n,)
        Measured minus predicted, by channel.
    noises : dict of Noise
        Noise of the gap and, if measured, of midline and force.
    history : History
        Input and times.
    aside : ndarray of bool, shape (n,)
        Outliers.
    rng : numpy Generator
        Generator for the threshold of the maximum over all stretches.
    """
    axes = _axes(history, aside)
    sd = _standard_deviations(noises)
    rest = {channel: residual_mm[channel].copy() for channel in SHARES if channel in residual_mm}
    null = _scan(rng.standard_normal((DRAWS, len(axes) * len(rest), BINS)))[0]
    # One threshold applies to the largest value of all channels and variables, so that a table without a disagreement
    # has no region.
    limit = float(np.quantile(null.max(axis=1), QUANTILE)) if axes else np.inf
    places: list[Place] = []
    while len(places) < MOST:
        found: list[tuple[str, Axis, float, int, int]] = []
        for channel in rest:
            for axis in axes:
                largest, begin, end = _scan(axis.scores(rest[channel], sd[channel]))
                found.append((channel, axis, float(largest), int(begin), int(end)))
        sharpest = max((entry[2] for entry in found), default=0.0)
        if sharpest <= max(limit, SMALL * places[0].sigma if places else 0.0):
            break
        channel, axis, sigma, first, last = next(entry for entry in found if entry[2] >= NEAR * sharpest)
        inside = axis.inside(rest[channel], first, last)
        size = float(np.mean(rest[channel][inside]))
        low, high = float(axis.values[inside].min()), float(axis.values[inside].max())
        of = len(history.runs)
        runs = sum(bool(np.isin(np.arange(run.start, run.stop), inside).any()) for run in history.runs)
        among = "" if of == 1 else ", in all runs" if runs == of else f", in {runs} of {of} runs"
        place = Place(channel, axis.name, low, high, size, "N" if channel == "force" else "mm", sigma, "")
        everywhere = inside.size == sum(p.size for p in axis.parts)
        places.append(replace(place, words=_words(place, axis, everywhere, among)))
        for other, share in SHARES[channel].items():
            if other in rest:
                rest[other][inside] -= share * size
    return tuple(places)


# Split a residual into its channels, and find the regions where it is more than noise.


def by_channel(data: Observations, stacked: Array) -> dict[str, Array]:
    """Split a stacked residual into gap and, if they were measured, left, right and midline."""
    n = data.chain.history.input_mm.size
    gap = stacked[:n]
    out = {"gap": gap}
    if data.chain.history.both_edges:
        midline = stacked[n : 2 * n] - np.median(stacked[n : 2 * n])
        out |= {"left": midline - 0.5 * gap, "right": midline + 0.5 * gap, "midline": midline}
    if data.chain.history.force:
        out["force"] = stacked[-n:]
    return out


def places(data: Observations, problem: Problem, residual: Array, rng: np.random.Generator) -> tuple[Place, ...]:
    """Regions of the input in which the residual exceeds the noise."""
    noises = dict(zip(data.channels, problem.whitener.noises, strict=True))
    n = data.chain.history.input_mm.size
    aside = problem.whitener.aside[:n]
    return where(by_channel(data, residual), noises, data.chain.history, aside, rng)
