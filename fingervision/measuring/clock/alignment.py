"""Offset between the recording's clock and the stage log's clock, found from the motion that both record."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array
from fingervision.measuring.clock.clock_offset import ClockOffset, NoClockOffset
from fingervision.measuring.clock.corner_rounding import STRETCHES, Spread, with_corners
from fingervision.measuring.clock.correlation import candidates
from fingervision.measuring.clock.joint_fit import Fit, fit, squares_at
from fingervision.measuring.clock.log_path import LogPath
from fingervision.measuring.clock.motion_model import WHITE, Motion
from fingervision.measuring.clock.noise_of_motion import noise_of, of_input
from fingervision.measuring.clock.play_posterior import (
    BESIDE_S,
    BESIDE_STEP_S,
    VALLEYS,
    beside,
    longest_play_mm,
    most_likely,
    posterior,
)
from fingervision.measuring.clock.refusals import (
    FEWEST_FRAMES,
    ambiguous,
    many_left_out,
    only_set_points,
    too_little,
    unlike,
)
from fingervision.measuring.clock.rivals import QUICK_PLAYS, fitted, only, unrefuted
from fingervision.measuring.clock.set_points import Jumps, jumps_of
from fingervision.measuring.clock.stated_offset import stated

# Further minima of the clock fit that are compatible with the errors of the log.

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


OUTLIER_SIGMAS = 6.0
"""Number of robust standard deviations beyond which a frame's gap is regarded as wrong and is left out of the fit."""
CREEP_GAIN = 18.5
"""Chi-square of four additional parameters that chance exceeds in one of a thousand recordings. A stretch of the
recording counts as one datum (`corner_rounding.STRETCHES`), because errors of a log are common to the frames of a move;
with one datum per frame, creep was found in 7 of 29 simulated recordings without creep.
"""
REFINEMENTS = 3
"""Rounds in which noise and fit are estimated alternately; the third round changes an uncertainty by less than a
tenth."""


def find_clock_offset(time_s: Array, gap_mm: Array, drive: DriveHistory) -> ClockOffset | NoClockOffset:
    """Find the offset between a recording and a log: by correlation, then by a joint fit with play and scale.

    Parameters
    ----------
    time_s, gap_mm : ndarray of float, shape (n,)
        Times and gaps of the frames that have a gap, on the recording's clock, in order.
    drive : DriveHistory
        The log, on its own clock.

    Returns
    -------
    ClockOffset or NoClockOffset
    """
    refused = too_little(time_s, gap_mm, drive)
    if refused is not None:
        return refused
    found = candidates(time_s, gap_mm, drive)
    if not found:
        return NoClockOffset(
            "there is no offset at which the recording and the drive have half of their time and motion in common: "
            "record and log the same moves, or state --drive-offset-s."
        )
    path = LogPath.of(drive)
    frame_s = float(np.median(np.diff(time_s)))
    fits = [(one, *fitted(time_s, gap_mm, path, one, QUICK_PLAYS)) for one in found]
    fits = [entry for entry in fits if entry[1].time_s.size >= FEWEST_FRAMES]
    if not fits:
        return NoClockOffset("fewer than 12 frames with a gap lie within the drive's times: record longer.")
    best, motion, whole = max(fits, key=lambda entry: _information(entry[1], entry[2]))
    whole = beside(motion, whole, QUICK_PLAYS)
    every_frame = motion
    motion, whole = _refined(every_frame, whole)
    jumps = _jumps(every_frame, motion, whole)
    refused = only_set_points(jumps)
    if refused is None and many_left_out(every_frame, motion, whole) is not None:
        # If the gap creeps, a model without creep rejects the frames of every move as outliers.
        creeping = replace(every_frame, creeps=True)
        motion, whole = _refined(creeping, most_likely(creeping, whole.at))
        refused = many_left_out(every_frame, motion, whole)
    if refused is not None:
        return refused
    motion, whole = _creeping(motion, whole)
    refused = unlike(motion, whole)
    if refused is not None:
        return refused
    motion, whole, spread = with_corners(motion, whole)
    rivals, runner_up = unrefuted(motion, drive, whole, [one for one, _, _ in fits if one is not best], frame_s)
    if rivals:
        return ambiguous([whole.at.offset_s, *rivals])
    far_s, beside_best = other_valleys(motion, whole, QUICK_PLAYS, frame_s)
    if far_s:
        return ambiguous([whole.at.offset_s, *far_s])
    at = posterior(motion, whole)
    return stated(motion, at, whole, spread + beside_best, frame_s, runner_up, jumps)


def _refined(motion: Motion, found: Fit) -> tuple[Motion, Fit]:
    """Estimate outliers, noise and fit alternately."""
    for _ in range(REFINEMENTS):
        kept = _inliers(motion, found)
        motion, near = only(motion, kept), replace(found, residual_mm=found.residual_mm[kept])
        motion = replace(motion, noise=noise_of(motion, near))
        found = most_likely(motion, found.at)
    return motion, found


def _jumps(every_frame: Motion, motion: Motion, found: Fit) -> Jumps | None:
    """Jumps of the log and of the gap, at the alignment at which the gap completes the smaller share of them.

    If the gap follows later than the log, the residuals resemble a random walk, and a fit to their differences may
    explain nothing; a fit to the gap itself shows which share of the jumps the gap completes in time.
    """
    jumps = jumps_of(every_frame, found.at)
    if jumps is None:
        return None
    by_gap = jumps_of(every_frame, most_likely(replace(motion, noise=WHITE), found.at).at)
    return jumps if by_gap is None else min(jumps, by_gap, key=lambda one: one.arrived)


def _creeping(motion: Motion, found: Fit) -> tuple[Motion, Fit]:
    """Include creep of the gap in the model if it improves the fit by more than noise would.

    The autoregression would reproduce the residuals that creep causes, and would thus hide the creep. The fits are
    therefore also compared with white noise, and the noise is estimated again together with the creep.
    """
    for noise in (motion.noise, WHITE):
        without = replace(motion, noise=noise)
        plain = found if noise is motion.noise else most_likely(without, found.at)
        creeping = replace(without, creeps=True)
        slow = fit(creeping, plain.at, free_play=plain.at.play_mm > 0.0)
        gain = min(STRETCHES, plain.degrees) * float(np.log(plain.squares / slow.squares))
        if gain > CREEP_GAIN:
            for _ in range(REFINEMENTS):
                creeping = replace(creeping, noise=noise_of(creeping, slow))
                slow = most_likely(creeping, slow.at)
            return creeping, slow
    return motion, found


def _information(motion: Motion, found: Fit) -> float:
    """Logarithm of the likelihood ratio between the fitted motion and a constant gap.

    For the same quality of fit, the logarithm increases with the number of frames.
    """
    around = motion.gap_mm - motion.gap_mm.mean()
    return float(motion.time_s.size * np.log(max(float(around @ around), 1e-30) / max(found.squares, 1e-30)))


def _inliers(motion: Motion, found: Fit) -> NDArray[np.bool_]:
    """Frames whose residual is no larger than noise and the input's uncertainty allow.

    While the stage moves, the predicted gap is less certain than at rest; a limit for all frames alike would leave out
    the moves, which determine the offset.
    """
    around = found.residual_mm - np.median(found.residual_mm)
    spread = 1.4826 * float(np.median(np.abs(around)))
    own_mm, shared_mm, _ = of_input(motion, found)
    limit = OUTLIER_SIGMAS * np.sqrt(spread**2 + own_mm**2 + shared_mm**2)
    return np.asarray(np.abs(around) <= np.maximum(limit, 1e-12))
