"""Check whether a log contains target positions of the stage, instead of its actual positions."""

from dataclasses import dataclass, replace

import numpy as np

from fingervision.domain.effect import Array
from fingervision.measuring.clock.joint_fit import solve
from fingervision.measuring.clock.motion_model import WHITE, Alignment, Motion
from fingervision.stage_record.encoder import input_sigma

STANDS = 0.1
"""Change in a neighbouring interval, relative to that of a jump, below which the log counts as constant on that
side."""
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
    """How the gap follows the log's jumps; None if the log has too few jumps to tell.

    Parameters
    ----------
    motion : Motion
        The log, and all frames: those of a move are the ones that an alignment with set-points leaves out.
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
