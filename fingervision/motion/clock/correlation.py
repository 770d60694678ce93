"""Candidate clock offsets, from the correlation of gap and input at every offset at which the records overlap."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array

MOST_POINTS = 16_384
"""Largest number of points of the common time grid: nine minutes at 30 frames per second; longer recordings get a
coarser grid.
"""
LARGEST_RATE = 1.5e-3
"""Largest relative difference of the clock rates that is searched: clocks rarely differ by 0.1 %, and crystal clocks by
0.01 %.
"""
LEAST_SHARE = 0.5
"""Least share of the motion of either record that must lie in the overlap."""
LEAST_OVERLAP = 0.5
"""Least share of the shorter record's duration that must lie in the overlap. With a play almost as wide as the stroke,
the gap's motion is so different from the log that a short stretch at the records' ends may fit better than the true
overlap.
"""
MOST_CANDIDATES = 12
"""Largest number of correlation peaks that are fitted; for a periodic motion this includes the neighbours of the
highest peak."""
NEAR_BEST = 0.5
"""Squared correlation, relative to that of the best peak, below which a peak is not fitted."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """One candidate for the offset between the two records.

    Parameters
    ----------
    offset_s : float
        Recording's time minus log's time, at the middle of the recording.
    rate : float
        Growth of that offset per time of the recording.
    correlation : float
        Pearson's correlation over the overlap; negative if the gap closes as the input increases.
    """

    offset_s: float
    rate: float
    correlation: float


def candidates(time_s: Array, gap_mm: Array, drive: DriveHistory) -> list[Candidate]:
    """Correlate gap and input at every offset and rate for which the records share at least half of their motion.

    Parameters
    ----------
    time_s, gap_mm : ndarray of float, shape (n,)
        Times and gaps of the recording.
    drive : DriveHistory
        The log, on its own clock.

    Returns
    -------
    list of Candidate
        Peaks of the correlation, highest first; empty if there is no common motion.
    """
    span_s = float(time_s[-1] - time_s[0])
    log_span_s = float(drive.time_s[-1] - drive.time_s[0])
    step_s = max(float(np.median(np.diff(time_s))), max(span_s, log_span_s) / MOST_POINTS)
    middle_s = 0.5 * float(time_s[0] + time_s[-1])
    grid_s = time_s[0] + step_s * np.arange(int(span_s / step_s) + 1)
    gap, seen = np.interp(grid_s, time_s, gap_mm), _near(grid_s, time_s, 3.0 * step_s)
    count = max(1, int(np.ceil(LARGEST_RATE * 0.5 * span_s / step_s)))
    found: list[Candidate] = []
    for rate in np.linspace(-LARGEST_RATE, LARGEST_RATE, 2 * count + 1):
        # The log's times are stretched about its first sample to the rate of the recording's clock.
        first_s = float(drive.time_s[0])
        stretched_s: Array = (drive.time_s - first_s) / (1.0 - rate)
        log_grid_s = step_s * np.arange(int(stretched_s[-1] / step_s) + 1)
        inputs, known = (
            np.interp(log_grid_s, stretched_s, drive.input_mm),
            _known(np.asarray(log_grid_s, dtype=np.float64), stretched_s, drive),
        )
        correlation = _overlap_correlation(gap, seen, inputs, known)
        lags = np.arange(correlation.size) - (inputs.size - 1)
        # At this lag the log's first sample lies at grid time time_s[0] + lag * step.
        for peak in _peaks(correlation):
            at_s = time_s[0] + _parabola(correlation, peak, lags) * step_s
            # recording = at + (log - first) / (1 - rate), hence the offset at the recording's middle:
            offset_s = middle_s - (first_s + (middle_s - at_s) * (1.0 - rate))
            found.append(Candidate(float(offset_s), float(rate), float(correlation[peak])))
    # A periodic motion looks reversed at an offset of half a period, so that a negative correlation is only used if
    # there is no good positive correlation.
    upright = [one for one in found if one.correlation > 0.0]
    best = max((abs(one.correlation) for one in found), default=0.0)
    if any(one.correlation**2 > NEAR_BEST * best**2 for one in upright):
        found = upright
    found.sort(key=lambda one: (-abs(one.correlation), abs(one.rate)))
    return _apart(found, 4.0 * step_s)


def _near(grid_s: Array, time_s: Array, reach_s: float) -> Array:
    """Mask of the time grid: 1 where a sample is within `reach_s`, else 0."""
    after = np.clip(np.searchsorted(time_s, grid_s), 1, time_s.size - 1)
    distance_s = np.minimum(np.abs(grid_s - time_s[after - 1]), np.abs(time_s[after] - grid_s))
    return np.asarray(distance_s <= reach_s, dtype=np.float64)


def _known(grid_s: Array, log_s: Array, drive: DriveHistory) -> Array:
    """Mask of the time grid: 1 where the log has an input (not between two runs), else 0."""
    known = np.ones_like(grid_s)
    if drive.run is not None:
        for k, (before, after) in enumerate(pairwise(drive.run)):
            if before != after:
                known[(grid_s > log_s[k]) & (grid_s < log_s[k + 1])] = 0.0
    return known


def _overlap_correlation(gap: Array, seen: Array, inputs: Array, known: Array) -> Array:
    """Pearson's correlation at every lag between log and recording; 0 where they have too little motion in common."""
    size = gap.size + inputs.size - 1
    length = next_fast_len(size, real=True)
    weight_gap, weight_input = float(seen.sum()), float(known.sum())
    gap = (gap - (gap @ seen) / weight_gap) * seen
    inputs = (inputs - (inputs @ known) / weight_input) * known
    motion_gap, motion_input = float(gap @ gap), float(inputs @ inputs)

    def spectrum(signal: Array) -> Array:
        return np.asarray(rfft(signal, length))

    seen_f, gap_f, gap2_f = spectrum(seen), spectrum(gap), spectrum(gap**2)
    known_f, input_f, input2_f = (np.conj(spectrum(one)) for one in (known, inputs, inputs**2))

    def shared(left: Array, right: Array) -> Array:
        lags = irfft(left * right, length)
        return np.asarray(np.concatenate([lags[length - (inputs.size - 1) :], lags[: gap.size]]))

    n = np.maximum(shared(seen_f, known_f), 1e-9)
    sum_gap, sum_input = shared(gap_f, known_f), shared(seen_f, input_f)
    square_gap = shared(gap2_f, known_f) - sum_gap**2 / n
    square_input = shared(seen_f, input2_f) - sum_input**2 / n
    cross = shared(gap_f, input_f) - sum_gap * sum_input / n
    enough = (square_gap > LEAST_SHARE * motion_gap) | (square_input > LEAST_SHARE * motion_input)
    enough &= n >= LEAST_OVERLAP * min(weight_gap, weight_input)
    enough &= (n > 4.5) & (square_gap > 1e-9 * motion_gap) & (square_input > 1e-9 * motion_input)
    root = np.sqrt(np.where(enough, square_gap * square_input, 1.0))
    return np.clip(np.where(enough, cross / root, 0.0), -1.0, 1.0)


