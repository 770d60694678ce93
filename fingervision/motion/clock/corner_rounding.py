"""Duration of a stage's reversal that lies between two rows of its log, estimated from the frames."""

from dataclasses import dataclass, replace

import numpy as np

from fingervision.domain.effect import Array
from fingervision.motion.clock.joint_fit import Fit, fit
from fingervision.motion.clock.motion_model import Motion
from fingervision.motion.clock.play_posterior import most_likely

SHARES = (0.0, 0.25, 0.5, 0.75, 1.0, 1.25)
"""Durations of a corner that are tried, relative to the time between two rows; a longer duration would be visible in
the rows.
"""
HALF_WAY = 0.125
"""Step from the best duration to its neighbours, which are tried as well: if frames follow faster than rows, they
distinguish durations that differ by less than those in `SHARES`.
"""
STRETCHES = 24
"""Number of stretches of a recording that count as independent data. The error of a corner is common to the frames of a
move, so that a likelihood with one datum per frame would be much too narrow. The uncertainty of the stretches' scatter
is a fifth, and a stretch of an ordinary recording contains one or two moves.
"""
NEAR_PLAYS = (0.02, 0.08)
"""Further initial values of the play, relative to the largest play, because the play may compensate a wrong corner."""


@dataclass(frozen=True, slots=True, eq=False)
class Spread:
    """Spread of the clock fit over several possible solutions.

    Parameters
    ----------
    shift : ndarray of float, shape (3,)
        Mean of offset, rate and play over the solutions, minus the best solution.
    covariance : ndarray of float, shape (3, 3)
        Covariance of offset, rate and play about this mean.
    """

    shift: Array
    covariance: Array

    @classmethod
    def over(cls, at: Array, weights: Array, best: Array) -> "Spread":
        """Mean and covariance of solutions `at`, shape (n, 3), with weights, shape (n,), relative to the best one."""
        weights = weights / weights.sum()
        shift = weights @ at - best
        away = at - best - shift
        return cls(shift, np.einsum("k,ki,kj->ij", weights, away, away))

    def __add__(self, other: "Spread") -> "Spread":
        """Sum of two independent spreads."""
        return Spread(self.shift + other.shift, self.covariance + other.covariance)


def with_corners(motion: Motion, found: Fit) -> tuple[Motion, Fit, Spread]:
    """Choose the duration of all corners that explains the frames best, and the spread of the fit over other durations.

    The rows before and after a corner lie on two lines, whether the stage reversed at the point where the two lines
    meet or gradually between the rows. All reversals of a stage are rounded alike. If a rounding by some distance is
    ignored, the fitted play is wrong by twice the distance, and the offset accordingly, for any number of reversals. If
    frames follow faster than the log's rows, the frames show whether reversals are rounded.
    """
    path = motion.path
    row_s = float(np.median(np.diff(path.rows.time_s)))
    tried = {0.0: (motion, found)}
    if path.parts.corner_s.size:
        tried = {share: _turned(motion, found, share * row_s) for share in SHARES}
        first = min(SHARES, key=lambda share: tried[share][1].squares)
        for share in (first - HALF_WAY, first + HALF_WAY):
            if 0.0 < share < SHARES[-1]:
                tried[share] = _turned(motion, found, share * row_s)
    shares = np.array(sorted(tried))
    fits = [tried[share][1] for share in shares]
    squares = np.array([one.squares for one in fits])
    best = int(np.argmin(squares))
    # Creep changes a reversal in the same way as a longer duration, so that the frames do not distinguish the
    # durations.
    data = 0 if motion.creeps else min(STRETCHES, found.degrees)
    # Every duration represents the interval around it.
    widths = np.gradient(shares) if shares.size > 1 else np.ones(1)
    weights = widths * (squares / squares[best]) ** (-0.5 * data)
    at = np.array([[one.at.offset_s, one.at.rate, one.at.play_mm] for one in fits])
    turned, fitted = tried[shares[best]]
    middle = np.average(shares, weights=weights)
    u_corner_s = row_s * float(np.sqrt(np.average((shares - middle) ** 2, weights=weights)))
    turned = replace(turned, path=replace(turned.path, u_corner_s=u_corner_s))
    return turned, fitted, Spread.over(at, weights, at[best])


def _turned(motion: Motion, found: Fit, corner_s: float) -> tuple[Motion, Fit]:
    turned = replace(motion, path=motion.path.rounded(corner_s))
    near = fit(turned, found.at, free_play=True)
    return turned, min(near, most_likely(turned, found.at, NEAR_PLAYS), key=lambda one: one.squares)
