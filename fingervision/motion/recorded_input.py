"""The recorded input of a table: command or motion, smoothed, with the effect of its remaining error on the gap."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array, Flags, History
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.model import Model
from fingervision.motion.input_path import log_at, mostly_at_rest, recorded
from fingervision.motion.local_polynomial_smoothing import LINES, SmoothedRecord
from fingervision.motion.log_path import LogPath
from fingervision.motion.time_stamps import input_error_of_stamps

# Distinguish step commands from encoder readings: both stay constant and jump while the stage moves slowly.

HELD_SHARE = 0.5
"""Share of samples equal to the one before, above which an input may be a command; a recorded motion changes in most
samples."""
ISOLATED_SHARE = 0.9
"""Share of jumps that are isolated between equal values; in ramps and strokes, changes follow each other directly."""
FEWEST_LINES = 8.0
"""Least number of encoder lines over the range; an encoder with fewer would be useless."""
LEAST_HOLD = 4
"""Least number of samples in a hold for which the second half shows whether the gap moves or is constant."""
DWELL = 3.0
"""Ratio of a hold to the median hold between moves in the same direction, above which the stage itself waits; the gap
is then constant even if the input is an encoder's record."""
FOLLOWS = 0.5
"""Slope of the gap within holds, relative to that of a steady motion: 1 for an encoder, 0 for a command; this is the
limit between them."""


