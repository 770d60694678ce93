"""Smooth a stage's record by local straight lines and parabolas, in windows as long as the motion allows."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array
from fingervision.domain.loops import loop
from fingervision.motion.encoder import input_sigma, on_lines
from fingervision.motion.encoder_path import STANDS

LINES = (241, 121, 61, 41, 27, 19, 13, 9, 7, 5)
PARABOLAS = (121, 61, 41, 27, 19, 13, 9, 7)
"""Window lengths tried for parabolas, in samples; for an oscillating stage the motion is straight over too few
samples."""
PLACES = 5
"""Number of positions of a sample within its window that are tried, from one end to the other."""
CHI_SIGMAS, END_SIGMAS, TREND_SIGMAS = 2.5, 3.0, 1.0
"""Limits on a window's residuals in standard uncertainties: chi-square in all, residuals at the ends, and the trend of
the next higher power, which would otherwise bias the fit unnoticed."""
CHOSEN = 1.4
"""Factor by which the error of the selected parabola exceeds its stated error, because the best-looking one is selected
(from simulated sines with noise)."""
CURVED_SIGMAS = 2.0
"""Significance, in standard uncertainties, of a parabola's curvature above which a straight line is rejected."""

_smooth = loop("local_polynomial_smoothing_run")


def smoothed(
    input_mm: Array, time_s: Array, runs: tuple[slice, ...], sigma_mm: float, step_mm: float
) -> tuple[Array, Array]:
    """Smooth the record separately within each run.

    Parameters
    ----------
    input_mm, time_s : ndarray of float, shape (n,)
        The record.
    runs : tuple of slice
        Samples of each run.
    sigma_mm, step_mm : float
        Results of `encoder.input_sigma`.

    Returns
    -------
    input_mm, leverage : ndarray of float, shape (n,)
        Smoothed values, and the remaining variance of each value divided by `sigma_mm**2`; the leverage is 1 for a
        value that was not smoothed.
    """
    out, leverage = input_mm.copy(), np.ones_like(input_mm)
    for run in runs:
        if run.stop - run.start >= 5:
            time, values = (np.ascontiguousarray(a[run], dtype=np.float64) for a in (time_s, input_mm))
            smooth, weight = np.empty_like(values), np.empty_like(values)
            _smooth(time, values, sigma_mm, bool(step_mm > 0.0), np.array(LINES), np.array(PARABOLAS), smooth, weight)
            out[run], leverage[run] = smooth, weight
    return out, leverage


BLENDED, RETURNED = 0.35, 1.0
"""Half widths of the triangular weights, as shares of a sample's effective window (the inverse of its leverage), for
the smoothed values and for what the record lies off them on average.

Drawn encoder records without effects (`tests.benchmarks.world.rows.encoder_jitter`, seeds 7 and 811, 25 each): the
differences of the error from sample to sample fall from 0.28 to 0.22 standard uncertainties of one recorded value. The
error falls from 0.50 to 0.48, and the mean shrinkage of the strokes from 0.07 to 0.035 encoder steps. Without the
second average of each kind the strokes shrink by 0.11 steps, and swings by as much as their noise."""


def blended(smooth_mm: Array, recorded_mm: Array, time_s: Array, runs: tuple[slice, ...], leverage: Array) -> Array:
    """Average smoothed values over a part of their windows, and return to them what the record lies off on average.

    The windows of neighbouring samples differ, and with them the errors of the smoothed values: they zigzag by a tenth
    of an encoder step. An effect that averages neighbouring samples, such as a lag by part of a sample, would seem to
    explain this zigzag (68 in chi-square for a lag of 10 ms in a table without one). Averages cut turns short, and so
    do windows that were just straight enough, which looks like a scale: what an average takes away is averaged and
    returned (twicing; Tukey 1977).

    Parameters
    ----------
    smooth_mm, recorded_mm, time_s : ndarray of float, shape (n,)
        Smoothed and recorded input, and times.
    runs : tuple of slice
        Samples of each run.
    leverage : ndarray of float, shape (n,)
        Leverage of each smoothed value, from `local_polynomial_smoothing.smoothed`.

    Returns
    -------
    ndarray of float, shape (n,)
        The input; a motion at constant speed stays as it is.
    """
    out = smooth_mm.copy()
    for run in runs:
        time, window = time_s[run], 1.0 / leverage[run]
        once = _averaged(smooth_mm[run], time, BLENDED * window)
        even = 2.0 * once - _averaged(once, time, BLENDED * window)
        out[run] = even + _averaged(recorded_mm[run] - even, time, RETURNED * window)
    return out


def _averaged(values: Array, time_s: Array, half_widths: Array) -> Array:
    """Average values with triangular weights of given half widths in samples, narrower at the ends; shape (n,)."""
    out = values.copy()
    place = np.arange(values.size)
    reach: NDArray[np.intp] = np.minimum(half_widths.astype(np.intp), np.minimum(place, values.size - 1 - place))
    for half in np.unique(reach[reach > 0]).tolist():
        at = np.flatnonzero(reach == half)
        weights = 1.0 - np.abs(np.arange(-half, half + 1)) / (half + 1.0)
        weights /= weights.sum()
        around = at[:, None] + np.arange(-half, half + 1)
        # The weighted mean time of uneven samples is not that of the sample.
        late_s = time_s[around] @ weights - time_s[at]
        speed = (values[at + half] - values[at - half]) / (time_s[at + half] - time_s[at - half])
        out[at] = values[around] @ weights - speed * late_s
    return out


