"""Turning points of a motion that lie between two recorded rows.

A stage that reverses between two rows goes farther than either of them shows. At a constant speed v and rows dt apart,
the rows miss up to v dt / 2 of the stroke. A play is that small too: without the turning points, a delay, which is the
same as a play on every straight stroke, explains the rows beside a reversal better.
"""

from dataclasses import dataclass

import numpy as np

from fingervision.domain.effect import Array

STENCIL = 3
"""Rows on either side that determine the motion up to the reversal: position, speed and acceleration."""
LONGEST_GAP = 5.0
"""Longest time between two rows, in median time steps, over which the motion is continued: a few rows are missing. In
a longer pause of the record, the stage may have done anything."""
SURELY = 3.0
"""Standard uncertainties by which a turning point must lie beyond the rows, so that noise of the input adds none."""
FINE = 33
"""Times between two rows at which both continuations are compared: the turning point is then exact to a thousandth of
the motion between two rows."""


@dataclass(frozen=True, slots=True)
class TurningPoint:
    """A turning point of the input between two rows.

    Parameters
    ----------
    after : int
        Index of the row before it.
    time_s, input_mm : float
        Its time and input.
    """

    after: int
    time_s: float
    input_mm: float


def turning_points(input_mm: Array, time_s: Array, runs: tuple[slice, ...], sigma_mm: float) -> list[TurningPoint]:
    """Find the turning points that lie beyond the recorded rows.

    The motion before and the motion after a reversal are continued by parabolas through three rows each; the stage
    turns where they intersect. For a motion without a corner, both parabolas are the same curve, and its vertex is
    the turning point.

    Parameters
    ----------
    input_mm, time_s : ndarray of float, shape (m,)
        Recorded input, read in motion, and times.
    runs : tuple of slice
        Rows of each run.
    sigma_mm : float
        Standard uncertainty of one recorded input.

    Returns
    -------
    list of TurningPoint
        Sorted by row.
    """
    found = []
    for run in runs:
        u, t = input_mm[run], time_s[run]
        if u.size < 2 * STENCIL:
            continue
        longest = LONGEST_GAP * float(np.median(np.diff(t)))
        step = np.sign(np.diff(u))
        for way in (1.0, -1.0):
            # Rows at which the motion away from them changes: the turning point lies before or after such a row.
            tops = 1 + np.flatnonzero((way * step[:-1] > 0.0) & (way * step[1:] <= 0.0))
            for top in tops.tolist():
                beside = [_beyond(way * u, t, i, longest, sigma_mm) for i in (top - 1, top)]
                best = max((point for point in beside if point is not None), key=lambda p: p.input_mm, default=None)
                if best is not None:
                    found.append(TurningPoint(run.start + best.after, best.time_s, way * best.input_mm))
    return sorted(found, key=lambda point: point.after)


def _beyond(u: Array, t: Array, i: int, longest_s: float, sigma_mm: float) -> TurningPoint | None:
    """Find the turning point above the rows i and i + 1; None if the rows show none."""
    # Two equal rows are a short stop: a stage in motion is seldom at exactly the same place on both sides of a corner.
    if i < STENCIL - 1 or i + STENCIL >= u.size or t[i + 1] - t[i] > longest_s or u[i] == u[i + 1]:
        return None
    before, after = slice(i - STENCIL + 1, i + 1), slice(i + 1, i + 1 + STENCIL)
    at = np.linspace(t[i], t[i + 1], FINE)[1:-1]
    ahead, behind = _weights(t[before], at), _weights(t[after], at)
    rising, falling = ahead @ u[before], behind @ u[after]
    # No farther than at the speeds beside the reversal: a parabola through rows of a bend overestimates it.
    lines = np.minimum(_line(u, t, i - 1, i, at), _line(u, t, i + 2, i + 1, at))
    height = np.minimum(np.minimum(rising, falling), lines)
    top = int(np.argmax(height))
    gain = float(np.sqrt(max(np.sum(ahead[top] ** 2), np.sum(behind[top] ** 2))))
    if height[top] - max(u[i], u[i + 1]) <= SURELY * gain * sigma_mm:
        return None
    return TurningPoint(i, float(at[top]), float(height[top]))


def _weights(t: Array, at: Array) -> Array:
    """Weights of three rows in the parabola through them (Lagrange), shape (times, 3)."""
    columns = []
    for j in range(STENCIL):
        others = [k for k in range(STENCIL) if k != j]
        columns.append(np.prod([(at - t[k]) / (t[j] - t[k]) for k in others], axis=0))
    return np.stack(columns, axis=1)


def _line(u: Array, t: Array, one: int, other: int, at: Array) -> Array:
    """Continue the straight line through two rows."""
    return np.asarray(u[other] + (u[other] - u[one]) / (t[other] - t[one]) * (at - t[other]))
