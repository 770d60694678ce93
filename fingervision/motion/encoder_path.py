"""Path of a stage between the lines of its encoder: reversals between straight strokes, and halts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array
from fingervision.motion.encoder import differences

LINES = (48.0, 24.0, 12.0, 6.0, 3.0)
"""Numbers of encoder lines to which a stroke is fitted; the largest number for which the stroke is straight is used.
With three lines, the stroke's position at the reversal has an uncertainty of a fifth of a step. If the log has only
about one row per line, even twelve lines leave an uncertainty of a third of a step.
"""
LEAST_ROWS = 6
"""Least number of rows on each side of a reversal to which a line is fitted."""
STRAIGHT = 1.3
"""Ratio of the readings' scatter about a straight stroke to that of rounding, above which the stroke is curved."""
ALLOWED, LINE_SIGMAS = 0.55, 1.0
"""Largest distance between a reading and a possible path: 0.55 steps (half a step, plus a tenth of half a step for
curvature), plus one standard uncertainty of the fitted line. With two standard uncertainties, curved reversals would be
accepted as sharp if few encoder lines are fitted.
"""


def sharp_reversals(time_s: Array, reading_mm: Array, smooth_mm: Array, step_mm: float) -> Array:
    """Replace a smoothed reversal by two straight strokes that meet there, if every reading allows it.

    Smoothing cuts the corner of a reversal, and no line of the encoder is crossed near it. All reversals are cut
    towards the inside, so that the fitted play is too small by twice the cut, and the offset is wrong by the time that
    a stroke takes for the cut. If a stage slows down before it reverses, two straight strokes do not pass through its
    readings, and the smoothed reversal is kept.

    Parameters
    ----------
    time_s, reading_mm, smooth_mm : ndarray of float, shape (n,)
        Times, readings and smoothed inputs of one run's rows.
    step_mm : float
        The encoder's step.

    Returns
    -------
    ndarray of float, shape (n,)
    """
    out = smooth_mm.copy()
    turns = reversals(smooth_mm, step_mm)
    for before, turn, after in zip([0, *turns], turns, [*turns[1:], smooth_mm.size - 1], strict=False):
        left = stroke(time_s, reading_mm, turn, np.arange(turn, before - 1, -1), step_mm)
        right = stroke(time_s, reading_mm, turn, np.arange(turn, after + 1), step_mm)
        if left is None or right is None or left.speed * right.speed >= 0.0:
            continue
        rows = slice(left.nearest, right.nearest + 1)
        both = np.stack([one.height_mm + one.speed * (time_s[rows] - time_s[turn]) for one in (left, right)])
        path = both.min(axis=0) if left.speed > 0.0 else both.max(axis=0)
        if np.max(np.abs(path - reading_mm[rows])) <= allowed_mm(step_mm, left, right):
            out[rows] = path
    return out


def reversals(input_mm: Array, least_mm: float) -> list[int]:
    """Row numbers of the extremes between which a path moves by more than a least distance; ripples are ignored."""
    steps = np.diff(input_mm)
    moves = np.flatnonzero(steps)
    rows = moves[1:][np.sign(steps[moves[1:]]) != np.sign(steps[moves[:-1]])]
    found: list[int] = []
    last, way = 0, 0.0
    for row in [*rows.tolist(), input_mm.size - 1]:
        moved = input_mm[row] - input_mm[last]
        if moved * way > 0.0 or (way == 0.0 and abs(moved) > least_mm):
            last, way = row, float(np.sign(moved))
        elif way != 0.0 and abs(moved) > least_mm:
            found.append(last)
            last, way = row, -way
    return found


@dataclass(frozen=True, slots=True)
class Stroke:
    """Straight line through the readings on one side of a reversal.

    Parameters
    ----------
    nearest : int
        Row at which the first line of the encoder was crossed.
    speed : float
        Slope, in mm/s.
    height_mm : float
        Value at the time of the reversal.
    u_mm : float
        Standard uncertainty of `height_mm`, due to the rounding of each row.
    """

    nearest: int
    speed: float
    height_mm: float
    u_mm: float = 0.0


def allowed_mm(step_mm: float, *lines: Stroke) -> float:
    """Largest distance (mm) between a reading and a path of strokes that agrees with the reading."""
    return ALLOWED * step_mm + LINE_SIGMAS * max((line.u_mm for line in lines), default=0.0)


