"""Path of the stage between the rows of its log, with its uncertainty."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array
from fingervision.motion.encoder_path import STANDS, level_halts, piece, sharp_reversals
from fingervision.motion.local_polynomial_smoothing import CORNER_ROWS, SmoothedRecord, flattened, read_again

LONG_ROWS = 4 * CORNER_ROWS
"""Number of rows above which the ends of a stretch are left out when its rounding errors are examined."""
AVERAGED = 0.5
"""Leverage below which a smoothed row is mainly a mean of several rows, and has an error in common with its neighbours.
"""
RIPPLE = 0.5
"""Share of a smoothed stroke's variance that changes from one encoder line to the next, because the smoothing window
then ends at another line. If this share counted as common to a window, ripples of the path could determine the offset.
"""


LEAST_LEVERAGE = 1.0 / 241.0
"""Leverage of a row in the widest window of the smoothing."""


STRAIGHT, OF_UNCERTAINTY, LONG = 3e-6, 0.1, 1e6
"""Distance from a straight line below which a point may be left out, as a share of the path's span and of its standard
uncertainty; and length of the axis of time relative to that of the input."""


@dataclass(frozen=True, slots=True, eq=False)
class SharedErrors:
    """Stretches of the log, each with one error that all of its rows share.

    Parameters
    ----------
    begin_s : ndarray of float, shape (g - 1,)
        Start times of the second and the later stretches.
    u_mm : ndarray of float, shape (g,)
        Standard uncertainty of each stretch's shared error.
    halts : ndarray of bool, shape (g,)
        Whether the stretch is a halt or a reversal, whose position determines the state of the play.
    outward : ndarray of float, shape (g,)
        1 for a reversal without a halt at a maximum, -1 at a minimum, else 0.
    """

    begin_s: Array
    u_mm: Array
    halts: NDArray[np.bool_]
    outward: Array


@dataclass(frozen=True, slots=True, eq=False)
class ErrorParts:
    """Contributions to the uncertainty of a path, from which correlated errors can be drawn.

    Parameters
    ----------
    between_mm : ndarray of float, shape (n,)
        Standard uncertainty of the curve at each point of the path, towards the outside of its bend; zero at a row.
    interval : ndarray of int, shape (n,)
        Interval between two rows in which each point lies.
    corner_s, turn_mm_s : ndarray of float, shape (c,)
        Times at which two straight lines meet, and the change of speed there.
    """

    between_mm: Array
    interval: NDArray[np.intp]
    corner_s: Array
    turn_mm_s: Array


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
        Errors that neighbouring rows have in common.
    rows : DriveHistory
        The log itself.
    record : SmoothedRecord
        The log's rows, smoothed.
    parts : ErrorParts
        Contributions to the uncertainty.
    corner_s, u_corner_s : float
        Duration of every corner between two rows, and its standard uncertainty.
    """

    drive: DriveHistory
    u_mm: Array
    shared: SharedErrors
    rows: DriveHistory
    record: SmoothedRecord
    parts: ErrorParts
    corner_s: float = 0.0
    u_corner_s: float = 0.0

    @classmethod
    def of(cls, log: DriveHistory) -> "LogPath":
        """Smooth the rows of the log as far as their errors are random, and interpolate them by Akima's curve.

        Akima's interpolation is chosen because it preserves corners.

        Without smoothing, the model of play would respond to every noise peak, as if the input had gone further by
        about two standard deviations of the noise.
        """
        names = log.run or ("",) * log.time_s.size
        lengths = [len(list(group)) for _, group in groupby(names)]
        ends = np.cumsum([0, *lengths])
        runs = tuple(slice(int(begin), int(end)) for begin, end in pairwise(ends))
        record = SmoothedRecord.of(log.input_mm, log.time_s, runs)
        smooth_mm, still = _levelled(record)
        u_mm, leverage = record.sigma_mm * np.sqrt(record.leverage), record.leverage
        shared = SharedErrors(np.zeros(0), np.zeros(1), np.zeros(1, dtype=np.bool_), np.zeros(1))
        if record.step_mm > 0.0:
            shared, u_mm = _shared_errors(
                log.time_s, record.recorded_mm, smooth_mm, u_mm, leverage, still, record.step_mm
            )
        pieces = [piece(log.time_s[run], smooth_mm[run], u_mm[run]) for run in runs]
        of_runs = tuple(names[run.start] for run, part in zip(runs, pieces, strict=True) for _ in part[0])
        time_s, input_mm, errors = (np.concatenate([part[k] for part in pieces]) for k in range(3))
        drive = DriveHistory(time_s, input_mm, None if log.run is None else of_runs)
        before = np.cumsum([0, *(part[0].size for part in pieces[:-1])])
        parts = ErrorParts(
            np.concatenate([part[3] for part in pieces]),
            np.concatenate([part[4] + int(first) for part, first in zip(pieces, before, strict=True)]),
            *(np.concatenate([part[k] for part in pieces]) for k in (5, 6)),
        )
        return cls(drive, errors, shared, log, replace(record, smooth_mm=smooth_mm), parts)

    def rounded(self, corner_s: float) -> "LogPath":
        """Give every corner another duration, as under constant acceleration: two tangents and a parabola."""
        input_mm = self.drive.input_mm + self._rounding_mm(corner_s) - self._rounding_mm(self.corner_s)
        return replace(self, drive=replace(self.drive, input_mm=input_mm), corner_s=corner_s)

    def _rounding_mm(self, corner_s: float) -> Array:
        """Distance of the path from sharp corners; shape (n,)."""
        time_s, out = self.drive.time_s, np.zeros(self.drive.time_s.size)
        for at_s, turn in zip(self.parts.corner_s, self.parts.turn_mm_s, strict=True):
            near = slice(*np.searchsorted(time_s, (at_s - 0.5 * corner_s, at_s + 0.5 * corner_s)))
            if near.stop > near.start and corner_s > 0.0:
                out[near] += turn / (2.0 * corner_s) * (0.5 * corner_s - np.abs(time_s[near] - at_s)) ** 2
        return out

    def thinned(self) -> "LogPath":
        """Leave out points on the straight line between others (Ramer 1972, doi:10.1016/S0146-664X(72)80017-0).

        Every point costs an evaluation of the model. Points with an uncertain curve, and beside a corner of uncertain
        duration, stay.
        """
        from skimage.measure import approximate_polygon  # a fifth of a second that is spent only with a log

        time_s, input_mm = self.drive.time_s, self.drive.input_mm
        span_mm = float(np.ptp(input_mm))
        near_mm = max(STRAIGHT * span_mm, OF_UNCERTAINTY * float(np.median(self.u_mm)))
        # Over a long axis of time, the distance from a line is the distance in the input.
        axis = LONG * span_mm / float(np.ptp(time_s)) * time_s
        kept = np.isin(axis, approximate_polygon(np.column_stack([axis, input_mm]), near_mm)[:, 0])  # type: ignore[no-untyped-call]
        kept |= np.abs(self.parts.between_mm) > near_mm
        corner_s = self.parts.corner_s
        if self.u_corner_s > 0.0 and corner_s.size:
            nearest = np.searchsorted(0.5 * (corner_s[1:] + corner_s[:-1]), time_s)
            kept |= np.abs(time_s - corner_s[nearest]) < 0.5 * self.corner_s + 2.0 * self.u_corner_s
        if self.drive.run is not None:
            names = np.array(self.drive.run)
            borders = names[1:] != names[:-1]
            kept[1:] |= borders
            kept[:-1] |= borders
        run = None if self.drive.run is None else tuple(np.array(self.drive.run)[kept].tolist())
        drive = DriveHistory(time_s[kept], input_mm[kept], run)
        parts = replace(self.parts, between_mm=self.parts.between_mm[kept], interval=self.parts.interval[kept])
        return replace(self, drive=drive, u_mm=self.u_mm[kept], parts=parts)

    def later(self, by_s: float) -> "LogPath":
        """Return the path of a stage that moved later by a given time."""
        drive, rows = (replace(one, time_s=one.time_s + by_s) for one in (self.drive, self.rows))
        shared = replace(self.shared, begin_s=self.shared.begin_s + by_s)
        parts = replace(self.parts, corner_s=self.parts.corner_s + by_s)
        return replace(self, drive=drive, rows=rows, shared=shared, parts=parts)

    def runs(self, names: Sequence[str]) -> tuple[slice, ...]:
        """Points of the path in each of some runs of a table; all points if the log has no runs."""
        if self.drive.run is None:
            return (slice(0, self.drive.time_s.size),) * len(names)
        own = np.array(self.drive.run)
        return tuple(slice(int(at[0]), int(at[-1]) + 1) for at in (np.flatnonzero(own == name) for name in names))


