"""Path of a stage that halts between two lines of its encoder: a constant position between two strokes."""

import numpy as np

from fingervision.domain.effect import Array
from fingervision.measuring.clock.sharp_reversals import Stroke, allowed_mm, stroke

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
        if k:
            line = stroke(time_s, reading_mm, begin, np.arange(begin, -1, -1), step_mm)
            if line is None:
                line = _entering(begin, level_mm - float(reading_mm[begin - 1]), step_mm / before_s, level_mm, step_mm)
            rows, path = slice(line.nearest, rows.stop), np.append(np.full(begin - line.nearest, level_mm), path)
            path = _joined(path, line, time_s[rows] - time_s[begin], level_mm, is_leaving=False)
            lines.append(line)
        if k + 1 < first.size:
            line = stroke(time_s, reading_mm, end, np.arange(end, reading_mm.size), step_mm)
            if line is None:
                line = _entering(end, level_mm - float(reading_mm[end + 1]), -step_mm / after_s, level_mm, step_mm)
            rows, path = slice(rows.start, line.nearest + 1), np.append(path, np.full(line.nearest - end, level_mm))
            path = _joined(path, line, time_s[rows] - time_s[end], level_mm, is_leaving=True)
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