def is_commanded(input_mm: Array, runs: tuple[slice, ...], gap_of_input: Array, gap_mm: Array) -> bool:
    """Whether the input is a command, which stays constant until it jumps.

    The record of a coarse encoder also stays constant and jumps while the stage moves slowly. While an encoder's record
    is constant, the gap moves; while a command is constant, the gap is constant too.

    Parameters
    ----------
    input_mm : ndarray of float, shape (n,)
        Recorded input.
    runs : tuple of slice
        Samples of each run.
    gap_of_input, gap_mm : ndarray of float, shape (n,)
        Gap that the model predicts for the record, and measured gap.
    """
    moves = np.concatenate([np.diff(input_mm[run]) for run in runs])
    inner = [np.diff(input_mm[run]) != 0.0 for run in runs]
    jumps = int(sum(np.sum(jump) for jump in inner))
    if jumps == 0 or np.mean(moves == 0.0) < HELD_SHARE:
        return False
    beside = sum(int(np.sum(jump[1:] & jump[:-1])) for jump in inner)
    if 2 * beside > (1.0 - ISOLATED_SHARE) * jumps:
        return False
    if float(np.ptp(input_mm)) < FEWEST_LINES * float(np.min(np.abs(moves[moves != 0.0]))):
        return True
    along, power = 0.0, 0.0
    holds = []
    for run, jump in zip(runs, inner, strict=True):
        at = run.start + 1 + np.flatnonzero(jump)
        for before, after in pairwise(at):
            if (input_mm[before] - input_mm[before - 1]) * (input_mm[after] - input_mm[before]) > 0.0:
                holds.append((before, after))
    longest = DWELL * float(np.median([after - before for before, after in holds])) if holds else 0.0
    for before, after in holds:
        if LEAST_HOLD <= after - before <= longest:
            second = np.arange(before + (after - before) // 2, after)
            way = 0.5 * (gap_of_input[after] - gap_of_input[before - 1])
            drift = way * (second - second.mean()) / (after - before)
            along += float(drift @ (gap_mm[second] - gap_mm[second].mean()))
            power += float(drift @ drift)
    return power > 0.0 and along < FOLLOWS * power


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
    stamps_mm : ndarray of float, shape (n,), or None
        Effect on the gap of the rounding of the frames' times, and of a log's own errors, independent from row to row;
        None if there is neither.
    log : LogPath or None
        Path between the rows of the log from which the input was read; None without a log of a motion.
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
    stamps_mm: Array | None = None
    log: LogPath | None = None

    @classmethod
    def exact(cls, table: MeasuredTable, *, is_motion: bool = False, commanded: bool = False) -> "RecordedInput":
        """Use the recorded input of a table as it is, without smoothing."""
        u, along_mm = table.input_mm, recorded(table)[0]
        still = np.zeros(u.size, dtype=bool)
        return cls(u, along_mm, 0.0, 0.0, np.zeros(u.size), still, 1.0, is_motion, commanded)

    @classmethod
    def of(cls, table: MeasuredTable, model: Model, range_mm: tuple[float, float]) -> "RecordedInput":
        """Smooth the recorded input, unless it has commands or set-points, or the gap follows its fluctuations.

        Parameters
        ----------
        table : MeasuredTable
            The measured table.
        model : Model
            Model of the gap over the input.
        range_mm : (float, float)
            Range of the inputs that the model covers.
        """
        along_mm, time_s, runs = recorded(table)
        if time_s is None or mostly_at_rest(table):
            return cls.exact(table)
        gap_of_input = model.respond(table.input_mm).gap_mm
        if is_commanded(table.input_mm, table.runs, gap_of_input, table.gap_mm):
            return cls.exact(table, commanded=True)
        record = SmoothedRecord.of(along_mm, time_s, runs)
        path_mm = record.path_mm
        rows = table.path_rows
        is_motion, noise_mm = False, 0.0
        if record.sigma_mm > 0.0:
            is_motion, noise_mm = _motion_in_fluctuations(table, model, path_mm[rows])
        exact = record.sigma_mm == 0.0 or is_motion
        smooth = along_mm if exact else path_mm
        low, high = range_mm
        reach = 1e-3 * (high - low)
        ahead, behind = (model.respond(smooth[rows] + way).gap_mm for way in (reach, -reach))
        slope = np.abs(ahead - behind) / (2.0 * reach)
        stamps_mm = slope * input_error_of_stamps(smooth, time_s, runs, table.stamp_s)[rows] if table.stamp_s else None
        if table.log is not None and not is_motion:
            log = LogPath.of(_during(table.log, time_s)).rounded(table.clock.corner_s)
            return cls.logged(table, replace(log, u_corner_s=table.clock.u_corner_s).thinned(), slope, stamps_mm)
        if exact:
            kept = cls.exact(table, is_motion=is_motion)
            return replace(kept, sigma_mm=noise_mm, error_mm=slope * noise_mm, stamps_mm=stamps_mm)
        snapped_mm, leverage, sigma, step = record.recorded_mm, record.leverage, record.sigma_mm, record.step_mm
        samples, stays = 1.0 / float(np.median(leverage)), leverage < STAYING
        if step > 0.0:
            samples = max(samples, HELD_SAMPLES)
            stays = _within(snapped_mm, runs, HELD_SAMPLES, 1.01 * step) | _within(
                snapped_mm, runs, SLOW_SAMPLES, 2.01 * step
            )
        error = slope * sigma * np.sqrt(leverage[rows])
        return cls(smooth[rows], smooth, sigma, step, error, stays[rows], samples, stamps_mm=stamps_mm)

    @classmethod
    def logged(cls, table: MeasuredTable, log: LogPath, slope: Array, stamps_mm: Array | None) -> "RecordedInput":
        """Read the input of each row from the path between the rows of its log, with the uncertainty of that path.

        Parameters
        ----------
        table : MeasuredTable
            The measured table.
        log : LogPath
            The path.
        slope : ndarray of float, shape (n,)
            Change of the gap per change of the input.
        stamps_mm : ndarray of float, shape (n,), or None
            Effect on the gap of the rounding of the frames' times.
        """
        along_mm = log_at(log, log.drive.input_mm, table)
        smooth_mm = along_mm[table.path_rows]
        _, time_s, _ = recorded(table)
        if time_s is None:
            raise ValueError
        u_mm = log_at(log, log.u_mm, table)[table.path_rows]
        shared_mm = log.shared.u_mm[np.searchsorted(log.shared.begin_s, time_s[table.path_rows], side="right")]
        stays = np.ones(smooth_mm.size, dtype=bool)
        passing_mm = slope * u_mm if stamps_mm is None else np.hypot(stamps_mm, slope * u_mm)
        sigma_mm = max(float(np.median(u_mm)), log.record.step_mm / float(np.sqrt(12.0)))
        return cls(
            smooth_mm,
            along_mm,
            sigma_mm,
            log.record.step_mm,
            slope * shared_mm,
            stays,
            HELD_SAMPLES,
            stamps_mm=passing_mm,
            log=log,
        )


def standing_still(history: History, least_rows: int) -> tuple[slice, ...]:
    """Stretches of `least_rows` samples or more in which the stage is at rest, within the recorded input's error."""
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
    return tuple(stretch for stretch in found if stretch.stop - stretch.start >= least_rows)


def settled_halves(input_mm: Array, run: slice) -> list[slice]:
    """Second halves of the stretches of a run in which a command keeps its value, when the stage has settled."""
    borders = [run.start, *(run.start + 1 + np.flatnonzero(np.diff(input_mm[run]))), run.stop]
    return [slice(int(begin + (end - begin) // 2), int(end)) for begin, end in pairwise(borders) if end - begin >= 2]


def scatter_in_holds(history: History, residual_mm: Array) -> float:
    """Standard deviation of a residual in the second halves of stops, when the stage has settled (mm).

    Parameters
    ----------
    history : History
        Input and runs.
    residual_mm : ndarray of float, shape (n,)
        Residual of one channel.
    """
    settled = [residual_mm[half] for run in history.runs for half in settled_halves(history.input_mm, run)]
    total = sum(float(np.sum((values - values.mean()) ** 2)) for values in settled)
    degrees = sum(values.size - 1 for values in settled)
    return float(np.sqrt(total / degrees)) if degrees else np.inf


def _during(log: DriveHistory, time_s: Array) -> DriveHistory:
    """Rows of a log during a table, and as many before and after it as the widest window of the smoothing has."""
    first, last = np.searchsorted(log.time_s, [time_s.min(), time_s.max()])
    rows = slice(max(int(first) - LINES[0], 0), int(last) + LINES[0])
    run = None if log.run is None else log.run[rows]
    return DriveHistory(log.time_s[rows], log.input_mm[rows], run)


def _within(input_mm: Array, runs: tuple[slice, ...], samples: int, reach_mm: float) -> Flags:
    """Mark samples around which the input stays within `reach_mm` for some samples; none if `reach_mm` is 0."""
    out = np.zeros(input_mm.size, dtype=bool)
    for run in runs:
        if reach_mm > 0.0 and run.stop - run.start > samples:
            padded = np.pad(input_mm[run], samples // 2, mode="edge")
            out[run] = np.ptp(np.lib.stride_tricks.sliding_window_view(padded, samples), axis=1) < reach_mm
    return out


def _motion_in_fluctuations(table: MeasuredTable, model: Model, smooth: Array) -> tuple[bool, float]:
    """Whether the gap follows the input's fluctuations, and the noise of the record among them (mm).

    The slope of the gap over the fluctuations is one for a motion, and zero for noise; between the two it is the share
    of motion in their power, and the rest is noise of the record. For example, smoothing rounds the corners of a
    staircase, which the gap then seems to follow, while the stage rests on every step.
    """
    expected = model.respond(table.input_mm).gap_mm - model.respond(smooth).gap_mm
    residual = table.gap_mm - model.respond(smooth).gap_mm
    a = np.concatenate([np.diff(expected[run]) for run in table.runs])
    b = np.concatenate([np.diff(residual[run]) for run in table.runs])
    typical = 5.0 * np.median(np.abs(b)) + 1e-12
    kept = np.abs(b) < typical
    power, doubt = float(a[kept] @ a[kept]), float(np.std(b[kept]))
    along = float(a[kept] @ b[kept])
    if power == 0.0 or along <= max(0.5 * power, SURELY * doubt * np.sqrt(power)):
        return False, 0.0
    # The difference of two rows has the noise of both.
    moves = np.concatenate([np.diff((table.input_mm - smooth)[run]) for run in table.runs])[kept]
    return True, float(np.sqrt(max(0.0, 1.0 - along / power) * np.mean(moves**2) / 2.0))
