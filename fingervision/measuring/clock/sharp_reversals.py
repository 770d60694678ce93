"""Reversals of a stage between two lines of its encoder, from the straight strokes before and after."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.effect import Array

LINES = (48.0, 24.0, 12.0, 6.0, 3.0)
"""Encoder lines through which a stroke is drawn: as many of these as are straight; through three, the stroke is known
to a fifth of a step at the reversal. Where a row lies near every line, twelve leave a third of a step."""
LEAST_ROWS = 6
"""Least number of rows on each side of a reversal to which a line is fitted."""
STRAIGHT = 1.3
"""Scatter of the readings about a straight stroke, over that of rounding, above which the stroke is curved."""
ALLOWED, LINE_SIGMAS = 0.55, 1.0
"""Distance of a reading from a path that it allows: 0.55 steps (half a step, and a tenth of it for curvature), and the
standard uncertainty of the line there. Twice that lets curved turns pass that are drawn through a few lines."""


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
    turns = _reversals(smooth_mm, step_mm)
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


def _reversals(input_mm: Array, step_mm: float) -> list[int]:
    """Row numbers of the extremes between which a path moves by more than an encoder step; ripples are ignored."""
    steps = np.diff(input_mm)
    moves = np.flatnonzero(steps)
    rows = moves[1:][np.sign(steps[moves[1:]]) != np.sign(steps[moves[:-1]])]
    found: list[int] = []
    last, way = 0, 0.0
    for row in [*rows.tolist(), input_mm.size - 1]:
        moved = input_mm[row] - input_mm[last]
        if moved * way > 0.0 or (way == 0.0 and abs(moved) > step_mm):
            last, way = row, float(np.sign(moved))
        elif way != 0.0 and abs(moved) > step_mm:
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
        Standard uncertainty of that value, by the rounding of each row.
    """

    nearest: int
    speed: float
    height_mm: float
    u_mm: float = 0.0


def allowed_mm(step_mm: float, *lines: Stroke) -> float:
    """Largest distance (mm) of a reading from a path of strokes that it allows."""
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