def stroke(time_s: Array, reading_mm: Array, turn: int, rows: NDArray[np.intp], step_mm: float) -> Stroke | None:
    """Fit the longest straight stroke to the rows on one side of a reversal; None if there is none."""
    away = np.abs(reading_mm[rows] - reading_mm[turn])
    crossed = np.flatnonzero(away > 0.5 * step_mm)
    for lines in LINES:
        enough = np.flatnonzero(away > (lines + 0.5) * step_mm)
        if not enough.size or enough[0] - crossed[0] < LEAST_ROWS:
            continue
        taken = rows[int(crossed[0]) : int(enough[0])]
        x = time_s[taken] - time_s[turn]
        speed, height = np.polyfit(x, reading_mm[taken], 1)
        rest = reading_mm[taken] - height - speed * x
        if np.sqrt(np.sum(rest**2) / (taken.size - 2)) <= STRAIGHT * step_mm / np.sqrt(12.0):
            away_s = x - x.mean()
            leverage = 1.0 / x.size + float(x.mean()) ** 2 / float(away_s @ away_s)
            u_mm = step_mm / np.sqrt(12.0) * np.sqrt(leverage)
            return Stroke(int(taken[0]), float(speed), float(height), float(u_mm))
    return None


MORE_ROWS = 2
"""Number of rows by which a halt must be longer than the longest time with one reading during a motion, because each of
the two changes of the reading may be logged one row late.
"""
LONGER = 1.25
"""Ratio of the time with one reading to the sum of the times with the readings before and after, above which the stage
halts. A stage that reverses within a step, without a halt, has a ratio of at most 1; a stage whose speed changes, a
slightly larger one.
"""
NEAR = 3
"""Number of readings on either side from whose times the median is calculated."""


def level_halts(time_s: Array, reading_mm: Array, smooth_mm: Array, step_mm: float) -> Array:
    """Replace a smoothed halt by its reading, from the end of the preceding stroke to the start of the next one.

    During a halt, a smoothed path continues to move within an encoder step, because the readings permit this motion.
    Most halts then lie too far in the direction of the motion, and a fit mistakes this error for play and for a clock
    offset. The true position is anywhere within half a step of the reading, on both sides with equal probability.

    Parameters
    ----------
    time_s, reading_mm, smooth_mm : ndarray of float, shape (n,)
        Times, readings and smoothed inputs of one run's rows.
    step_mm : float
        The encoder's step.

    Returns
    -------
    ndarray of float, shape (n,)
    """
    out = smooth_mm.copy()
    changes = np.flatnonzero(np.abs(np.diff(reading_mm)) > 0.5 * step_mm)
    first, last = np.insert(changes + 1, 0, 0), np.append(changes, reading_mm.size - 1)
    taken_s = time_s[np.minimum(last + 1, time_s.size - 1)] - time_s[first]
    row_s = float(np.median(np.diff(time_s)))
    for k in np.flatnonzero(last - first > MORE_ROWS).tolist():
        begin, end = int(first[k]), int(last[k])
        # The stage may have had the first reading before the record began, and the last reading after the end.
        # How long the reading of the last row lasted is unknown: at least one interval between rows is assumed.
        before_s = max(float(np.median(taken_s[max(k - NEAR, 0) : k])), row_s) if k else 0.0
        after_s = max(float(np.median(taken_s[k + 1 : k + 1 + NEAR])), row_s) if k + 1 < first.size else 0.0
        if taken_s[k] <= LONGER * (before_s + after_s) + MORE_ROWS * row_s:
            continue
        level_mm = float(reading_mm[begin])
        rows, path = slice(begin, end + 1), np.full(end + 1 - begin, level_mm)
        lines = []
        # The strokes that end and begin at the halt: row, way to go from it, and time that one reading lasted there.
        sides = [(begin, -1, before_s)] * (k > 0) + [(end, 1, after_s)] * (k + 1 < first.size)
        for row, way, lasted_s in sides:
            beyond = np.arange(row, -1 if way < 0 else reading_mm.size, way)
            line = stroke(time_s, reading_mm, row, beyond, step_mm)
            if line is None:
                came_mm = level_mm - float(reading_mm[row + way])
                line = _entering(row, came_mm, -way * step_mm / lasted_s, level_mm, step_mm)
            held = np.full(abs(row - line.nearest), level_mm)
            path = np.append(held, path) if way < 0 else np.append(path, held)
            rows = slice(line.nearest, rows.stop) if way < 0 else slice(rows.start, line.nearest + 1)
            path = _joined(path, line, time_s[rows] - time_s[row], level_mm, is_leaving=way > 0)
            lines.append(line)
        if np.max(np.abs(path - reading_mm[rows])) <= allowed_mm(step_mm, *lines):
            out[rows] = path
    return out


