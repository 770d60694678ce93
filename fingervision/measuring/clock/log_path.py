"""Path of the stage between the rows of its log, with its uncertainty."""

from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array
from fingervision.measuring.clock.log_turns import turned
from fingervision.stage_record.encoder import input_sigma, on_lines
from fingervision.stage_record.local_polynomial_smoothing import smoothed

FINER = 6
"""Points of the path per row of the log: the sagitta of a chord falls with the square, to a thirtieth."""
FEWEST = 5
"""Least number of rows for a curve, and for fourth differences."""
CORNER = 0.07
"""Ratio of the standard deviation of an interpolated input to the fourth differences at the two ends of its interval. A
corner of the motion anywhere between two rows causes an RMS error of 0.105 times the change of step (integral of x^2 (1
- x)^2, times 1/3), which is 0.07 times the fourth differences that it causes; for noise of the rows the estimate is
within a tenth of the noise."""

SHARP = 5.0
"""Change of the step in an interval, relative to that beside it and to a row's uncertainty, from which on it counts as
a corner."""
CORNER_ROWS = 3
"""Rows on either side of a corner that smoothing distorts."""
LONG_ROWS = 4 * CORNER_ROWS
"""Number of rows from which on the ends of a stretch are left out when its rounding errors are examined."""
AVERAGED = 0.5
"""Leverage below which a smoothed row is the mean of several rows, and has a common error with its neighbours."""
TURN_SIGMAS, LEAST_TURN = 6.0, 0.01
"""Least return motion of a reversal, in standard deviations of a row, and as a share of the log's range."""
STANDS = 0.1
"""Step, relative to its neighbour's, below which the stage is at rest; the noise of a log is seldom larger."""


