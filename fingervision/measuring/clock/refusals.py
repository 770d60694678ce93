"""Reasons to refuse a log: no motion, a gap that does not follow the log, or a motion that repeats."""

from dataclasses import replace

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array
from fingervision.measuring.clock.clock_offset import NoClockOffset
from fingervision.measuring.clock.joint_fit import Fit
from fingervision.measuring.clock.motion_model import WHITE, Motion
from fingervision.measuring.clock.play_posterior import most_likely
from fingervision.measuring.clock.set_points import ARRIVED, gap_arrives

FEWEST_FRAMES, FEWEST_ROWS = 12, 3
"""Least number of frames with a gap, and of log rows: the fit has eight parameters."""
LEAST_GAIN = 40.0
"""Gain in chi-square of the motion over a gap that stands: by chance 20 come once in 10^4 recordings (four parameters),
as much again for the offsets among which was chosen."""
MOST_LEFT_OUT = 0.15
"""Share of the frames that may be taken for wrong: a contact's kink spoils a twelfth, a few are wrong besides."""
LEAST_SHARE = 0.5
"""Least share of the gap's variance that a log must explain to belong to this recording."""


def too_little(time_s: Array, gap_mm: Array, drive: DriveHistory) -> NoClockOffset | None:
    """Refuse records that are too short, and a drive or a gap that does not move."""
    if time_s.size < FEWEST_FRAMES or float(np.ptp(time_s)) == 0.0:
        return NoClockOffset(f"only {time_s.size} frames have a time and a gap, and {FEWEST_FRAMES} are needed.")
    if drive.time_s.size < FEWEST_ROWS or float(np.ptp(drive.input_mm)) == 0.0:
        return NoClockOffset("the drive does not move: log a run that does.")
    if float(np.ptp(gap_mm)) == 0.0:
        return NoClockOffset("the gap does not move: record a run that does.")
    return None


def many_left_out(within_log: int, motion: Motion, found: Fit) -> NoClockOffset | None:
    """Refuse an offset that explains the frames only if many are left out, as at a wrong step of a staircase."""
    left_out = within_log - motion.time_s.size
    if left_out <= MOST_LEFT_OUT * within_log:
        return None
    return NoClockOffset(
        f"at the best offset, {found.at.offset_s:.3f} s, {left_out} of {within_log} frames do not follow the drive: "
        f"if the play is as wide as the steps of the motion, another step may fit as well; or something other than "
        f"the drive moves the gap. Record a run with longer strokes, or state --drive-offset-s."
    )


def only_set_points(motion: Motion, found: Fit) -> NoClockOffset | None:
    """Refuse a log of target positions instead of actual ones.

    If the gap follows later than the log, the residuals resemble a random walk, and a fit to their differences may
    explain nothing; the fit to the gap itself shows which share of the jumps the gap completes in time.
    """
    share = gap_arrives(motion, found)
    if share is None:
        return None
    even = replace(motion, noise=WHITE)
    by_gap = gap_arrives(even, most_likely(even, found.at))
    share = share if by_gap is None else min(share, by_gap)
    if share >= ARRIVED:
        return None
    return NoClockOffset(
        "the drive's rows jump from one position to the next, but at the time of a jump the gap moves by a share of "
        f"only {max(share, 0.0):.2f} of it: the rows are set-points, which do not show when the stage arrived. Log the "
        "stage's positions, or state --drive-offset-s."
    )


def unlike(motion: Motion, found: Fit) -> NoClockOffset | None:
    """Refuse a log whose motion the gap does not follow."""
    still = motion.whitened(motion.gap_mm - motion.gap_mm.mean())
    still = still - still.mean()
    gain = found.degrees * float(np.log(max(float(still @ still), 1e-30) / max(found.squares, 1e-30)))
    share = explained(motion, found)
    if gain < LEAST_GAIN:
        moved_um, noise_um = 1e3 * float(np.ptp(motion.gap_mm)), 1e3 * float(np.std(found.residual_mm))
        return NoClockOffset(
            f"there is too little motion to find the offset: the gap changes by {moved_um:.3g} µm in all, of which "
            f"the drive "
            f"explains a share of {max(share, 0.0):.2f} and {noise_um:.3g} µm RMS are noise. Record a run that moves."
        )
    if found.scale < 0.0:
        return NoClockOffset(
            "the gap follows the drive best with its sign reversed, closing as the input grows. A periodic motion can "
            "also cause this if the offset is wrong by half a period. Check the drive's sign (positive opens)."
        )
    if share < LEAST_SHARE:
        return NoClockOffset(
            f"the gap does not follow the drive at any offset: at the best, {found.at.offset_s:.3f} s, it explains a "
            f"share of {max(share, 0.0):.2f} of the gap's variance. Is this the log of this recording?"
        )
    return None


def explained(motion: Motion, found: Fit) -> float:
    """Share of the gap's variance explained by a fit."""
    return 1.0 - float(np.var(found.residual_mm) / np.var(motion.gap_mm))


def ambiguous(offsets_s: list[float]) -> NoClockOffset:
    """Refuse a periodic motion, and list the offsets that fit equally well."""
    nearest = np.unique(np.round(offsets_s, 4))
    said = ", ".join(f"{one:.3f}" for one in nearest[:6]) + (" ..." if nearest.size > 6 else "")
    apart = f", {np.median(np.diff(nearest)):.3g} s apart," if nearest.size > 1 else ""
    return NoClockOffset(
        f"the motion repeats and fits at {nearest.size} offsets{apart} equally well ({said} s): give --drive-offset-s, "
        "or record a run that starts, stops or turns once where it does not repeat.",
        tuple(float(one) for one in nearest),
    )