def _entering(row: int, came_mm: float, speed_mm_s: float, level_mm: float, step_mm: float) -> Stroke:
    """Stroke that ends (with a negative speed: begins) at a halt, through the encoder line next to the halt."""
    way = float(np.sign(came_mm))
    return Stroke(row, way * speed_mm_s, level_mm - 0.5 * way * step_mm)


def _joined(path: Array, line: Stroke, since_s: Array, level_mm: float, *, is_leaving: bool) -> Array:
    """Replace the path outside the halt by the stroke."""
    at_mm = line.height_mm + line.speed * since_s
    is_outside = (at_mm - level_mm) * line.speed > 0.0 if is_leaving else (at_mm - level_mm) * line.speed < 0.0
    return np.where(is_outside, at_mm, path)


FINER = 6
"""Number of path points per row; the deviation of a chord from the curve decreases with its square, to a thirtieth."""
REACH, ABOUT_CORNER = 0.625, 15
"""Time before and after a corner, in rows, within which the path has more points, and number of these points on each
side. `corner_rounding` rounds corners there, over up to 1.25 rows. A chord over a 24th of a row reduces the rounding of
a reversal over a quarter of a row by 2 %; a chord over a sixth of a row reduced it by 20 %, which biased the fitted
play.
"""
FEWEST = 5
"""Least number of rows for a curve, and for fourth differences."""
CORNER = 0.07
"""Ratio of the standard deviation of an interpolated input to the fourth differences at both ends of its interval. A
corner of the motion anywhere between two rows causes an error of 0.105 of the change of step (RMS), which is 0.07 of
the fourth differences that it causes; the noise of the rows is then estimated within a tenth.
"""

SHARP = 5.0
"""Ratio of the change of step in an interval to those in the neighbouring intervals, and to a row's uncertainty, above
which there is a corner.
"""
ON_A_ROW = 1e-3
"""Distance of a corner from a row, in rows, below which it lies on the row."""
BUMP = float(np.sqrt(30.0))
"""Factor of the parabola x (1 - x), which is zero at both rows, that gives an RMS of 1 between them."""
STANDS = 0.1
"""Ratio of a step to its neighbour below which the stage is at rest; the noise of a log is rarely larger."""


def piece(
    time_s: Array, input_mm: Array, u_mm: Array
) -> tuple[Array, Array, Array, Array, NDArray[np.intp], Array, Array]:
    """Interpolate the input between the rows of one run.

    Returns
    -------
    tuple
        Times, inputs, standard uncertainties, the part of each uncertainty that the interpolation causes, and the
        interval of each point; then times and inputs of the corners, at which the speed changes suddenly.
    """
    if time_s.size < FEWEST:
        none = np.zeros(0)
        return time_s, input_mm, u_mm, np.zeros(time_s.size), np.arange(time_s.size), none, none
    second_signed = np.pad(differences(input_mm, time_s, 2), 1, mode="edge")
    second = np.abs(second_signed)
    fourth = np.abs(np.pad(differences(input_mm, time_s, 4), 2, mode="edge"))
    between = CORNER * np.minimum(fourth[:-1] + fourth[1:], 3.0 * np.minimum(second[:-1], second[1:]))
    found = corners_between_rows(time_s, input_mm, u_mm)
    at_s = np.array([one.at_s for one in found])
    fine_s = _points(time_s, at_s)
    interval = np.clip(np.searchsorted(time_s, fine_s, side="right") - 1, 0, time_s.size - 2)
    # At a corner on a row, the slope of Akima's curve is that of either side, depending on the rounding of times: the
    # curve then leaves both straight lines by a seventh of the way between two rows.
    beside = np.maximum(np.append(second[1:], 0.0), np.insert(second[:-1], 0, 0.0))
    sharp = second > SHARP * np.maximum(beside, u_mm)
    fine_mm = _curve(time_s, input_mm, fine_s, interval)
    chord_mm = np.interp(fine_s, time_s, input_mm)
    fine_mm = np.where((sharp[1:] | sharp[:-1])[interval], chord_mm, fine_mm)
    for one in found:
        inside = (fine_s >= time_s[one.first]) & (fine_s <= time_s[one.last])
        fine_mm[inside] = one.input_mm(fine_s[inside])
        between[one.first : one.last] = one.u_mm
    errors = np.hypot(between[interval], np.interp(fine_s, time_s, u_mm))
    share = (fine_s - time_s[interval]) / np.diff(time_s)[interval]
    bent = second_signed[interval] + second_signed[interval + 1]
    curve_mm = -np.sign(bent) * between[interval] * BUMP * share * (1.0 - share)
    turn_mm_s = np.array([one.after - one.before for one in found])
    return fine_s, fine_mm, errors, curve_mm, interval, at_s, turn_mm_s