def _levelled(record: SmoothedRecord) -> tuple[Array, float]:
    """Smoothed rows that do not overshoot rests and turn sharply, and the motion from row to row of a rest (mm)."""
    smooth_mm, runs = record.smooth_mm.copy(), record.runs
    for run in runs:
        still = _standing_step(smooth_mm[run], record.sigma_mm, record.leverage[run])
        smooth_mm[run] = flattened(smooth_mm[run], record.recorded_mm[run], record.sigma_mm, still)
    still = _standing_step(smooth_mm, record.sigma_mm, record.leverage)
    for run in runs if record.step_mm > 0.0 else ():
        row = record.time_s[run], record.recorded_mm[run]
        smooth_mm[run] = level_halts(*row, smooth_mm[run], record.step_mm)
        smooth_mm[run] = sharp_reversals(*row, smooth_mm[run], record.step_mm)
    return smooth_mm, still


def _shared_errors(
    time_s: Array, input_mm: Array, smooth_mm: Array, u_mm: Array, leverage: Array, still_mm: float, step_mm: float
) -> tuple[SharedErrors, Array]:
    """Split an encoder's rounding error into a part that neighbouring rows share and a random part.

    Rounding errors do not average out like noise. A stage at rest may be anywhere within one step of the encoder. If a
    stage moves by whole steps from row to row, the rounding error is the same in each row. For a slower stage, only the
    crossings of the encoder's lines are informative. A shift of the path is possible as long as every row stays within
    half a step of the path; if the rounding errors cover the whole step, no shift is possible. At the beginning and the
    end of a stroke, motion within one encoder step is invisible.

    Returns
    -------
    shared, u_mm : SharedErrors, ndarray of float, shape (n,)
        The shared errors, and the random standard uncertainty of each row.
    """
    rounding_mm = step_mm / float(np.sqrt(12.0))
    direction = np.where(np.abs(np.diff(smooth_mm)) <= still_mm, 0, np.sign(np.diff(smooth_mm))).astype(int)
    ends = np.append(np.flatnonzero(np.diff(direction)) + 1, time_s.size - 1)
    stretches: list[tuple[int, int]] = []
    for begin, end in zip(np.insert(ends[:-1], 0, 0), ends, strict=True):
        # Halts at the same position that smoothing has separated are one halt.
        if stretches and np.ptp(input_mm[stretches[-1][0] : end + 1]) == 0.0:
            stretches[-1] = (stretches[-1][0], int(end))
        else:
            stretches.append((int(begin), int(end)))
    away = input_mm - smooth_mm
    scatter_mm = np.where(leverage < AVERAGED, 0.0, u_mm)
    moved_mm = [abs(float(smooth_mm[end] - smooth_mm[begin])) for begin, end in stretches]
    # Number of rows near the end of a stroke in which the crossing of an encoder line may be missed; zero for a halt.
    near = [
        max(CORNER_ROWS, round(step_mm * (end - begin) / moved)) if moved > step_mm else 0
        for (begin, end), moved in zip(stretches, moved_mm, strict=True)
    ]
    ripple_mm = np.zeros(time_s.size)
    found: list[tuple[int, float, bool, float]] = []
    unseen: list[tuple[int, int]] = []
    for k, (begin, end) in enumerate(stretches):
        inner = CORNER_ROWS if end - begin > LONG_ROWS else 0
        middle = slice(begin + inner, end + 1 - inner)
        left_mm = max(step_mm - float(np.ptp(away[middle])), 0.0) / float(np.sqrt(12.0))
        scatter_mm[middle] *= float(np.sqrt(max(1.0 - (left_mm / rounding_mm) ** 2, 0.0)))
        if not near[k]:
            found.append((begin, left_mm, True, 0.0))
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
            common_mm = error_mm * float(np.sqrt(1.0 - RIPPLE))
            found += [(int(row), common_mm, False, 0.0) for row in np.linspace(first, last, count + 1)[:-1]]
            ripple_mm[first : last + 1] = error_mm * float(np.sqrt(RIPPLE))
        if last < end:  # a reversal without a halt, whose position is known to one encoder step
            turn = min(max(last, first), end)
            found.append((turn, rounding_mm, True, float(np.sign(smooth_mm[end] - smooth_mm[begin]))))
    for begin, end in unseen:
        near_rows = slice(max(begin, 0), min(end, time_s.size - 1) + 1)
        scatter_mm[near_rows] = np.maximum(scatter_mm[near_rows], rounding_mm)
    scatter_mm = np.hypot(scatter_mm, ripple_mm)
    rows, errors, halts, outward = (np.array(part) for part in zip(*found, strict=True))
    return SharedErrors(time_s[rows[1:]], errors, halts, outward), scatter_mm


