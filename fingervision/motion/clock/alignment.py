"""Offset between the recording's clock and the stage log's clock, found from the motion that both record."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array
from fingervision.motion.clock.clock_offset import ClockOffset, NoClockOffset
from fingervision.motion.clock.corner_rounding import STRETCHES, Spread, with_corners
from fingervision.motion.clock.correlation import LARGEST_RATE, candidates
from fingervision.motion.clock.joint_fit import PLAY_STEP, Fit, allowance_for_creep, fit, information, prior_of, solve
from fingervision.motion.clock.motion_model import WHITE, Alignment, Motion
from fingervision.motion.clock.noise import noise_of, of_input
from fingervision.motion.clock.play_posterior import (
    Posterior,
    beside,
    most_likely,
    posterior,
)
from fingervision.motion.clock.refusals import (
    FEWEST_FRAMES,
    Jumps,
    ambiguous,
    explained,
    jumps_of,
    many_left_out,
    only_set_points,
    too_little,
    unlike,
)
from fingervision.motion.clock.rival_offsets import QUICK_PLAYS, RunnerUp, fitted, only, other_valleys, unrefuted
from fingervision.motion.log_path import DRAWS, LogPath, drawn_paths
from fingervision.motion.time_stamps import stamp_resolution_s


def inflation(motion: Motion, at: Alignment) -> Array:
    """Ratio of the variance of offset, rate and play to the variance from the fit's own weights; shape (3,).

    The fit's weights treat the log's errors as independent from frame to frame. The true effect of the log's errors is
    computed by means of other paths that the log permits (`log_errors`): another path changes the prediction, and the
    fit passes a share of the change on to its parameters (sandwich estimator: White 1980, doi:10.2307/1912934). If the
    contributions of stretches of the recording to the parameters scatter by more than the log's errors explain, the
    scatter is used, because the gap then has causes of motion that the model lacks.
    """
    solved = solve(motion, at)
    free_play = at.play_mm > 10.0 * PLAY_STEP
    normal, jacobian = information(motion, at, solved, free_play=free_play)
    variance = solved.squares / max(solved.degrees, 1)
    frames = solved.white.size - solved.weights.size + 2
    jacobian = jacobian[:frames] / variance
    prior = prior_of(jacobian.shape[1])
    of_frames = motion.weighed(jacobian)
    expected = motion.noise.variance_mm2 * of_frames.T @ of_frames + prior
    expected_mm = motion.design(at) @ solved.weights
    for path in drawn_paths(motion.path):
        changed_mm = replace(motion, path=path).design(at) @ solved.weights - expected_mm
        pull = jacobian.T @ motion.whitened(changed_mm)
        expected += np.outer(pull, pull) / DRAWS
    clusters = min(STRETCHES, frames // 8)
    parts = np.array_split(jacobian * solved.white[:frames, None], clusters)
    pulls = np.stack([part.sum(axis=0) for part in parts])
    seen = pulls.T @ pulls * (clusters / max(clusters - pulls.shape[1], 1)) + prior
    bread = np.linalg.pinv(normal)
    by_fit = np.maximum(np.diag(bread), 1e-300)
    ratio = np.maximum(np.diag(bread @ expected @ bread), np.diag(bread @ seen @ bread)) / by_fit
    return ratio[[0, 1, 3]] if free_play else np.array([ratio[0], ratio[1], max(ratio[0], ratio[1])])


FOLLOWED = 0.95
"""Share of the gap's variance explained by the log below which a note says that something else also moves the gap."""
SYSTEMATIC = 0.004
"""Systematic standard uncertainty, as a share of the time between two frames and two rows: error of the curve between
rows at a reversal, which does not average out over frames (`python -m tests.benchmarks.clock`)."""
MOST_PLAY_SHARE = 0.5
"""Largest share of the stroke that may be lost in play. With more play, an error of the log's reversals shifts the
whole motion: the fit in `python -m tests.benchmarks.clock --seed 404` had an error of one frame.
"""
SURE_RATE, ORDINARY_RATE = 3.0, 1e-4
"""Number of standard uncertainties, and relative rate, above which a clock is reported as fast or slow: crystal clocks
differ by up to 100 parts per million, and video compression distorts a motion by as much.
"""

COARSE = 2.0
"""Number of frames per encoder step above which an offset error of one frame corresponds to less than half a step."""


def crossed_in_s(path: LogPath) -> float:
    """Time (s) in which the moving stage passes one encoder step; 0 without an encoder step."""
    steps_mm, steps_s = np.abs(np.diff(path.drive.input_mm)), np.diff(path.drive.time_s)
    moving = steps_mm > 0.1 * float(steps_mm.max())
    return float(path.record.step_mm * np.median(steps_s[moving] / steps_mm[moving]))


