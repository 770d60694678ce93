"""Reasons to refuse a log: no motion, set-points, a gap that does not follow the log, or a motion that repeats."""

from dataclasses import dataclass, replace

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array
from fingervision.motion.clock.clock_offset import NoClockOffset
from fingervision.motion.clock.joint_fit import Fit, solve
from fingervision.motion.clock.motion_model import WHITE, Alignment, Motion
from fingervision.motion.encoder import input_sigma

# Check whether a log contains target positions of the stage, instead of its actual positions.

STANDS = 0.1
"""Change of the log in a neighbouring interval, relative to the jump, below which the log counts as constant there."""
JUMPING = 0.7
"""Share of a log's travel in such jumps above which the log may contain set-points. A stage that is read fast enough
shows intermediate positions, but a stage that is read slowly shows jumps as well.
"""
FEWEST_JUMPS = 3
"""Least number of jumps for a decision, because a gap may be slower than the log in one jump by chance."""
FRAMES_MORE = 1.0
"""Frames before and after a jump within which the gap must start and arrive, if it jumps as the log does."""
ARRIVED = 0.85
"""Least share of the jumps' expected height that the gap must reach within that time: noise over three jumps, and an
alignment error of a fifth of a frame, reduce it by less than a tenth."""


@dataclass(frozen=True, slots=True)
class Jumps:
    """Jumps of a log from one row to the next, and how the gap follows them.

    Parameters
    ----------
    arrived : float
        Share of the jumps that the gap completes as fast as the log does.
    move_s : float
        Time that the gap takes for a jump, at the largest speed of the jump.
    """

    arrived: float
    move_s: float


def jumps_of(motion: Motion, at: Alignment) -> Jumps | None:
    """How the gap follows the log's jumps; None if the log has too few jumps for a decision.

    Parameters
    ----------
    motion : Motion
        The log and all frames, including the frames during moves, which an alignment with set-points leaves out.
    at : Alignment
        Best alignment of the log; the gap predicted from it is compared with the measured gap.
    """
    rows = motion.path.rows
    steps = np.abs(np.diff(rows.input_mm))
    before, after = np.insert(steps[:-1], 0, 0.0), np.append(steps[1:], 0.0)
    least = STANDS * float(np.ptp(rows.input_mm))
    jumps = np.flatnonzero((steps > least) & (np.maximum(before, after) < STANDS * steps))
    # The expected travel due to noise is subtracted, because it can exceed the motion over many rows; an encoder has
    # none at rest.
    noise_mm, encoder_mm = input_sigma(rows.input_mm, (slice(0, rows.time_s.size),), rows.time_s)
    noise_steps_mm = 0.0 if encoder_mm > 0.0 else steps.size * noise_mm * 2.0 / np.sqrt(np.pi)
    if jumps.size < FEWEST_JUMPS or steps[jumps].sum() < JUMPING * (steps.sum() - noise_steps_mm):
        return None
    frame_s = float(np.median(np.diff(motion.time_s)))
    expected_mm = motion.gap_mm - solve(replace(motion, noise=WHITE), at).residual_mm
    offset_s = motion.time_s - motion.log_time_s(at)

    def of_log(log_s: Array, signal: Array) -> Array:
        return np.asarray(np.interp(log_s + float(np.median(offset_s)), motion.time_s, signal))

    # The fit aligns the middle of a slow motion with the jump; start and end are compared half a window before and
    # after it.
    half_s = 0.5 * np.diff(rows.time_s)[jumps] + FRAMES_MORE * frame_s
    middle_s = 0.5 * (rows.time_s[jumps] + rows.time_s[jumps + 1])
    inside = (of_log(middle_s - half_s, motion.time_s) > motion.time_s[0]) & (
        of_log(middle_s + half_s, motion.time_s) < motion.time_s[-1]
    )
    if np.count_nonzero(inside) < FEWEST_JUMPS:
        return None
    first_s, last_s = (middle_s - half_s)[inside], (middle_s + half_s)[inside]
    foreseen = of_log(last_s, expected_mm) - of_log(first_s, expected_mm)
    seen = of_log(last_s, motion.gap_mm) - of_log(first_s, motion.gap_mm)
    arrived = float(foreseen @ seen / max(float(foreseen @ foreseen), 1e-30))
    return Jumps(arrived, _move_s(motion, foreseen, first_s + offset_s.mean(), last_s + offset_s.mean()))


def _move_s(motion: Motion, height_mm: Array, first_s: Array, last_s: Array) -> float:
    """Median time that the gap would take for its jumps at their largest speeds from frame to frame."""
    speed_mm_s = np.abs(np.diff(motion.gap_mm)) / np.diff(motion.time_s)
    taken = []
    for height, begin_s, end_s in zip(np.abs(height_mm), first_s, last_s, strict=True):
        begin, end = np.searchsorted(motion.time_s, (begin_s, end_s))
        fastest = float(np.max(speed_mm_s[max(begin - 1, 0) : end], initial=0.0))
        if fastest > 0.0:
            taken.append(height / fastest)
    return float(np.median(taken)) if taken else 0.0


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