def _standing_step(input_mm: Array, sigma_mm: float, leverage: Array) -> float:
    """Motion from row to row (mm) below which the stage is at rest; 0 if it never moves.

    In a record smoothed over k rows, differences between neighbouring rows scatter by 1/k of the scatter of a smoothed
    row.
    """
    steps = np.abs(np.diff(input_mm))
    scatter = sigma_mm * np.minimum(leverage[:-1], leverage[1:]) ** 1.5
    moving = steps[steps > np.maximum(scatter, 1e-3 * float(np.ptp(input_mm)) / max(input_mm.size, 1))]
    return STANDS * float(np.median(moving)) if moving.size else 0.0


DRAWS = 48
"""Number of draws; a variance then has a relative standard uncertainty of a fifth, and a standard deviation of a tenth.
"""
SEED = 16
"""Seed of the draws, so that the same log gives the same uncertainty."""
ALIKE = 0.5
"""Share of the variance between rows that all bends have in common. If a corner lies anywhere between two rows,
interpolation cuts it by 0.0725 of its change of step on average, and by 0.105 as RMS, so that the squared mean is half
of the mean square.
"""

TURNS_ALIKE = 1.0
"""Error that all reversals without a halt have in common, relative to the standard uncertainty of an encoder's
rounding. If a stage slows down within half a step of an encoder line, the smoothed path turns up to half a step too
far, which is 1.7 times the rounding's standard uncertainty.
"""