def stated(
    motion: Motion,
    at: Posterior,
    best: Fit,
    spread: Spread,
    frame_s: float,
    runner_up: RunnerUp | None,
    jumps: Jumps | None,
) -> ClockOffset | NoClockOffset:
    """Convert the fitted offset to the time of the log's first row."""
    first_s = float(motion.drive.time_s[0])
    more = np.sqrt(inflation(motion, best.at))
    offset_s, rate = at.offset_s + float(spread.shift[0]), at.rate + float(spread.shift[1])
    covariance = at.covariance * np.outer(more[:2], more[:2])
    shift, growth = allowance_for_creep(motion, best)
    # The correlation of the creep's contribution is ignored, because it could cancel other errors at one instant by
    # chance.
    covariance = covariance + np.diag(shift[:2] ** 2 + growth[:2] * more[:2] ** 2) + spread.covariance[:2, :2]
    # Recording's time at which the log begins; the offset at this time is the offset at the middle plus the rate times
    # the difference in time.
    begins_s = (first_s + offset_s - rate * motion.middle_s) / (1.0 - rate)
    away_s = np.append(motion.time_s, begins_s) - motion.middle_s
    variance = covariance[0, 0] + 2.0 * away_s * covariance[0, 1] + away_s**2 * covariance[1, 1]
    row_s = float(np.median(np.diff(motion.path.rows.time_s)))
    variance += (SYSTEMATIC * np.hypot(frame_s, row_s)) ** 2
    # A program may round its times or cut them off, so that all rows are early by up to the resolution.
    variance += stamp_resolution_s(motion.path.rows.time_s) ** 2 / 12.0
    # Frames show at which time between two rows the stage jumped, but the log does not. A program that moves and logs
    # in one cycle jumps at the same phase of each cycle, so that the error does not average out over jumps.
    if jumps is not None:
        # Set-points precede the gap by up to half of the duration of a move, which cannot be detected in short moves.
        variance += (row_s**2 + jumps.move_s**2) / 12.0
    u_time_s = float(np.sqrt(np.mean(variance[:-1])))
    u_offset_s, u_rate = float(np.sqrt(variance[-1])), float(np.sqrt(covariance[1, 1]))
    if not np.isfinite(u_time_s) or u_time_s > 0.1 * float(np.ptp(motion.time_s)):
        return NoClockOffset(
            f"the motion determines the offset only to +-{2.0 * u_time_s:.3g} s (k = 2): a move at constant speed, or "
            "a move that ends between two frames, fits equally well at neighbouring offsets. Record a run with "
            "starts, stops or reversals."
        )
    stroke_mm = float(np.ptp(motion.drive.input_mm))
    if at.play_mm > MOST_PLAY_SHARE * stroke_mm:
        return NoClockOffset(
            f"a play of {1e3 * at.play_mm:.3g} µm uses up most of the stroke of {1e3 * stroke_mm:.3g} µm, and the "
            "remaining motion does not determine the offset. Record a run with a longer stroke."
        )
    if abs(rate) > LARGEST_RATE:
        return NoClockOffset(
            f"at the best offset, {offset_s:.3f} s, the clocks would differ by {1e2 * abs(rate):.2f} %, but real "
            "clocks differ by at most 0.1 %: check whether this is the log of this recording, and whether its times "
            "are in seconds."
        )
    notes = []
    share = explained(motion, best)
    if jumps is not None:
        notes.append(
            "The drive's rows jump from one position to the next: if they are set-points instead of measured "
            "positions, the offset includes the time that the stage takes to follow."
        )
    if abs(rate) > max(SURE_RATE * u_rate, ORDINARY_RATE):
        runs = "fast" if rate > 0.0 else "slow"
        notes.append(
            f"The recording's clock runs {runs} against the drive's by {1e2 * abs(rate):.3f} % "
            f"(U = {2e2 * u_rate:.3f} %, k = 2); this difference is corrected."
        )
    crossing_s = crossed_in_s(motion.path)
    if crossing_s > COARSE * frame_s:
        notes.append(
            f"The drive's encoder has steps of {1e3 * motion.path.record.step_mm:.3g} µm, and the stage takes "
            f"{crossing_s:.2g} s for one step: the unknown position within a step affects the offset, whose error may "
            "exceed one frame."
        )
    if motion.creeps:
        notes.append(
            "The gap seems to creep after motions of the drive: in a slow motion, creep looks like a delay, so that "
            "creep may change the offset by more than one frame."
        )
    if u_time_s > 0.5 * frame_s:
        notes.append(
            f"The clock offset has an uncertainty of U = {2.0 * u_time_s:.3g} s (k = 2), more than one frame of "
            f"{frame_s:.3g} s, because the motion has few starts, stops or reversals."
        )
    if share < FOLLOWED:
        notes.append(
            f"The drive explains a share of {share:.2f} of the gap's variance: something else moves the gap as well."
        )
    if runner_up is not None:
        notes.append(runner_up.words())
    return ClockOffset(
        offset_s=begins_s - first_s,
        u_offset_s=u_offset_s,
        rate=rate / (1.0 - rate),
        u_rate=u_rate,
        reference_s=first_s,
        u_time_s=u_time_s,
        play_mm=max(at.play_mm + float(spread.shift[2]), 0.0),
        u_play_mm=float(
            np.sqrt((at.u_play_mm**2 + growth[2]) * more[2] ** 2 + shift[2] ** 2 + spread.covariance[2, 2])
        ),
        corner_s=motion.path.corner_s,
        u_corner_s=motion.path.u_corner_s,
        explained_share=share,
        notes=tuple(notes),
        runner_up_s=None if runner_up is None else runner_up.offset_s,
    )


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
