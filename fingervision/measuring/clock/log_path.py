"""The stage between two rows of its log, and how well that is known."""

from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array
from fingervision.stage_record.encoder import input_sigma, on_lines
from fingervision.stage_record.local_polynomial_smoothing import smoothed

FINER = 6
"""Points that a row becomes: the sag of a chord falls with its square, to a thirtieth."""
FEWEST = 5
"""Rows that draw a curve, and of which fourth differences are taken."""
CORNER = 0.07
"""Standard deviation of an interpolated input over the fourth differences at both ends of its interval. A corner of the
motion anywhere between two rows leaves 0.105 of the change of step as RMS (integral of x^2 (1 - x)^2, times 1/3), which
is 0.07 of the fourth differences that it makes; noise of the rows comes out within a tenth of itself."""

SHARP = 5.0
"""Change of the step in an interval over that beside it, and over a row's uncertainty, from which on it is a corner."""
CORNER_ROWS = 3
"""Rows on either side of a corner that its smoothing spoils."""
STANDS = 0.1
"""Step over its neighbour's below which the stage stands: noise of a log is seldom more."""


@dataclass(frozen=True, slots=True, eq=False)
class LogPath:
    """The way of the input through the log's rows.

    Parameters
    ----------
    drive : DriveHistory
        Points so close that straight lines between them will do.
    u_mm : ndarray of float, shape (n,)
        Standard uncertainty at each of them of what lies between rows.
    """

    drive: DriveHistory
    u_mm: Array

    @classmethod
    def of(cls, log: DriveHistory) -> "LogPath":
        """Smooth the rows as far as their error is random, and draw Akima's curve through them, which keeps corners.

        A play follows every peak of a noisy record, and would seem to lead by two standard deviations of it.
        """
        names = log.run or ("",) * log.time_s.size
        lengths = [len(list(group)) for _, group in groupby(names)]
        ends = np.cumsum([0, *lengths])
        runs = tuple(slice(int(begin), int(end)) for begin, end in pairwise(ends))
        snapped_mm = on_lines(log.input_mm, runs)
        sigma_mm, step_mm = input_sigma(snapped_mm, runs)
        smooth_mm, leverage = snapped_mm.copy(), np.zeros(snapped_mm.size)
        if sigma_mm > 0.0:
            smooth_mm, leverage = smoothed(snapped_mm, log.time_s, runs, sigma_mm, step_mm)
        u_mm = sigma_mm * np.sqrt(leverage)
        for run in runs:
            smooth_mm[run] = _flattened(smooth_mm[run], sigma_mm)
        pieces = [_piece(log.time_s[run], smooth_mm[run], u_mm[run]) for run in runs]
        of_runs = tuple(names[run.start] for run, piece in zip(runs, pieces, strict=True) for _ in piece[0])
        time_s, input_mm, errors = (np.concatenate([piece[k] for piece in pieces]) for k in range(3))
        return cls(DriveHistory(time_s, input_mm, None if log.run is None else of_runs), errors)


def _piece(time_s: Array, input_mm: Array, u_mm: Array) -> tuple[Array, Array, Array]:
    """Times, inputs and uncertainties of the points of one run."""
    if time_s.size < FEWEST:
        return time_s, input_mm, u_mm
    places = np.arange(FINER * (time_s.size - 1) + 1) / FINER
    interval = np.minimum(places.astype(int), time_s.size - 2)
    fine_s = np.interp(places, np.arange(time_s.size), time_s)
    second = np.abs(np.pad(np.diff(input_mm, 2), 1, mode="edge"))
    fourth = np.abs(np.pad(np.diff(input_mm, 4), 2, mode="edge"))
    between = CORNER * np.minimum(fourth[:-1] + fourth[1:], 3.0 * np.minimum(second[:-1], second[1:]))
    fine_mm = _curve(time_s, input_mm, fine_s, interval)
    sharp, at_s, at_mm = _corners(time_s, input_mm, second, u_mm)
    of_corner = np.isin(interval, sharp)
    if sharp.size:
        between[sharp] = second[sharp - 1] + second[sharp + 2]
        rows_s = np.insert(time_s, sharp + 1, at_s)
        fine_mm[of_corner] = np.interp(fine_s[of_corner], rows_s, np.insert(input_mm, sharp + 1, at_mm))
    errors = np.hypot(between[interval], np.interp(fine_s, time_s, u_mm))
    new = np.searchsorted(fine_s, at_s)
    return np.insert(fine_s, new, at_s), np.insert(fine_mm, new, at_mm), np.insert(errors, new, between[sharp])


