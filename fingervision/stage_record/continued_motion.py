"""A recorded motion, continued beyond a row as a straight line or a parabola."""

from dataclasses import dataclass

import numpy as np

from fingervision.domain.effect import Array

SURELY = 3.0
"""Standard uncertainties beyond which a difference is not noise of the input."""
STENCIL = 3
"""Rows that determine a motion that is not straight: position, speed and acceleration."""
STRAIGHT_ROWS = (10, 7, 5, 3)
"""Numbers of rows of a straight line, of which the largest possible is used: with ten rows, the continued line is as
uncertain as one row, with three it is twice as uncertain."""
ROUNDED = 1e-4
"""Largest distance from a straight line, as a share of the motion between two rows, for a record without noise."""


@dataclass(frozen=True, slots=True, eq=False)
class ContinuedMotion:
    """The motion on one side of a row, continued to given times.

    Parameters
    ----------
    input_mm : ndarray of float, shape (k,)
        The continued input.
    u_mm : float
        Largest standard uncertainty of the continued input from the noise of the rows.
    straight : bool
        Whether the rows lie on a straight line.
    """

    input_mm: Array
    u_mm: float
    straight: bool


def continued(
    input_mm: Array, time_s: Array, row: int, side: int, at_s: Array, sigma_mm: float
) -> ContinuedMotion | None:
    """Continue a motion beyond a row.

    Parameters
    ----------
    input_mm, time_s : ndarray of float, shape (n,)
        Recorded inputs and times.
    row, side : int
        The row beyond which the motion is continued, and -1 to continue the motion before it, 1 the motion after it.
    at_s : ndarray of float, shape (k,)
        Times.
    sigma_mm : float
        Standard uncertainty of one recorded input.

    Returns
    -------
    ContinuedMotion or None
        None if there are too few rows.
    """
    last = row if side < 0 else input_mm.size - 1 - row
    if last >= 1 and abs(input_mm[row + side] - input_mm[row]) <= SURELY * np.sqrt(2.0) * sigma_mm:
        # A stage at rest stays there.
        return ContinuedMotion(np.full(at_s.size, 0.5 * (input_mm[row] + input_mm[row + side])), sigma_mm, True)
    for count in STRAIGHT_ROWS:
        if last + 1 < count:
            continue
        rows = row + side * np.arange(count)
        t, u = time_s[rows] - time_s[row], input_mm[rows]
        slope = float(np.sum((t - t.mean()) * u) / np.sum((t - t.mean()) ** 2))
        away = u - u.mean() - slope * (t - t.mean())
        step_mm = abs(slope * float(t[-1])) / (count - 1)
        if np.max(np.abs(away)) <= SURELY * sigma_mm + ROUNDED * step_mm:
            far = at_s - time_s[row] - t.mean()
            gain = np.sqrt(1.0 / count + np.max(far**2) / float(np.sum((t - t.mean()) ** 2)))
            return ContinuedMotion(u.mean() + slope * far, float(gain) * sigma_mm, True)
    if last + 1 < STENCIL:
        return None
    rows = row + side * np.arange(STENCIL)
    weights = _parabola(time_s[rows], at_s)
    gain = np.sqrt(np.max(np.sum(weights**2, axis=1)))
    return ContinuedMotion(weights @ input_mm[rows], float(gain) * sigma_mm, False)


def _parabola(t: Array, at: Array) -> Array:
    """Weights of three rows in the parabola through them (Lagrange), shape (times, 3)."""
    columns = []
    for j in range(STENCIL):
        others = [k for k in range(STENCIL) if k != j]
        columns.append(np.prod([(at - t[k]) / (t[j] - t[k]) for k in others], axis=0))
    return np.stack(columns, axis=1)
