"""Noise of short records: first-order autoregressions by restricted likelihood (Patterson & Thompson 1971)."""

from dataclasses import dataclass

import numpy as np

from fingervision.diagnosis.noise.noise_model import Noise
from fingervision.domain.effect import Array, Flags

WHITE = 0.5
"""Prior probability of white noise, when noise parameters are drawn: frames are usually independent."""


@dataclass(frozen=True, slots=True, eq=False)
class _Likelihood:
    """Restricted likelihood of first-order autoregressions, tabulated over their correlation.

    Parameters
    ----------
    grid : ndarray of float, shape (k,)
        Correlations at which the likelihood is tabulated.
    cost : ndarray of float, shape (channels, k)
        -2 log likelihood with the best level, for each channel and correlation.
    spread_mm : ndarray of float, shape (channels, k)
        The best level.
    rows : ndarray of int, shape (channels,)
        Degrees of freedom.
    """

    grid: Array
    cost: Array
    spread_mm: Array
    rows: Array


FEWEST_SAMPLES = 4
"""Least number of samples of a run: a straight line and one correlation are already estimated from them."""
CORRELATIONS = np.linspace(0.0, 0.95, 39)
"""Correlations that are tried, in steps of a quarter of the uncertainty for a hundred samples; above 0.95, noise cannot
be distinguished from a drift in a short run."""


def _likelihood(residuals_mm: list[Array], runs: tuple[slice, ...], aside: list[Flags]) -> _Likelihood:
    """Subtract a straight line from each run, and evaluate the likelihood at every tabulated correlation.

    If all runs are too short for that, the noise is white, with the scatter about the runs' means.
    """
    grid = CORRELATIONS
    cost = np.empty((len(residuals_mm), grid.size))
    spread = np.empty_like(cost)
    degrees = np.empty(len(residuals_mm))
    for channel, (residual, out) in enumerate(zip(residuals_mm, aside, strict=True)):
        for k, rho in enumerate(grid):
            total, rows, determinants = 0.0, 0, 0.0
            for run in runs:
                place = np.flatnonzero(~out[run])
                if place.size < FEWEST_SAMPLES:
                    continue
                line = np.stack([np.ones(place.size), place - place.mean(), residual[run][place]], axis=1)
                keep = rho ** np.diff(place, prepend=place[0] - 1000)
                root = np.sqrt(1.0 - keep**2)
                white = line / root[:, None]
                white[1:] -= (keep / root)[1:, None] * line[:-1]
                normal = white[:, :2].T @ white[:, :2]
                rest = white[:, 2] - white[:, :2] @ np.linalg.solve(normal, white[:, :2].T @ white[:, 2])
                total += float(rest @ rest)
                rows += place.size - 2
                determinants += 2.0 * float(np.sum(np.log(root))) + float(np.log(np.linalg.det(normal)))
            rows = max(rows, 1)
            degrees[channel] = rows
            spread[channel, k] = np.sqrt(total / rows)
            cost[channel, k] = rows * np.log(max(total, 1e-300) / rows) + determinants
        if all(np.sum(~out[run]) < FEWEST_SAMPLES for run in runs):
            degrees[channel], spread[channel] = _about_means(residual, runs, out)
            cost[channel] = np.where(grid > 0.0, np.inf, 0.0)
    return _Likelihood(grid, cost, spread, degrees)


def _about_means(residual: Array, runs: tuple[slice, ...], out: Flags) -> tuple[int, float]:
    """Degrees of freedom and standard deviation about each run's mean: runs of a few samples show nothing else."""
    kept = [residual[run][~out[run]] for run in runs if not out[run].all()]
    rest = np.concatenate([np.zeros(0), *(values - values.mean() for values in kept)])
    degrees = max(1, rest.size - len(kept))
    return degrees, float(np.sqrt(rest @ rest / degrees))


def noise_of_short_runs(
    residuals_mm: list[Array], runs: tuple[slice, ...], aside: list[Flags], floors_mm: list[float], *, explained: bool
) -> tuple[Noise, ...]:
    """Fit the noise of channels that share one correlation in time, each channel with its own level.

    Restricted likelihood is used for runs with too few samples for a spectrum. If the noise of short runs were treated
    as white, every slow effect would seem significant. All channels come from the same pictures, so that they share one
    correlation: the posterior mean of this correlation under a flat prior is used. Before an effect is found, the
    channel with the smallest correlation determines the common correlation, because effects can only increase a
    correlation.

    Parameters
    ----------
    residuals_mm, aside : list of ndarray, shape (n,)
        Residual and excluded rows of each channel.
    runs : tuple of slice
        Samples of each run; a straight line is subtracted from each run.
    floors_mm : list of float
        Random uncertainty of the measurement itself, for each channel.
    explained : bool
        Whether effects have been subtracted.
    """
    known = _likelihood(residuals_mm, runs, aside)
    weight = np.exp(-0.5 * (known.cost - known.cost.min(axis=1, keepdims=True)))
    if explained:
        weight = np.prod(weight, axis=0, keepdims=True)
    rho = float(np.min(weight @ known.grid / weight.sum(axis=1)))
    scales = [float(np.interp(rho, known.grid, row)) for row in known.spread_mm]
    return tuple(
        Noise(1e-3 * scale, scale, max(rho, 1e-3))
        for scale in (max(s, floor, 1e-9) for s, floor in zip(scales, floors_mm, strict=True))
    )


def drawn_noises(
    residuals_mm: list[Array], runs: tuple[slice, ...], aside: list[Flags], count: int, rng: np.random.Generator
) -> list[tuple[Noise, ...]]:
    """Draw the noise of short runs from its posterior, `count` times; each draw has one noise per channel.

    The channels share one correlation, which is zero with prior probability `WHITE`; the level has the scaled inverse
    chi-square distribution of a variance.
    """
    known = _likelihood(residuals_mm, runs, aside)
    cost = known.cost.sum(axis=0)
    prior = np.full(known.grid.size, (1.0 - WHITE) / (known.grid.size - 1))
    prior[0] = WHITE
    weight = prior * np.exp(-0.5 * (cost - cost.min()))
    out = []
    for k in rng.choice(known.grid.size, count, p=weight / weight.sum()):
        scales = np.maximum(known.spread_mm[:, k] * np.sqrt(known.rows / rng.chisquare(known.rows)), 1e-9)
        rho = max(float(known.grid[k]), 1e-3)
        out.append(tuple(Noise(1e-3 * scale, float(scale), rho) for scale in scales))
    return out