def _peaks(correlation: Array) -> list[int]:
    """Largest local maxima of the absolute correlation, limited in number."""
    size = np.abs(correlation)
    inner = np.flatnonzero((size >= np.r_[0.0, size[:-1]]) & (size >= np.r_[size[1:], 0.0]) & (size > 0.0))
    if not inner.size:
        return []
    best = float(size[inner].max())
    inner = inner[size[inner] ** 2 > NEAR_BEST * best**2]
    return [int(k) for k in inner[np.argsort(-size[inner], kind="stable")][: 4 * MOST_CANDIDATES]]


def _parabola(correlation: Array, peak: int, lags: Array) -> float:
    """Position of the vertex of the parabola through a correlation peak and its two neighbours."""
    if peak == 0 or peak == correlation.size - 1:
        return float(lags[peak])
    left, top, right = np.abs(correlation[peak - 1 : peak + 2])
    bend = left - 2.0 * top + right
    return float(lags[peak] + (0.5 * (left - right) / bend if bend < 0.0 else 0.0))


def _apart(found: list[Candidate], least_s: float) -> list[Candidate]:
    """Keep only the best of candidates with the same offset at neighbouring rates; `found` is sorted, best first."""
    kept: list[Candidate] = []
    for one in found:
        if len(kept) == MOST_CANDIDATES or one.correlation**2 < NEAR_BEST * kept[0].correlation ** 2 if kept else False:
            break
        if all(abs(one.offset_s - other.offset_s) > least_s for other in kept):
            kept.append(one)
    return kept