def _corners(time_s: Array, input_mm: Array, second: Array, u_mm: Array) -> tuple[NDArray[np.intp], Array, Array]:
    """Intervals in which two straight lines meet, and where they do: a turn lies between two rows, and not on one."""
    k = np.arange(2, time_s.size - 3)
    bend, beside = second[k] + second[k + 1], second[k - 1] + second[k + 2]
    speed = np.diff(input_mm) / np.diff(time_s)
    apart = speed[k - 1] - speed[k + 1]
    met_s = np.where(
        apart != 0.0,
        (input_mm[k + 1] - input_mm[k] - speed[k + 1] * (time_s[k + 1] - time_s[k])) / np.where(apart, apart, 1.0),
        -1.0,
    )
    isolated = (bend > SHARP * beside) & (bend > SHARP * u_mm[k]) & (met_s > 0.0) & (met_s < np.diff(time_s)[k])
    found = k[isolated]
    return found, time_s[found] + met_s[isolated], input_mm[found] + speed[found - 1] * met_s[isolated]


def _flattened(input_mm: Array, sigma_mm: float) -> Array:
    """Where the stage stands, put it at one place, and keep what leads there from overshooting it.

    A smoothed corner overshoots by some standard deviations of a row, and a play remembers each overshoot.
    """
    steps = np.abs(np.diff(input_mm))
    moving = steps[steps > max(sigma_mm, 1e-3 * float(np.ptp(input_mm)) / max(input_mm.size, 1))]
    if not moving.size:
        return input_mm
    out = input_mm.copy()
    stands = np.flatnonzero(np.diff(np.r_[0, (steps < STANDS * np.median(moving)).astype(int), 0]))
    for begin, end in stands.reshape(-1, 2):  # rows begin to end inclusive
        inner = input_mm[begin : end + 1]
        if end - begin < 2 * CORNER_ROWS or np.ptp(inner[CORNER_ROWS:-CORNER_ROWS]) > 3.0 * sigma_mm:
            continue
        level = float(np.median(inner[CORNER_ROWS:-CORNER_ROWS]))
        out[begin : end + 1] = np.where(np.abs(inner - level) <= 3.0 * sigma_mm, level, inner)
        for rows, far in (
            (slice(max(begin - CORNER_ROWS, 0), begin + CORNER_ROWS), max(begin - 2 * CORNER_ROWS, 0)),
            (slice(end + 1 - CORNER_ROWS, end + 1 + CORNER_ROWS), min(end + 2 * CORNER_ROWS, out.size - 1)),
        ):
            below = input_mm[far] < level
            out[rows] = np.minimum(out[rows], level) if below else np.maximum(out[rows], level)
    return out


def _curve(time_s: Array, input_mm: Array, fine_s: Array, interval: NDArray[np.intp]) -> Array:
    """Draw Akima's curve; beside an interval in which the stage stands it stays between its rows.

    A stage that arrives and stands has not been beyond the place where it stands, and a play remembers where it was.
    """
    curve = np.asarray(Akima1DInterpolator(time_s, input_mm)(fine_s), dtype=np.float64)
    steps = np.abs(np.diff(input_mm))
    beside = np.minimum(np.append(steps[1:], np.inf), np.insert(steps[:-1], 0, np.inf))
    low = np.minimum(input_mm[:-1], input_mm[1:])[interval]
    high = np.maximum(input_mm[:-1], input_mm[1:])[interval]
    return np.where((beside < STANDS * steps)[interval], np.clip(curve, low, high), curve)