@dataclass(frozen=True, slots=True, eq=False)
class SharedErrors:
    """Stretches of the log, each with one error that is common to its rows.

    Parameters
    ----------
    begin_s : ndarray of float, shape (g - 1,)
        Start times of the second and the later stretches.
    u_mm : ndarray of float, shape (g,)
        Standard uncertainty of each stretch's common error.
    halts : ndarray of bool, shape (g,)
        Whether the stretch is a halt or a reversal, whose position determines the state of the play.
    """

    begin_s: Array
    u_mm: Array
    halts: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class LogPath:
    """Path of the input, interpolated between the rows of the log.

    Parameters
    ----------
    drive : DriveHistory
        Points of the path, so dense that straight lines between them suffice.
    u_mm : ndarray of float, shape (n,)
        Standard uncertainty of the input at each point: random error, and interpolation between rows.
    shared : SharedErrors
        Errors that are common to neighbouring rows.
    turned_mm : ndarray of float, shape (n,)
        Input with all reversals moved outwards by their uncertainty.
    rows : DriveHistory
        The log itself.
    step_mm : float
        Step of the encoder; 0 if none is visible in the log.
    """

    drive: DriveHistory
    u_mm: Array
    shared: SharedErrors
    turned_mm: Array
    rows: DriveHistory
    step_mm: float

    @classmethod
    def of(cls, log: DriveHistory) -> "LogPath":
        """Smooth the rows of the log as far as their error is random, and interpolate them by Akima's curve.

        Akima's interpolation is chosen because it preserves corners.

        Without smoothing, the model of play would respond to every noise peak, as if the input had gone further by
        about two standard deviations of the noise.
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
            smooth_mm[run] = _flattened(smooth_mm[run], sigma_mm, leverage[run])
        still = _standing_step(smooth_mm, sigma_mm, leverage)
        shared = SharedErrors(np.zeros(0), np.zeros(1), np.zeros(1, dtype=np.bool_))
        if step_mm > 0.0:
            shared, u_mm = _shared_errors(log.time_s, snapped_mm, smooth_mm, u_mm, leverage, still, step_mm)
        pieces = [_piece(log.time_s[run], smooth_mm[run], u_mm[run]) for run in runs]
        of_runs = tuple(names[run.start] for run, piece in zip(runs, pieces, strict=True) for _ in piece[0])
        time_s, input_mm, errors = (np.concatenate([piece[k] for piece in pieces]) for k in range(3))
        drive = DriveHistory(time_s, input_mm, None if log.run is None else of_runs)
        least_mm = max(2.0 * step_mm, TURN_SIGMAS * sigma_mm, LEAST_TURN * float(np.ptp(input_mm)))
        return cls(drive, errors, shared, turned(input_mm, errors, least_mm), log, step_mm)


def _shared_errors(
    time_s: Array, input_mm: Array, smooth_mm: Array, u_mm: Array, leverage: Array, still_mm: float, step_mm: float
) -> tuple[SharedErrors, Array]:
    """Split an encoder's rounding error into a part common to neighbouring rows and a random part.

    Rounding errors do not average out like noise. A stage at rest may be anywhere within a step of the encoder. If a
    stage moves by whole steps from row to row, the rounding error is the same in each row. For a slower stage, only the
    crossings of the encoder's lines are informative. The path may be shifted as long as every row stays within half a
    step of it; if the rounding errors cover the whole step, no such shift is possible. At the beginning and the end of
    a stroke, motion within one step is invisible.

    Returns
    -------
    shared, u_mm : SharedErrors, ndarray of float, shape (n,)
        The common errors, and the random standard uncertainty of each row.
    """
    rounding_mm = step_mm / float(np.sqrt(12.0))
    direction = np.where(np.abs(np.diff(smooth_mm)) <= still_mm, 0, np.sign(np.diff(smooth_mm))).astype(int)
    ends = np.append(np.flatnonzero(np.diff(direction)) + 1, time_s.size - 1)
    stretches: list[tuple[int, int]] = []
    for begin, end in zip(np.insert(ends[:-1], 0, 0), ends, strict=True):
        # A halt that smoothing broke into several is one: it has one place.
        if stretches and np.ptp(input_mm[stretches[-1][0] : end + 1]) == 0.0:
            stretches[-1] = (stretches[-1][0], int(end))
        else:
            stretches.append((int(begin), int(end)))
    away = input_mm - smooth_mm
    scatter_mm = np.where(leverage < AVERAGED, 0.0, u_mm)
    moved_mm = [abs(float(smooth_mm[end] - smooth_mm[begin])) for begin, end in stretches]
    # Rows beside the end of a stroke in which an encoder's line may pass unseen; none of a halt.
    near = [
        max(CORNER_ROWS, round(step_mm * (end - begin) / moved)) if moved > step_mm else 0
        for (begin, end), moved in zip(stretches, moved_mm, strict=True)
    ]
    found: list[tuple[int, float, bool]] = []
    unseen: list[tuple[int, int]] = []
    for k, (begin, end) in enumerate(stretches):
        inner = CORNER_ROWS if end - begin > LONG_ROWS else 0
        middle = slice(begin + inner, end + 1 - inner)
        left_mm = max(step_mm - float(np.ptp(away[middle])), 0.0) / float(np.sqrt(12.0))
        scatter_mm[middle] *= float(np.sqrt(max(1.0 - (left_mm / rounding_mm) ** 2, 0.0)))
        if not near[k]:
            found.append((begin, left_mm, True))
            continue
        unseen += [(begin - near[k], begin + near[k]), (end - near[k], end + near[k])]
        averaged = float(np.median(leverage[middle]))
        error_mm = 0.0
        if averaged < AVERAGED:
            lines = moved_mm[k] / step_mm
            error_mm = max(float(np.median(u_mm[middle])), rounding_mm * averaged * (end - begin) / lines)
        error_mm = min(float(np.hypot(error_mm, left_mm)), rounding_mm)
        first = begin + near[k] if k > 0 and near[k - 1] else begin
        last = end - near[k] if k + 1 < len(stretches) and near[k + 1] else end
        if last > first:
            count = max(1, round((last - first) * averaged))
            found += [(int(row), error_mm, False) for row in np.linspace(first, last, count + 1)[:-1]]
        if last < end:  # a turn without a halt: its place is known to a step
            found.append((max(last, first), rounding_mm, True))
    for begin, end in unseen:
        near_rows = slice(max(begin, 0), min(end, time_s.size - 1) + 1)
        scatter_mm[near_rows] = np.maximum(scatter_mm[near_rows], rounding_mm)
    rows, errors, halts = (np.array(part) for part in zip(*found, strict=True))
    return SharedErrors(time_s[rows[1:]], errors, halts), scatter_mm


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
    """Intervals in which two straight lines meet, and the point where they do, such as a reversal between two rows."""
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


def _standing_step(input_mm: Array, sigma_mm: float, leverage: Array) -> float:
    """Step from row to row below which the stage is at rest; 0 if it never moves (mm).

    In a record smoothed over k rows, differences between neighbouring rows scatter by 1/k of the scatter of a smoothed
    row.
    """
    steps = np.abs(np.diff(input_mm))
    scatter = sigma_mm * np.minimum(leverage[:-1], leverage[1:]) ** 1.5
    moving = steps[steps > np.maximum(scatter, 1e-3 * float(np.ptp(input_mm)) / max(input_mm.size, 1))]
    return STANDS * float(np.median(moving)) if moving.size else 0.0


def _flattened(input_mm: Array, sigma_mm: float, leverage: Array) -> Array:
    """Replace positions at rest by one position, and keep the path next to a rest from overshooting it.

    Smoothing makes corners overshoot by some standard deviations of a row, and the modelled play is changed by each
    overshoot.
    """
    still = _standing_step(input_mm, sigma_mm, leverage)
    if still == 0.0:
        return input_mm
    out = input_mm.copy()
    stands = np.flatnonzero(np.diff(np.r_[0, (np.abs(np.diff(input_mm)) < still).astype(int), 0]))
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
    """Akima's curve through the rows; next to an interval at rest, the curve stays within the range of the rows.

    A stage that arrives and stops has not been beyond its position of rest; an overshoot of the curve would falsify the
    play, which depends on the extreme position.
    """
    curve = np.asarray(Akima1DInterpolator(time_s, input_mm)(fine_s), dtype=np.float64)
    steps = np.abs(np.diff(input_mm))
    beside = np.minimum(np.append(steps[1:], np.inf), np.insert(steps[:-1], 0, np.inf))
    low = np.minimum(input_mm[:-1], input_mm[1:])[interval]
    high = np.maximum(input_mm[:-1], input_mm[1:])[interval]
    return np.where((beside < STANDS * steps)[interval], np.clip(curve, low, high), curve)