def _points(time_s: Array, corner_s: Array) -> Array:
    """Times of the path's points: `FINER` for each row, each corner, and more points about it."""
    places = np.arange(FINER * (time_s.size - 1) + 1) / FINER
    even_s = np.interp(places, np.arange(time_s.size), time_s)
    near = np.linspace(-REACH, REACH, 2 * ABOUT_CORNER + 1) * float(np.median(np.diff(time_s)))
    about_s = (corner_s[:, None] + near).ravel()
    about_s = about_s[(about_s > time_s[0]) & (about_s < time_s[-1])]
    return np.unique(np.concatenate([even_s, about_s]))


@dataclass(frozen=True, slots=True)
class Corner:
    """Point where two straight stretches of a stage's path meet.

    Parameters
    ----------
    first, last : int
        Rows on the two lines, before and after the corner.
    at_s, at_mm : float
        Time and position at which the lines meet.
    before, after : float
        Speeds before and after the corner, in mm/s.
    u_mm : float
        Standard uncertainty of the corner's position.
    """

    first: int
    last: int
    at_s: float
    at_mm: float
    before: float
    after: float
    u_mm: float

    def input_mm(self, time_s: Array) -> Array:
        """Position on the two lines (mm); shape (n,)."""
        return np.asarray(self.at_mm + np.where(time_s < self.at_s, self.before, self.after) * (time_s - self.at_s))


def corners_between_rows(time_s: Array, input_mm: Array, u_mm: Array) -> list[Corner]:
    """Find corners of the path without a row in them: a reversal lies between two rows.

    Parameters
    ----------
    time_s, input_mm, u_mm : ndarray of float, shape (n,)
        Times, inputs and their standard uncertainties, of at least `FEWEST` rows of one run.
    """
    second = np.abs(np.pad(differences(input_mm, time_s, 2), 1, mode="edge"))
    k = np.arange(2, time_s.size - 3)
    bend, beside = second[k] + second[k + 1], second[k - 1] + second[k + 2]
    speed = np.diff(input_mm) / np.diff(time_s)
    apart = speed[k - 1] - speed[k + 1]
    met_s = np.where(
        apart != 0.0,
        (input_mm[k + 1] - input_mm[k] - speed[k + 1] * (time_s[k + 1] - time_s[k])) / np.where(apart, apart, 1.0),
        -1.0,
    )
    # A difference of rounded numbers is no bend of the path.
    bent = bend > SHARP * np.maximum(u_mm[k], np.spacing(np.max(np.abs(input_mm))))
    # A row at the corner itself shows that the stage turned there.
    share = met_s / np.diff(time_s)[k]
    isolated = (bend > SHARP * beside) & bent & (share > ON_A_ROW) & (share < 1.0 - ON_A_ROW)
    return [
        Corner(
            row,
            row + 1,
            float(time_s[row] + after),
            float(input_mm[row] + speed[row - 1] * after),
            float(speed[row - 1]),
            float(speed[row + 1]),
            float(uncertain),
        )
        for row, after, uncertain in zip(k[isolated].tolist(), met_s[isolated], beside[isolated], strict=True)
    ]


def _curve(time_s: Array, input_mm: Array, fine_s: Array, interval: NDArray[np.intp]) -> Array:
    """Interpolate by Akima's curve; next to an interval in which the stage rests, the curve stays between its rows.

    A stage that arrives and stops has not been beyond its position of rest, and the play depends on the extreme
    position.
    """
    from scipy.interpolate import Akima1DInterpolator  # half a second that is spent only with a log

    curve = np.asarray(Akima1DInterpolator(time_s, input_mm)(fine_s), dtype=np.float64)
    steps = np.abs(np.diff(input_mm))
    beside = np.minimum(np.append(steps[1:], np.inf), np.insert(steps[:-1], 0, np.inf))
    low = np.minimum(input_mm[:-1], input_mm[1:])[interval]
    high = np.maximum(input_mm[:-1], input_mm[1:])[interval]
    return np.where((beside < STANDS * steps)[interval], np.clip(curve, low, high), curve)
