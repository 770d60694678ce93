"""Halts of a stage between two lines of its encoder: the reading's place, met by the strokes before and after."""

import numpy as np

from fingervision.domain.effect import Array
from fingervision.measuring.clock.sharp_reversals import Stroke, allowed_mm, stroke

MORE_ROWS = 2
"""Rows by which a halt is longer than the longest time that moving strokes may spend on one reading: the rows at which
the reading changes are late by one each."""
LONGER = 1.25
"""Time on one reading, over that on the readings before and after together, from which on the stage halts: a stage that
turns within a step, without a halt, stays for at most the sum; a stroke whose speed changes, somewhat longer."""
NEAR = 3
"""Readings on either side of which the median time is taken."""


def level_halts(time_s: Array, reading_mm: Array, smooth_mm: Array, step_mm: float) -> Array:
    """Replace a smoothed halt by the reading, from where the stroke before meets it until the stroke after leaves it.

    A smoothed path runs on within an encoder step where the stage stands, because every row allows it; most halts are
    then too far out in the direction of the motion, which a fit takes for play and for an offset. The true place lies
    anywhere within half a step of the reading, on either side alike.

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
        # The first and the last reading of a record were there before, and stay.
        before_s = float(np.median(taken_s[max(k - NEAR, 0) : k])) if k else 0.0
        after_s = float(np.median(taken_s[k + 1 : k + 1 + NEAR])) if k + 1 < first.size else 0.0
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
    """Stroke into (or, with a negative speed, out of) a level over the line of the encoder at its edge."""
    way = float(np.sign(came_mm))
    return Stroke(row, way * speed_mm_s, level_mm - 0.5 * way * step_mm)


def _joined(path: Array, line: Stroke, since_s: Array, level_mm: float, *, is_leaving: bool) -> Array:
    """Put the part of a stroke that lies outside the halt into the path."""
    at_mm = line.height_mm + line.speed * since_s
    is_outside = (at_mm - level_mm) * line.speed > 0.0 if is_leaving else (at_mm - level_mm) * line.speed < 0.0
    return np.where(is_outside, at_mm, path)
