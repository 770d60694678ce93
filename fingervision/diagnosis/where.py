"""Where measurement and model disagree: regions whose residual cannot be noise, each in a sentence."""

import numpy as np

from fingervision.diagnosis.noise import Noise
from fingervision.domain.effect import Array, Flags, History
from fingervision.domain.report import Place

BINS = 16
DRAWS = 2000
QUANTILE = 0.99


def _scan(score: Array) -> tuple[float, int, int]:
    """Largest absolute sum over a contiguous stretch, in standard deviations."""
    total = np.concatenate([[0.0], np.cumsum(score)])
    best = (0.0, 0, 0)
    for first in range(score.size):
        length = np.arange(1, score.size - first + 1)
        sums = np.abs(total[first + 1 :] - total[first]) / np.sqrt(length)
        k = int(np.argmax(sums))
        if sums[k] > best[0]:
            best = (float(sums[k]), first, first + k)
    return best


def where(
    residual_mm: dict[str, Array], noises: dict[str, Noise], history: History, aside: Flags, rng: np.random.Generator
) -> tuple[Place, ...]:
    """Find the regions over input (both ways, opening, closing), time and speed, a channel at a time.

    Parameters
    ----------
    residual_mm : dict of ndarray of float, shape (n,)
        Measured minus predicted, by channel.
    noises : dict of Noise
        By channel.
    history : History
        Input and times.
    aside : ndarray of bool, shape (n,)
        Outliers.
    rng : numpy Generator
        For the threshold of the maximum over all stretches.
    """
    n = history.input_mm.size
    limit = float(np.quantile([_scan(row)[0] for row in rng.standard_normal((DRAWS // 10, BINS))], QUANTILE)) + 0.5
    variables: list[tuple[str, str, Array, Flags]] = [("input", "mm", history.input_mm, np.ones(n, dtype=bool))]
    if history.time_s is not None:
        speed = np.concatenate([np.gradient(history.input_mm[run], history.times[run]) for run in history.runs])
        still = 0.05 * np.max(np.abs(speed))
        variables += [
            ("input, opening", "mm", history.input_mm, speed > still),
            ("input, closing", "mm", history.input_mm, speed < -still),
            ("speed", "mm/s", speed, np.ones(n, dtype=bool)),
        ]
        if history.shared_clock:
            variables.append(("time", "s", history.clock_s, np.ones(n, dtype=bool)))
    places = []
    for channel, residual in residual_mm.items():
        noise = noises[channel]
        stretch = (1.0 + noise.correlation) / (1.0 - noise.correlation)
        variance = noise.white_mm**2 + noise.correlated_mm**2 * stretch
        for variable, unit, values, used in variables:
            rows = np.flatnonzero(used & ~aside)
            if rows.size < 4 or np.ptp(values[rows]) == 0.0:
                continue
            order = rows[np.argsort(values[rows], kind="stable")]
            parts = np.array_split(order, min(BINS, order.size))
            score = np.array([residual[p].sum() / np.sqrt(variance * p.size) for p in parts])
            sigma, first, last = _scan(score)
            if sigma <= limit:
                continue
            inside = np.concatenate(parts[first : last + 1])
            size = float(np.mean(residual[inside]))
            start, end = float(values[inside].min()), float(values[inside].max())
            runs = sum(bool(np.intersect1d(inside, np.arange(n)[run]).size) for run in history.runs)
            span = "everywhere" if last - first + 1 == len(parts) else f"between {start:.3g} and {end:.3g} {unit}"
            measure = "N" if channel == "force" else "mm"
            what = "larger" if size > 0.0 else "smaller"
            if channel in ("left", "right", "midline"):
                what = "farther right" if size > 0.0 else "farther left"
            words = (
                f"over the {variable}, {span}, the {channel} is {abs(size):.3g} {measure} {what} than simulated, "
                f"{sigma:.0f} sigma, in {'all' if runs == len(history.runs) else runs} run{'s' if runs != 1 else ''}"
            )
            places.append(Place(channel, variable, start, end, size, measure, sigma, words))
    return tuple(sorted(places, key=lambda place: -place.sigma))
