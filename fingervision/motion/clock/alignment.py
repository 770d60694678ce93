"""Offset between the recording's clock and the stage log's clock, found from the motion that both record."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array
from fingervision.motion.clock.clock_offset import ClockOffset, NoClockOffset
from fingervision.motion.clock.corner_rounding import STRETCHES, with_corners
from fingervision.motion.clock.correlation import candidates
from fingervision.motion.clock.joint_fit import Fit, fit
from fingervision.motion.clock.motion_model import WHITE, Motion
from fingervision.motion.clock.noise import noise_of, of_input
from fingervision.motion.clock.play_posterior import (
    beside,
    most_likely,
    posterior,
)
from fingervision.motion.clock.refusals import (
    FEWEST_FRAMES,
    Jumps,
    ambiguous,
    jumps_of,
    many_left_out,
    only_set_points,
    too_little,
    unlike,
)
from fingervision.motion.clock.rival_offsets import QUICK_PLAYS, fitted, only, other_valleys, unrefuted
from fingervision.motion.clock.stated_offset import stated
from fingervision.motion.log_path import LogPath

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
