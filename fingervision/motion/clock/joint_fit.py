"""Joint fit of clock offset, clock rate, play, initial state of the play, and scale, by variable projection."""

from dataclasses import dataclass, replace

import numpy as np

from fingervision.domain.effect import Array
from fingervision.motion.clock.motion_model import CREEP_S, Alignment, Motion

OFFSET_PRIOR_S, PLAY_PRIOR_MM = 1e3, 1e3
"""Standard deviations of uninformative priors, which keep the normal matrix regular if nothing moves."""
RATE_PRIOR = 6e-4
"""Prior standard deviation of the clocks' relative rate: that of a uniform distribution from -0.1 to 0.1 %."""
START_PRIOR = 0.58
"""Prior standard deviation of the play's initial state: that of a uniform distribution from -1 to 1."""
BEND_PRIOR = 0.1
"""Prior standard deviation of the relative change of slope (gap against input) at a knot. Large deflection changes the
slope of a flexure gripper by a few per cent in all; a weaker prior would allow any smooth one-way motion to be shifted
in time. Strong evidence, such as the kink where the fingers meet, outweighs the prior."""
CREEP_PRIOR = 0.02
"""Prior standard deviation of the creep's share of the motion at each time constant: metals creep by 0.1 % of a strain,
printed polymers by one to five per cent per decade of time (Findley, Lai & Onaran 1976, ISBN 978-0-7204-2369-6)."""
OTHER_CREEP = (1.0 / 3.0, 3.0)
"""Factors on the time constants of creep, half a decade down and up, because the true course of the creep is unknown.
"""
STEPS = 12
"""Largest number of Gauss-Newton steps; three to five steps suffice from the peak of the correlation."""
SETTLED = 1e-3
"""Step, in standard uncertainties, below which the iteration has converged."""
OFFSET_STEP_S, RATE_STEP, START_STEP, PLAY_STEP = 1e-4, 1e-7, 0.02, 1e-5
"""Step sizes of the numerical derivatives: small compared with a frame's duration, a clock's rate, the range of the
play's state and an encoder's step (mm)."""


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A joint fit of the gap's motion to the motion in the log.

    Parameters
    ----------
    at : Alignment
        Estimated offset, rate, play and initial state.
    squares : float
        Sum of squares of the whitened residuals, including the priors' terms, in mm^2.
    degrees : int
        Degrees of freedom.
    normal : ndarray of float, shape (3, 3) or (4, 4)
        Normal matrix of offset, rate, initial state (and play), divided by the residual variance.
    residual_mm : ndarray of float, shape (n,)
        Gap minus its prediction, not whitened.
    scale : float
        Change of the gap over half the log's range, in mm; negative if the gap closes as the input increases.
    """

    at: Alignment
    squares: float
    degrees: int
    normal: Array
    residual_mm: Array
    scale: float

    @property
    def variance_mm2(self) -> float:
        """Variance of the whitened residuals."""
        return self.squares / self.degrees


def fit(motion: Motion, start: Alignment, *, free_play: bool) -> Fit:
    """Fit offset, rate, initial state (and play) by Gauss-Newton; scale and bends are solved for in each step.

    Parameters
    ----------
    motion : Motion
        The frames and the log.
    start : Alignment
        Initial estimate.
    free_play : bool
        Whether the play is fitted too; otherwise it keeps its initial value.

    Notes
    -----
    Variable projection: Golub & Pereyra 1973, doi:10.1137/0710036, with Kaufman's approximation.
    """
    at = start
    solved = solve(motion, at)
    longest_mm = 0.9 * float(np.ptp(motion.drive.input_mm))
    damping = 1e-6
    for _ in range(STEPS):
        jacobian = _jacobian(motion, at, solved, free_play=free_play)
        variance = solved.squares / max(solved.degrees, 1)
        prior = prior_of(jacobian.shape[1]) * variance
        pull = prior @ np.array([0.0, at.rate, at.start, 0.0][: jacobian.shape[1]])
        normal = jacobian.T @ jacobian + prior
        root = np.sqrt(np.maximum(np.diag(normal), 1e-30))
        scaled = normal / np.outer(root, root)
        for _ in range(6):
            step = np.linalg.solve(scaled + damping * np.eye(root.size), (jacobian.T @ solved.white - pull) / root)
            moved = _moved(at, step / root, longest_mm)
            tried = solve(motion, moved)
            if _total(tried, moved, variance) <= _total(solved, at, variance):
                break
            damping = max(10.0 * damping, 1e-3)
        else:
            break
        at, solved = moved, tried
        damping *= 0.1
        if float(np.max(np.abs(step))) < SETTLED * np.sqrt(variance):
            break
    normal, _ = information(motion, at, solved, free_play=free_play)
    squares = _total(solved, at, solved.squares / max(solved.degrees, 1))
    return Fit(at, squares, solved.degrees, normal, solved.residual_mm, float(solved.weights[1]))


def squares_at(motion: Motion, at: Alignment) -> float:
    """Sum of squared residuals (mm^2) after fitting scale, bends and creep at given clock offset, rate and play."""
    return solve(motion, at).squares


def allowance_for_creep(motion: Motion, found: Fit) -> tuple[Array, Array]:
    """Changes of offset, rate and play, and of their variances, if creep is added to the model; each of shape (3,).

    If the model already includes creep, the time constants of creep are varied instead, and the largest changes are
    returned. In slow motion, creep too small to be detected acts as a delay equal to (creep fraction x time constant),
    and can also be mistaken for play. The changes of offset, rate and play are those caused by the most probable creep;
    the changes of the variances cover the creep that remains possible within its prior.
    """
    free_play = found.at.play_mm > 0.0
    growth = np.zeros(3)
    if motion.creeps:
        others = (
            fit(replace(motion, creep_s=tuple(factor * one for one in CREEP_S)), found.at, free_play=free_play)
            for factor in OTHER_CREEP
        )
        return np.max([np.abs(_change(other.at, found.at)) for other in others], axis=0), growth
    slow = fit(replace(motion, creeps=True), found.at, free_play=free_play)
    change = _change(slow.at, found.at)
    if slow.normal.shape == found.normal.shape:
        more = np.diag(np.linalg.pinv(slow.normal)) - np.diag(np.linalg.pinv(found.normal))
        growth[: more.size - 1] = np.maximum(np.delete(more, 2), 0.0)
    return change, growth


def _change(to: Alignment, since: Alignment) -> Array:
    return np.array([to.offset_s - since.offset_s, to.rate - since.rate, to.play_mm - since.play_mm])


def prior_of(size: int) -> Array:
    """Information (inverse covariance) of the priors on offset, rate, start (and play); shape (size, size)."""
    return np.diag([OFFSET_PRIOR_S**-2, RATE_PRIOR**-2, START_PRIOR**-2, PLAY_PRIOR_MM**-2][:size])


def information(motion: Motion, at: Alignment, solved: "Solved", *, free_play: bool) -> tuple[Array, Array]:
    """Normal matrix divided by the residual's variance, priors included, and the Jacobian of the fit."""
    jacobian = _jacobian(motion, at, solved, free_play=free_play)
    variance = solved.squares / max(solved.degrees, 1)
    return jacobian.T @ jacobian / variance + prior_of(jacobian.shape[1]), jacobian


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """Scale, bends and creep that fit best at given clock offset, rate and play.

    Parameters
    ----------
    weights : ndarray of float, shape (k,)
        Weights of the columns of `Motion.design`.
    white : ndarray of float, shape (m + k - 2,)
        Whitened residuals of the frames, followed by one row for each bend's prior.
    residual_mm : ndarray of float, shape (n,)
        Gap minus prediction.
    basis : ndarray of float, shape (m + k - 2, k)
        Orthonormal basis of the whitened columns.
    squares : float
        Sum of squares of `white`, in mm^2.
    degrees : int
        Degrees of freedom.
    """

    weights: Array
    white: Array
    residual_mm: Array
    basis: Array
    squares: float
    degrees: int


