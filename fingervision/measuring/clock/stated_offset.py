"""Clock offset and its uncertainty for the user; refused if the motion does not determine the offset."""

import numpy as np

from fingervision.measuring.clock.clock_offset import ClockOffset, NoClockOffset
from fingervision.measuring.clock.corner_rounding import Spread
from fingervision.measuring.clock.correlation import LARGEST_RATE
from fingervision.measuring.clock.joint_fit import Fit, allowance_for_creep
from fingervision.measuring.clock.log_path import LogPath
from fingervision.measuring.clock.motion_model import Motion
from fingervision.measuring.clock.offset_covariance import inflation
from fingervision.measuring.clock.play_posterior import Posterior
from fingervision.measuring.clock.refusals import explained
from fingervision.measuring.clock.rivals import RunnerUp
from fingervision.measuring.clock.set_points import gap_arrives

FOLLOWED = 0.95
"""Share of the gap's variance explained by the log below which a note says that something else also moves the gap."""
SYSTEMATIC = 0.004
"""Systematic standard uncertainty, as a share of the time between two frames and two rows: error of the curve between
rows at a reversal, which does not average out over frames (`python -m tests.benchmarks.clock`)."""
MOST_PLAY_SHARE = 0.5
"""Largest share of the stroke that may be lost in play: with more, an error of the log's reversals shifts the whole
motion, and the fit of `python -m tests.benchmarks.clock --seed 404` was off by a frame."""
SURE_RATE, ORDINARY_RATE = 3.0, 1e-4
"""Standard uncertainties, and relative rate, from which on a clock is reported as fast or slow: crystals differ by up
to 100 parts in a million, and video compression distorts a motion by as much."""

COARSE = 2.0
"""Frames per encoder step from which on an offset error of one frame corresponds to less than half a step."""


def crossed_in_s(path: LogPath) -> float:
    """Time (s) in which the moving stage passes one encoder step; 0 without an encoder step."""
    steps_mm, steps_s = np.abs(np.diff(path.drive.input_mm)), np.diff(path.drive.time_s)
    moving = steps_mm > 0.1 * float(steps_mm.max())
    return float(path.step_mm * np.median(steps_s[moving] / steps_mm[moving]))


def stated(
    motion: Motion, at: Posterior, best: Fit, spread: Spread, frame_s: float, runner_up: RunnerUp | None
) -> ClockOffset | NoClockOffset:
    """Convert the fitted offset to the time of the log's first row."""
    first_s = float(motion.drive.time_s[0])
    more = np.sqrt(inflation(motion, best.at))
    offset_s, rate = at.offset_s + float(spread.shift[0]), at.rate + float(spread.shift[1])
    covariance = at.covariance * np.outer(more[:2], more[:2])
    shift, growth = allowance_for_creep(motion, best)
    # Without its correlation: by chance it would cancel at one instant what is off at all others.
    covariance = covariance + np.diag(shift[:2] ** 2 + growth[:2] * more[:2] ** 2) + spread.covariance[:2, :2]
    # Recording's time at which the log begins; there the offset is middle's plus the rate times the way to it.
    begins_s = (first_s + offset_s - rate * motion.middle_s) / (1.0 - rate)
    away_s = np.append(motion.time_s, begins_s) - motion.middle_s
    variance = covariance[0, 0] + 2.0 * away_s * covariance[0, 1] + away_s**2 * covariance[1, 1]
    row_s = float(np.median(np.diff(motion.path.rows.time_s)))
    variance += (SYSTEMATIC * np.hypot(frame_s, row_s)) ** 2
    # The frames see at what time within its interval the stage jumped, and the log does not. A programme that drives
    # and logs by one cycle jumps at the same place in each, so that many jumps do not average.
    jumps = gap_arrives(motion, best) is not None
    variance += row_s**2 / 12.0 if jumps else 0.0
    u_time_s = float(np.sqrt(np.mean(variance[:-1])))
    u_offset_s, u_rate = float(np.sqrt(variance[-1])), float(np.sqrt(covariance[1, 1]))
    if not np.isfinite(u_time_s) or u_time_s > 0.1 * float(np.ptp(motion.time_s)):
        return NoClockOffset(
            f"the motion determines the offset only to +-{2.0 * u_time_s:.3g} s (k = 2): a motion at one speed, or a "
            "motion that is over between two frames, looks the same at all similar offsets. Record a run that starts, "
            "stops or turns."
        )
    stroke_mm = float(np.ptp(motion.drive.input_mm))
    if at.play_mm > MOST_PLAY_SHARE * stroke_mm:
        return NoClockOffset(
            f"a play of {1e3 * at.play_mm:.3g} µm takes up most of the stroke of {1e3 * stroke_mm:.3g} µm, and the "
            f"rest of the motion does not determine the offset. Record a run with a longer stroke."
        )
    if abs(rate) > LARGEST_RATE:
        return NoClockOffset(
            f"at the best offset, {offset_s:.3f} s, the rates of the clocks would differ by {1e2 * abs(rate):.2f} "
            "%, but clocks differ by at most 0.1 %: is this the log of this recording, and are its times in seconds?"
        )
    notes = []
    share = explained(motion, best)
    if jumps:
        notes.append(
            "The drive's rows jump from one position to the next: if the rows are set-points and not measured "
            "positions, the delay of the stage is part of the offset."
        )
    if abs(rate) > max(SURE_RATE * u_rate, ORDINARY_RATE):
        runs = "fast" if rate > 0.0 else "slow"
        notes.append(
            f"The recording's clock runs {runs} against the drive's by {1e2 * abs(rate):.3f} % "
            f"(U = {2e2 * u_rate:.3f} %, k = 2); this difference was corrected."
        )
    crossing_s = crossed_in_s(motion.path)
    if crossing_s > COARSE * frame_s:
        notes.append(
            f"The drive's encoder has steps of {1e3 * motion.path.step_mm:.3g} µm, and the stage takes "
            f"{crossing_s:.2g} s from one to the next: it is unknown where within a step the stage stopped and "
            f"reversed, so that the offset may be wrong by more than a frame."
        )
    if motion.creeps:
        notes.append(
            "The gap seems to creep after the drive. In a slow motion creep looks like a delay, so that the offset "
            "may be wrong by more than a frame."
        )
    if u_time_s > 0.5 * frame_s:
        notes.append(
            f"The clock offset is known only with U = {2.0 * u_time_s:.3g} s (k = 2), more than one frame of "
            f"{frame_s:.3g} s: there is little motion that starts, stops or turns."
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
        explained_share=share,
        notes=tuple(notes),
        runner_up_s=None if runner_up is None else runner_up.offset_s,
    )
