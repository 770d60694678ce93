"""Smooth the random error of the recorded input, and propagate its remaining error to the gap."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fingervision.diagnosis.input.commands import is_commanded
from fingervision.diagnosis.input.path import mostly_at_rest, recorded
from fingervision.diagnosis.noise.spectrum import LEAST_RUN
from fingervision.domain.effect import Array, Flags, History
from fingervision.domain.measured_table import MeasuredTable
from fingervision.models.corrected import CorrectedModel
from fingervision.stage_record.encoder import input_sigma, on_lines
from fingervision.stage_record.local_polynomial_smoothing import smoothed
from fingervision.stage_record.window_blending import blended

HELD_SAMPLES, SLOW_SAMPLES = 15, 5
"""Number of samples for which the input stays within one or two encoder steps: for a stage at rest, and for a stage
that reverses."""
STAYING = 0.2
"""Leverage below which neighbouring smoothed values have so many samples in common that their errors are equal."""
STANDING_SHARE = 1e-3
"""Share of the input's range within which a stage counts as at rest."""
SURELY = 3.0
"""Standard errors by which the gap must follow the input's fluctuations before these count as motion."""


@dataclass(frozen=True, slots=True, eq=False)
class RecordedInput:
    """The recorded input, smoothed, with its uncertainty.

    Parameters
    ----------
    smooth_mm : ndarray of float, shape (n,)
        Smoothed input of the measured rows.
    along_mm : ndarray of float, shape (m,)
        Smoothed input of every row that has an input.
    sigma_mm, step_mm : float
        Standard uncertainty of one recorded value, and the encoder's step; 0 without an encoder.
    error_mm : ndarray of float, shape (n,)
        Effect of the remaining error on the gap.
    stays : ndarray of bool, shape (n,)
        Samples at which this error is the same from sample to sample; at all others it differs.
    samples : float
        Number of samples for which the error is the same.
    is_motion : bool
        Whether the fluctuations of the record are also visible in the gap, and were therefore not smoothed.
    commanded : bool
        Whether the record is a command that keeps its value until it jumps.
    """

    smooth_mm: Array
    along_mm: Array
    sigma_mm: float
    step_mm: float
    error_mm: Array
    stays: Flags
    samples: float
    is_motion: bool = False
    commanded: bool = False

    @classmethod
    def exact(cls, table: MeasuredTable, *, is_motion: bool = False, commanded: bool = False) -> "RecordedInput":
        """Use the recorded input of a table as it is, without smoothing."""
        u, along_mm = table.input_mm, recorded(table)[0]
        still = np.zeros(u.size, dtype=bool)
        return cls(u, along_mm, 0.0, 0.0, np.zeros(u.size), still, 1.0, is_motion, commanded)

    @classmethod
    def of(cls, table: MeasuredTable, model: CorrectedModel) -> "RecordedInput":
        """Smooth the recorded input, unless it has commands or set-points, or the gap follows its fluctuations."""
        along_mm, time_s, runs = recorded(table)
        if time_s is None or mostly_at_rest(table):
            return cls.exact(table)
        rows = np.arange(along_mm.size) if table.path is None else table.path.rows
        gap_of_input = model.base.respond(table.input_mm).gap_mm
        if is_commanded(table.input_mm, table.runs, gap_of_input, table.gap_mm):
            return cls.exact(table, commanded=True)
        snapped_mm = on_lines(along_mm, runs)
        sigma, step = input_sigma(snapped_mm, runs, time_s)
        if sigma == 0.0:
            return cls.exact(table)
        smooth, leverage = smoothed(snapped_mm, time_s, runs, sigma, step)
        smooth = blended(smooth, snapped_mm, time_s, runs, leverage)
        if _is_motion(table, model, smooth[rows]):
            return cls.exact(table, is_motion=True)
        samples, stays = 1.0 / float(np.median(leverage)), leverage < STAYING
        if step > 0.0:
            samples = max(samples, HELD_SAMPLES)
            stays = _within(snapped_mm, runs, HELD_SAMPLES, 1.01 * step) | _within(
                snapped_mm, runs, SLOW_SAMPLES, 2.01 * step
            )
        low, high = model.input_range_mm
        reach = 1e-3 * (high - low)
        ahead, behind = (model.base.respond(smooth[rows] + way).gap_mm for way in (reach, -reach))
        slope = np.abs(ahead - behind) / (2.0 * reach)
        error = slope * sigma * np.sqrt(leverage[rows])
        return cls(smooth[rows], smooth, sigma, step, error, stays[rows], samples)


def standing_still(history: History) -> tuple[slice, ...]:
    """Stretches of `LEAST_RUN` samples or more in which the stage is at rest, within the recorded input's error."""
    reach = max(3.0 * history.input_sigma_mm, STANDING_SHARE * history.input_span_mm)
    found: list[slice] = []
    for run in history.runs:
        begin, low, high = run.start, np.inf, -np.inf
        for i, value in enumerate(history.input_mm[run].tolist(), run.start):
            low, high = min(low, value), max(high, value)
            if high - low > reach:
                found.append(slice(begin, i))
                begin, low, high = i, value, value
        found.append(slice(begin, run.stop))
    return tuple(stretch for stretch in found if stretch.stop - stretch.start >= LEAST_RUN)


def scatter_in_holds(history: History, residual_mm: Array) -> float:
    """Standard deviation of a residual in the second halves of stops, when the stage has settled (mm).

    Parameters
    ----------
    history : History
        Input and runs.
    residual_mm : ndarray of float, shape (n,)
        Residual of one channel.
    """
    total, degrees = 0.0, 0
    for run in history.runs:
        borders = [run.start, *(run.start + 1 + np.flatnonzero(np.diff(history.input_mm[run]))), run.stop]
        for begin, end in pairwise(borders):
            settled = residual_mm[begin + (end - begin) // 2 : end]
            if settled.size >= 2:
                total += float(np.sum((settled - settled.mean()) ** 2))
                degrees += settled.size - 1
    return float(np.sqrt(total / degrees)) if degrees else np.inf


def _within(input_mm: Array, runs: tuple[slice, ...], samples: int, reach_mm: float) -> Flags:
    """Mark samples around which the input stays within `reach_mm` for some samples; none if `reach_mm` is 0."""
    out = np.zeros(input_mm.size, dtype=bool)
    for run in runs:
        if reach_mm > 0.0 and run.stop - run.start > samples:
            padded = np.pad(input_mm[run], samples // 2, mode="edge")
            out[run] = np.ptp(np.lib.stride_tricks.sliding_window_view(padded, samples), axis=1) < reach_mm
    return out


def _is_motion(table: MeasuredTable, model: CorrectedModel, smooth: Array) -> bool:
    """Whether the gap follows the input's fluctuations: the slope of gap over input is then one, else zero."""
    expected = model.base.respond(table.input_mm).gap_mm - model.base.respond(smooth).gap_mm
    residual = table.gap_mm - model.base.respond(smooth).gap_mm
    a = np.concatenate([np.diff(expected[run]) for run in table.runs])
    b = np.concatenate([np.diff(residual[run]) for run in table.runs])
    typical = 5.0 * np.median(np.abs(b)) + 1e-12
    kept = np.abs(b) < typical
    power, doubt = float(a[kept] @ a[kept]), float(np.std(b[kept]))
    return power > 0.0 and float(a[kept] @ b[kept]) > max(0.5 * power, SURELY * doubt * np.sqrt(power))