def solve(motion: Motion, at: Alignment) -> Solved:
    """Solve for scale and bends, with a prior that keeps the bends small compared with the scale."""
    design = motion.design(at)
    white_design, white_gap = motion.whitened(design), motion.whitened(motion.gap_mm)
    straight = np.linalg.lstsq(white_design[:, :2], white_gap, rcond=None)[0]
    left = white_gap - white_design[:, :2] @ straight
    spread = float(np.sqrt(left @ left / max(left.size - 2, 1)))
    # One additional row per bend states its prior: zero, with a standard deviation relative to the straight part.
    bends = design.shape[1] - 2
    priors = np.full(bends, BEND_PRIOR)
    if motion.creeps:
        priors[-2 * len(motion.creep_s) :] = CREEP_PRIOR
    hold = spread / (priors * max(abs(float(straight[1])), 1e-12))
    rows = np.hstack([np.zeros((bends, 2)), np.diag(hold)])
    whole, aim = np.vstack([white_design, rows]), np.concatenate([white_gap, np.zeros(bends)])
    basis, triangle = np.linalg.qr(whole)
    if np.min(np.abs(np.diag(triangle))) < 1e-12 * np.max(np.abs(np.diag(triangle))):
        weights = np.linalg.lstsq(whole, aim, rcond=None)[0]
    else:
        weights = np.linalg.solve(triangle, basis.T @ aim)
    white = aim - whole @ weights
    degrees = max(white_gap.size - 5 - bends, 1)
    return Solved(weights, white, motion.gap_mm - design @ weights, basis, float(white @ white), degrees)


def _jacobian(motion: Motion, at: Alignment, solved: Solved, *, free_play: bool) -> Array:
    """Derivatives of the whitened prediction, after projection on scale and bends; shape (m + knots, 3 or 4)."""
    columns = []
    for name, step in (
        ("offset_s", OFFSET_STEP_S),
        ("rate", RATE_STEP),
        ("start", START_STEP if at.start < 0.5 else -START_STEP),
        *((("play_mm", PLAY_STEP),) if free_play else ()),
    ):
        ends = [
            motion.design(replace(at, **{name: getattr(at, name) + by})) @ solved.weights
            for by in ((0.0, step) if name in ("start", "play_mm") else (-0.5 * step, 0.5 * step))
        ]
        columns.append(np.concatenate([motion.whitened((ends[1] - ends[0]) / step), np.zeros(solved.weights.size - 2)]))
    jacobian = np.stack(columns, axis=1)
    return np.asarray(jacobian - solved.basis @ (solved.basis.T @ jacobian))


def _moved(at: Alignment, by: Array, longest_mm: float) -> Alignment:
    play_mm = at.play_mm + (float(by[3]) if by.size == 4 else 0.0)
    return Alignment(
        at.offset_s + float(by[0]),
        at.rate + float(by[1]),
        float(np.clip(play_mm, 0.0, longest_mm)),
        float(np.clip(at.start + by[2], -1.0, 1.0)),
    )


def _total(solved: Solved, at: Alignment, variance: float) -> float:
    return solved.squares + variance * ((at.rate / RATE_PRIOR) ** 2 + (at.start / START_PRIOR) ** 2)