def drawn_paths(path: LogPath) -> Iterator[LogPath]:
    """Draw paths of the stage that are compatible with the log's rows.

    Four kinds of error are drawn. First, the path is recorded again, with random noise and a random zero of the
    encoder, and its error averaged over as many rows as the smoothing averages. The error of rounding is the same in
    all rows of a stroke if the stage moves by nearly whole steps from row to row. Second, a halt or a reversal may be
    anywhere within a step of the encoder, and all reversals between two lines are cut on the same side. Third, a corner
    may lie anywhere between two rows, and a smooth curve cuts all corners on the same side. Fourth, all corners last
    longer or shorter, where the duration was estimated.

    Parameters
    ----------
    path : LogPath
        Path with its uncertainty.

    Yields
    ------
    LogPath
    """
    rng = np.random.default_rng(SEED)
    record, time_s, parts, shared = path.record, path.drive.time_s, path.parts, path.shared
    stretch = np.searchsorted(shared.begin_s, path.rows.time_s, side="right")
    span = 1.0 / np.clip(record.leverage, LEAST_LEVERAGE, 1.0)
    for _ in range(DRAWS):
        read_mm = read_again(record.smooth_mm, record.sigma_mm, record.step_mm, rng)
        moving_mm = _averaged(read_mm - record.smooth_mm, span)
        halted_mm = shared.u_mm * (rng.normal(size=shared.u_mm.size) + TURNS_ALIKE * rng.normal() * shared.outward)
        rows_mm = np.where(shared.halts[stretch], halted_mm[stretch], moving_mm)
        common = np.sqrt(ALIKE) * rng.normal()
        own = np.sqrt(1.0 - ALIKE) * rng.normal(size=int(parts.interval.max()) + 1)
        input_mm = path.drive.input_mm + np.interp(time_s, path.rows.time_s, rows_mm)
        input_mm = input_mm + (common + own[parts.interval]) * parts.between_mm
        drawn = replace(path, drive=replace(path.drive, input_mm=input_mm))
        yield drawn.rounded(abs(path.corner_s + path.u_corner_s * rng.normal())) if path.u_corner_s else drawn


def _averaged(values: Array, span: Array) -> Array:
    """Mean of values over `span` rows about each row."""
    sums = np.append(0.0, np.cumsum(values))
    rows = np.arange(values.size)
    half = 0.5 * (span - 1.0)
    low = np.clip(np.round(rows - half), 0, rows).astype(int)
    high = np.clip(np.round(rows + half), rows, values.size - 1).astype(int) + 1
    return np.asarray((sums[high] - sums[low]) / (high - low))
