"""Further minima of the clock fit that are compatible with the errors of the log."""

from dataclasses import replace

import numpy as np

from fingervision.measuring.clock.corner_rounding import STRETCHES, Spread
from fingervision.measuring.clock.joint_fit import Fit, fit, squares_at
from fingervision.measuring.clock.motion_model import Motion
from fingervision.measuring.clock.play_posterior import BESIDE_S, BESIDE_STEP_S, VALLEYS, longest_play_mm

NEAR_FRAMES, NEAR_STEP = 4.0, 0.5
"""Range in frames on either side of the best offset in which minima are searched with a finer step, and this step,
because an encoder line that is crossed a frame earlier or later causes a separate minimum.
"""
SAME = 0.25
"""Distance in frames within which two minima count as the same."""
FAR = 2.0
"""Distance in frames above which two minima are different solutions; nearer minima are one solution with a larger
uncertainty.
"""
POSSIBLE = 0.037
"""Likelihood, relative to that of the best minimum, above which a far minimum is possible: chi-square of 6.6, which
chance exceeds in one of a hundred recordings.
"""


def other_valleys(motion: Motion, found: Fit, plays: tuple[float, ...], frame_s: float) -> tuple[list[float], Spread]:
    """Find the far offsets that remain possible, and the spread of the fit over the minima nearby.

    The errors of a log's path between its rows are common to the frames of a move. A likelihood with one datum per
    frame could reject the true minimum because of errors common to many frames; instead, a stretch of the recording
    counts as one datum. If the frames' own noise determines the minimum, the minima differ so much that counting
    stretches instead of frames has no effect.

    Returns
    -------
    far_s : list of float
        Offsets, at the middle of the recording, that fit nearly as well.
    spread : Spread
        Spread of offset, rate and play.
    """
    fits = [found]
    for start in _lowest(motion, found, plays, frame_s):
        one = min((fit(motion, start.at, free_play=free) for free in (False, True)), key=lambda each: each.squares)
        if all(abs(one.at.offset_s - other.at.offset_s) > SAME * frame_s for other in fits):
            fits.append(one)
    likelihood = np.array([(one.squares / found.squares) ** (-0.5 * min(STRETCHES, found.degrees)) for one in fits])
    away_s = np.array([abs(one.at.offset_s - found.at.offset_s) for one in fits])
    is_far = away_s > FAR * frame_s
    far_s = [fits[k].at.offset_s for k in np.flatnonzero(is_far & (likelihood > POSSIBLE))]
    weights = np.where(is_far, 0.0, likelihood)
    at = np.array([[one.at.offset_s, one.at.rate, one.at.play_mm] for one in fits])
    return far_s, Spread.over(at, weights, at[0])


def _lowest(motion: Motion, found: Fit, plays: tuple[float, ...], frame_s: float) -> list[Fit]:
    """Lowest local minima on a grid of offsets and plays."""
    plays_mm = (*(share * longest_play_mm(motion) for share in plays), found.at.play_mm)
    wide_s = np.arange(-BESIDE_S, BESIDE_S + 0.5 * BESIDE_STEP_S, BESIDE_STEP_S)
    near_s = frame_s * np.arange(-NEAR_FRAMES, NEAR_FRAMES + 0.5 * NEAR_STEP, NEAR_STEP)
    tried = []
    for by_s in np.unique(np.concatenate([wide_s, near_s])):
        offset_s = found.at.offset_s + float(by_s)
        places = [replace(found.at, offset_s=offset_s, play_mm=play_mm) for play_mm in plays_mm]
        tried.append(min((replace(found, at=at, squares=squares_at(motion, at)) for at in places), key=_squares))
    squares = np.array([np.inf, *map(_squares, tried), np.inf])
    is_lowest = (squares[1:-1] <= squares[:-2]) & (squares[1:-1] <= squares[2:])
    return sorted((tried[k] for k in np.flatnonzero(is_lowest)), key=_squares)[: VALLEYS + 1]


def _squares(one: Fit) -> float:
    return one.squares
