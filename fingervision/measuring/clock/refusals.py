"""Reasons to refuse a log: no motion, a gap that does not follow the log, or a motion that repeats."""

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array
from fingervision.measuring.clock.clock_offset import NoClockOffset
from fingervision.measuring.clock.joint_fit import Fit
from fingervision.measuring.clock.motion_model import Motion
from fingervision.measuring.clock.set_points import ARRIVED, Jumps

FEWEST_FRAMES, FEWEST_ROWS = 12, 3
"""Least number of frames with a gap, and of log rows: the fit has eight parameters."""
SAME_PERIOD = 0.1
"""Deviation of offsets from whole periods, as a share of the period, up to which the motion is called periodic."""
LEAST_GAIN = 40.0
"""Least reduction of chi-square by the motion, compared with a constant gap. By chance, 20 is exceeded in one of 10^4
recordings (four parameters); the limit is doubled because the best of many offsets was chosen.
"""
MOST_LEFT_OUT = 0.15
"""Largest share of the frames that may be left out as wrong: the kink of a contact affects a twelfth of the frames, and
a few further frames may be wrong.
"""
LEAST_SHARE = 0.5
"""Least share of the gap's variance that a log must explain to belong to this recording."""


def too_little(time_s: Array, gap_mm: Array, drive: DriveHistory) -> NoClockOffset | None:
    """Refuse records that are too short, and a drive or a gap that does not move."""
    if time_s.size < FEWEST_FRAMES or float(np.ptp(time_s)) == 0.0:
        return NoClockOffset(f"only {time_s.size} frames have a time and a gap, and {FEWEST_FRAMES} are needed.")
    if drive.time_s.size < FEWEST_ROWS or float(np.ptp(drive.input_mm)) == 0.0:
        return NoClockOffset("the drive does not move: log a run in which the drive moves.")
    if float(np.ptp(gap_mm)) == 0.0:
        return NoClockOffset("the gap does not move: record a run in which the gap moves.")
    return None


def many_left_out(every_frame: Motion, motion: Motion, found: Fit) -> NoClockOffset | None:
    """Refuse an offset that explains the frames only without many of them, as a wrong step of a staircase does."""
    within_log = every_frame.time_s.size
    left_out = within_log - motion.time_s.size
    if left_out <= MOST_LEFT_OUT * within_log:
        return None
    return NoClockOffset(
        f"at the best offset, {found.at.offset_s:.3f} s, {left_out} of {within_log} frames do not follow the drive: "
        "if the play is as wide as the steps of the motion, another step may fit as well, or something other than the "
        "drive moves the gap. Record a run with longer strokes, or state --drive-offset-s."
    )


def only_set_points(jumps: Jumps | None) -> NoClockOffset | None:
    """Refuse a log of target positions instead of actual ones."""
    if jumps is None or jumps.arrived >= ARRIVED:
        return None
    return NoClockOffset(
        "the drive's rows jump from one position to the next, and the gap completes only a share of "
        f"{max(jumps.arrived, 0.0):.2f} of these jumps in the same time: the rows are set-points, which do not state "
        "when the stage arrived. Log the stage's measured positions, or state --drive-offset-s."
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
            f"there is too little motion to find the offset: the gap changes by {moved_um:.3g} µm in all, the drive "
            f"explains a share of {max(share, 0.0):.2f} of its variance, and the noise is {noise_um:.3g} µm RMS. "
            "Record a run with more motion."
        )
    if found.scale < 0.0:
        return NoClockOffset(
            "the gap follows the drive best with the sign reversed, so that the gap closes as the input increases; a "
            "periodic motion can look like this at an offset of half a period: check the sign of the drive (positive "
            "opens)."
        )
    if share < LEAST_SHARE:
        return NoClockOffset(
            f"the gap does not follow the drive at any offset: at the best offset, {found.at.offset_s:.3f} s, the "
            f"drive explains a share of {max(share, 0.0):.2f} of the gap's variance. Check whether this is the log of "
            "this recording."
        )
    return None


def explained(motion: Motion, found: Fit) -> float:
    """Share of the gap's variance explained by a fit."""
    return 1.0 - float(np.var(found.residual_mm) / np.var(motion.gap_mm))


def ambiguous(offsets_s: list[float]) -> NoClockOffset:
    """Refuse a motion that fits equally well at several offsets, such as a periodic one, and list them."""
    nearest = np.unique(np.round(offsets_s, 4))
    said = ", ".join(f"{one:.3f}" for one in nearest[:6]) + (" ..." if nearest.size > 6 else "")
    steps_s = np.diff(nearest)
    periods = steps_s / np.min(steps_s, initial=np.inf)
    even = steps_s.size > 1 and bool(np.all(np.abs(periods - np.round(periods)) < SAME_PERIOD))
    periodic, apart = ("is periodic and ", f", {np.median(steps_s):.3g} s apart,") if even else ("", "")
    return NoClockOffset(
        f"the motion {periodic}fits equally well at {nearest.size} offsets{apart} ({said} s): give "
        "--drive-offset-s, or record a run with a start, a stop or a reversal that is not repeated.",
        tuple(float(one) for one in nearest),
    )
