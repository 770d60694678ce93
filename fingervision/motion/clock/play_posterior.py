"""Clock offset and rate, marginalised over all values of the play that the motion allows."""

from dataclasses import dataclass, replace

import numpy as np

from fingervision.domain.effect import Array
from fingervision.motion.clock.joint_fit import Fit, fit, squares_at
from fingervision.motion.clock.motion_model import Alignment, Motion

PLAY_PRIOR_MM = 0.1
"""Scale (mm) of the half-Cauchy prior of the play, typical of worn or geared stages; a tenfold play remains possible.
"""
MOST_PLAY_MM = 0.5
"""Largest play, as in the catalogue of effects."""
MOST_OF_STROKE = 0.9
"""Largest play relative to the stroke; with a larger play the gap hardly moves."""
FIRST_PLAYS = (0.0, 0.004, 0.008, 0.016, 0.03, 0.06, 0.12, 0.25, 0.5, 1.0)
"""Initial values of the play relative to the largest play: a factor of two apart, so that each fit converges to the
nearest minimum."""
BESIDE_S, BESIDE_STEP_S = 2.0, 0.1
"""Range and step of the offsets tried beside a correlation peak: halts of a staircase motion seldom last longer than 2
s, and moves that take less than 0.1 s have a narrow minimum of their own."""
VALLEYS = 4
"""Number of minima beside a correlation peak from which a fit is started: the halts of a staircase motion within
`BESIDE_S` are at most about as many, and the lowest value on the grid of offsets and plays need not lie in the lowest
valley."""
OUT_OF_REACH = 14.0
"""Twice the logarithm of the likelihood ratio above which a value of the play is neglected: a weight of one in a
thousand."""
NODES = 15
"""Number of play values in the integration: a normal posterior truncated at 3.7 standard deviations is integrated to
1e-4."""


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Posterior of clock offset and rate, marginalised over the play.

    Parameters
    ----------
    best : Fit
        Fit with the most likely play.
    offset_s, rate : float
        Posterior means; the offset is that at the middle of the frames.
    covariance : ndarray of float, shape (2, 2)
        Posterior covariance of offset and rate.
    play_mm, u_play_mm : float
        Posterior mean and standard deviation of the play.
    """

    best: Fit
    offset_s: float
    rate: float
    covariance: Array
    play_mm: float
    u_play_mm: float


def most_likely(motion: Motion, start: Alignment, plays: tuple[float, ...] = FIRST_PLAYS) -> Fit:
    """Fit from several starting values of the play and keep the best fit; `plays` are fractions of the largest play.

    The sum of squares has narrow valleys in which play and offset are correlated; a search at a fixed play stops near,
    but not at, the minimum. The best two fits, and the starting point, are therefore refined with the play as a free
    parameter.
    """
    longest_mm = longest_play_mm(motion)
    held = [fit(motion, replace(start, play_mm=share * longest_mm), free_play=False) for share in plays]
    held.sort(key=lambda one: one.squares)
    begun = [start] if start.play_mm > 0.0 else []
    free = [fit(motion, at, free_play=True) for at in (*begun, *(one.at for one in held[:2]))]
    return min((*held, *free), key=lambda one: one.squares)


def beside(motion: Motion, found: Fit, plays: tuple[float, ...]) -> Fit:
    """Search for a lower minimum at offsets nearby, because a fit only finds the valley in which it starts.

    The correlation ignores play; a play as wide as a step of a staircase motion shifts the correlation's peak by the
    duration of a whole halt.
    """
    longest_mm = longest_play_mm(motion)
    valleys: list[tuple[float, Alignment]] = []
    for by_s in np.arange(-BESIDE_S, BESIDE_S + 0.5 * BESIDE_STEP_S, BESIDE_STEP_S):
        tried = [
            replace(found.at, offset_s=found.at.offset_s + float(by_s), play_mm=share * longest_mm)
            for share in (*plays, found.at.play_mm / longest_mm)
        ]
        valleys.append(min(((squares_at(motion, at), at) for at in tried), key=lambda one: one[0]))
    squares = np.array([np.inf, *(one for one, _ in valleys), np.inf])
    is_lowest = (squares[1:-1] <= squares[:-2]) & (squares[1:-1] <= squares[2:])
    lowest = sorted((valleys[k] for k in np.flatnonzero(is_lowest)), key=lambda one: one[0])[:VALLEYS]
    return min((found, *(most_likely(motion, at, plays) for _, at in lowest)), key=lambda one: one.squares)


def posterior(motion: Motion, best: Fit) -> Posterior:
    """Integrate the posterior over the play, across the range in which the likelihood is not negligible.

    If the stage moves at constant speed, small values of play and offset are indistinguishable, and the likelihood is
    far from normal. The likelihood is therefore evaluated at each value of the play, as a Student distribution, because
    the residual variance is estimated.
    """
    longest_mm, degrees = longest_play_mm(motion), best.degrees
    known: dict[float, Fit] = {}

    def at(play_mm: float, near: Alignment) -> Fit:
        if play_mm not in known:
            known[play_mm] = fit(motion, replace(near, play_mm=play_mm), free_play=False)
        return known[play_mm]

    def worse(found: Fit, than: Fit) -> float:
        return float(degrees * np.log(found.squares / than.squares))

    top = at(best.at.play_mm, best.at)
    for share in FIRST_PLAYS:
        top = min(top, at(share * longest_mm, top.at), key=lambda one: one.squares)
    ends = []
    for bound_mm in (0.0, longest_mm):
        inside, outside = top.at.play_mm, bound_mm
        near = top.at
        if worse(at(outside, near), top) < OUT_OF_REACH:
            ends.append(outside)
            continue
        for _ in range(9):
            middle = 0.5 * (inside + outside)
            found = at(middle, near)
            top = min(top, found, key=lambda one: one.squares)
            excess = worse(found, top)
            if excess < OUT_OF_REACH:
                inside, near = middle, found.at
            else:
                outside = middle
                if excess < 1.5 * OUT_OF_REACH:
                    break
        ends.append(outside)
    # The nodes are computed from the maximum outwards, each starting from its neighbour's solution.
    nodes = np.linspace(ends[0], ends[1], NODES)
    order = np.argsort(np.abs(nodes - top.at.play_mm))
    fits: dict[int, Fit] = {}
    for k in order:
        beside = [fits[j] for j in (k - 1, k + 1) if j in fits]
        fits[int(k)] = at(float(nodes[k]), (beside[0] if beside else top).at)
    lowest = min(one.squares for one in fits.values())
    weights = np.array(
        [
            (fits[k].squares / lowest) ** (-0.5 * degrees)
            / np.sqrt(max(float(np.linalg.det(fits[k].normal / fits[k].normal.diagonal().mean())), 1e-30))
            / (1.0 + (nodes[k] / PLAY_PRIOR_MM) ** 2)
            for k in range(NODES)
        ]
    )
    weights[[0, -1]] *= 0.5
    weights /= weights.sum()
    widen = degrees / max(degrees - 2, 1)
    means = np.array([[fits[k].at.offset_s, fits[k].at.rate] for k in range(NODES)])
    inner = np.stack([np.linalg.inv(fits[k].normal)[:2, :2] * widen for k in range(NODES)])
    mean = weights @ means
    away = means - mean
    covariance = np.einsum("k,kij->ij", weights, inner) + np.einsum("k,ki,kj->ij", weights, away, away)
    play_mm = float(weights @ nodes)
    u_play_mm = float(np.sqrt(weights @ (nodes - play_mm) ** 2))
    return Posterior(top, float(mean[0]), float(mean[1]), covariance, play_mm, u_play_mm)


def longest_play_mm(motion: Motion) -> float:
    """Largest play (mm) that is searched."""
    return min(MOST_PLAY_MM, MOST_OF_STROKE * float(np.ptp(motion.drive.input_mm)))