CORNER_ROWS = 3
"""Number of rows on either side of a corner that smoothing distorts."""


def flattened(input_mm: Array, recorded_mm: Array, sigma_mm: float, still: float) -> Array:
    """Replace the positions during a rest by one position that the neighbouring path does not overshoot.

    Smoothing makes corners overshoot by some standard deviations of a row, and a smoothed rest wanders: the modelled
    play follows each overshoot, and the farthest place of each rest. A row that was recorded on the far side of the
    rest is no overshoot but a motion, which turned within the rows of the corner. `still` is the motion from row to row
    (mm) below which the stage may be at rest; 0 changes nothing.
    """
    if still == 0.0:
        return input_mm
    out = input_mm.copy()
    stands = np.flatnonzero(np.diff(np.r_[0, (np.abs(np.diff(input_mm)) < still).astype(int), 0]))
    for begin, end in stands.reshape(-1, 2):  # rows `begin` to `end`, both included
        inner = input_mm[begin : end + 1]
        if end - begin < 2 * CORNER_ROWS or np.ptp(inner[CORNER_ROWS:-CORNER_ROWS]) > 3.0 * sigma_mm:
            continue
        level = float(np.median(inner[CORNER_ROWS:-CORNER_ROWS]))
        out[begin : end + 1] = np.where(np.abs(inner - level) <= 3.0 * sigma_mm, level, inner)
        for rows, far in (
            (slice(max(begin - CORNER_ROWS, 0), begin + CORNER_ROWS), max(begin - 2 * CORNER_ROWS, 0)),
            (slice(end + 1 - CORNER_ROWS, end + 1 + CORNER_ROWS), min(end + 2 * CORNER_ROWS, out.size - 1)),
        ):
            way = 1.0 if input_mm[far] < level else -1.0
            beyond = way * (recorded_mm[rows] - level) > 3.0 * sigma_mm
            out[rows] = np.where(beyond, out[rows], way * np.minimum(way * out[rows], way * level))
    return out


BARELY = 1e-3
"""Share of the standard uncertainty of the recorded input below which noise in addition to the encoder's rounding is
neglected."""


def read_again(path_mm: Array, sigma_mm: float, step_mm: float, rng: np.random.Generator) -> Array:
    """Record a path again, with random noise and a random zero of the encoder; shape (n,) (mm).

    Parameters
    ----------
    path_mm : ndarray of float, shape (n,)
        The path at the rows.
    sigma_mm, step_mm : float
        Results of `encoder.input_sigma`.
    rng : numpy Generator
        Generator of noise and zero.
    """
    noise_mm = float(np.sqrt(max(0.0, sigma_mm**2 - step_mm**2 / 12.0)))
    noise_mm = noise_mm if noise_mm > BARELY * sigma_mm else 0.0
    read_mm = path_mm + noise_mm * rng.standard_normal(path_mm.size)
    if step_mm > 0.0:
        zero = rng.random()
        read_mm = (np.round(read_mm / step_mm - zero) + zero) * step_mm
    return read_mm


@dataclass(frozen=True, slots=True, eq=False)
class SmoothedRecord:
    """A stage's record without the jitter about its encoder's lines, smoothed as far as its errors are random.

    Parameters
    ----------
    recorded_mm, time_s : ndarray of float, shape (n,)
        The record, on the lines of its encoder, and its times.
    runs : tuple of slice
        Samples of each run.
    sigma_mm, step_mm : float
        Standard uncertainty of one recorded value, and the encoder's step; 0 without noise, or without an encoder.
    smooth_mm, leverage : ndarray of float, shape (n,)
        Smoothed values, and their remaining variance relative to `sigma_mm**2`.
    """

    recorded_mm: Array
    time_s: Array
    runs: tuple[slice, ...]
    sigma_mm: float
    step_mm: float
    smooth_mm: Array
    leverage: Array

    @classmethod
    def of(cls, input_mm: Array, time_s: Array, runs: tuple[slice, ...]) -> "SmoothedRecord":
        """Estimate noise and encoder of a record, and smooth it."""
        snapped_mm = on_lines(input_mm, runs)
        return cls.known(snapped_mm, time_s, runs, *input_sigma(snapped_mm, runs, time_s))

    @classmethod
    def known(
        cls, recorded_mm: Array, time_s: Array, runs: tuple[slice, ...], sigma_mm: float, step_mm: float
    ) -> "SmoothedRecord":
        """Smooth a record of known noise and encoder."""
        smooth = recorded_mm, np.zeros(recorded_mm.size)
        if sigma_mm > 0.0:
            smooth = smoothed(recorded_mm, time_s, runs, sigma_mm, step_mm)
        return cls(recorded_mm, time_s, runs, sigma_mm, step_mm, *smooth)

    @property
    def path_mm(self) -> Array:
        """Smoothed values, blended with those of neighbouring windows (`blended`), and constant in rests."""
        if self.sigma_mm == 0.0:  # a record without noise is the path
            return self.recorded_mm
        out = blended(self.smooth_mm, self.recorded_mm, self.time_s, self.runs, self.leverage)
        for run in self.runs:
            steps = np.abs(np.diff(out[run]))
            # Weighted by the way itself, the mean step is one of a motion, however long the rests are.
            still = STANDS * float(steps @ steps) / max(float(steps.sum()), 1e-300)
            out[run] = flattened(out[run], self.recorded_mm[run], self.sigma_mm, still)
        return out
