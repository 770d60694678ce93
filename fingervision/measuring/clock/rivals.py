"""Offsets other than the best one that explain the frames shared with it as well."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array
from fingervision.measuring.clock.correlation import Candidate
from fingervision.measuring.clock.joint_fit import Fit
from fingervision.measuring.clock.log_path import LogPath
from fingervision.measuring.clock.motion_model import WHITE, Alignment, Motion, Noise
from fingervision.measuring.clock.noise_of_motion import noise_of
from fingervision.measuring.clock.play_posterior import most_likely
from fingervision.measuring.clock.refusals import FEWEST_FRAMES

CHANCE_SIGMAS = 3.0
"""Standard deviations that a rival's chi-square may be larger by the log's own noise: one rival in 700 is then lost."""
UNREFUTED = 25.0
"""Chi-square by which another offset must be worse, over the frames that both explain, to be refuted: 5 sigma."""
SHARED = 0.5
"""Share of the motion of either record that must lie in the overlap: less than half is no common motion."""
ONE_PEAK = 0.25
"""Frames: offsets closer than that are the same peak."""
QUICK_PLAYS = (0.0, 0.02, 0.08, 0.3)
"""Plays from which every candidate is fitted, over the largest possible one."""


def fitted(
    time_s: Array, gap_mm: Array, path: LogPath, candidate: Candidate, plays: tuple[float, ...]
) -> tuple[Motion, Fit]:
    """Fit the frames that lie within the log under a candidate."""
    middle_s = 0.5 * float(time_s[0] + time_s[-1])
    start = Alignment(candidate.offset_s, candidate.rate, 0.0, 0.0)
    motion = Motion(time_s, gap_mm, path, middle_s, WHITE)
    log_s = motion.log_time_s(start)
    times_s = path.drive.time_s
    motion = only(motion, (log_s >= times_s[0]) & (log_s <= times_s[-1]) & ~_between_runs(log_s, path.drive))
    if motion.time_s.size < FEWEST_FRAMES:
        return motion, Fit(start, 1.0, 1, np.eye(3), np.zeros(0), 0.0)
    return motion, most_likely(motion, start, plays)


def _between_runs(log_s: Array, drive: DriveHistory) -> NDArray[np.bool_]:
    if drive.run is None:
        return np.zeros(log_s.size, dtype=bool)
    names = np.array(drive.run)
    after = np.clip(np.searchsorted(drive.time_s, log_s), 1, names.size - 1)
    return np.asarray(names[after] != names[after - 1])


def only(motion: Motion, kept: NDArray[np.bool_]) -> Motion:
    """Keep some of the frames, with white noise assumed until the noise is estimated again."""
    return replace(motion, time_s=motion.time_s[kept], gap_mm=motion.gap_mm[kept], noise=WHITE)


def unrefuted(motion: Motion, drive: DriveHistory, best: Fit, others: list[Candidate], frame_s: float) -> list[float]:
    """Offsets that explain the frames which they share with the best one as well as that does."""
    found = []
    by_chance = _by_chance(motion, drive, best)
    for candidate in others:
        shared, first = fitted(motion.time_s, motion.gap_mm, motion.path, candidate, QUICK_PLAYS)
        if shared.time_s.size < FEWEST_FRAMES or abs(first.at.offset_s - best.at.offset_s) < ONE_PEAK * frame_s:
            continue
        # Of the same frames, with the noise that the best one leaves there.
        own = replace(shared, noise=Noise(motion.noise.terms, np.empty(0)))
        own = replace(own, noise=noise_of(own, replace(best, residual_mm=_residual(own, best))))
        ours, rival = most_likely(own, best.at, QUICK_PLAYS), most_likely(own, first.at, QUICK_PLAYS)
        if not _shares_motion(motion, rival.at):
            continue
        if rival.scale > 0.0 and (rival.squares - ours.squares) / ours.variance_mm2 < UNREFUTED + by_chance:
            found.append(rival.at.offset_s)
    return found


def _by_chance(motion: Motion, drive: DriveHistory, best: Fit) -> float:
    """By how much another part of the log may fit worse for its own noise alone, in chi-square.

    The frames' noise is the same under every offset, the log's is another: two sums of n squares of it differ by a
    standard deviation of 2 n^(1/2). What smoothing takes off the log is not counted: rather one candidate too many.
    """
    # Second differences of white noise have six times its variance; turns of the motion are few.
    log_mm2 = (1.4826 * float(np.median(np.abs(np.diff(drive.input_mm, 2))))) ** 2 / 6.0
    gain = float(np.ptp(motion.gap_mm) / np.ptp(drive.input_mm))
    share = min(1.0, gain**2 * log_mm2 / max(best.variance_mm2, 1e-30))
    return CHANCE_SIGMAS * share * 2.0 * float(np.sqrt(motion.time_s.size))


def _shares_motion(motion: Motion, at: Alignment) -> bool:
    """Whether the frames within the log hold half of the gap's motion, or of the log's."""
    log_s, times_s = motion.log_time_s(at), motion.drive.time_s
    inside = (log_s >= times_s[0]) & (log_s <= times_s[-1])
    under = (times_s >= log_s[0]) & (times_s <= log_s[-1])

    def share(signal: Array, kept: NDArray[np.bool_]) -> float:
        around = signal[kept] - signal[kept].mean() if kept.any() else np.zeros(1)
        return float(around @ around) / max(float(np.sum((signal - signal.mean()) ** 2)), 1e-30)

    return max(share(motion.gap_mm, inside), share(motion.drive.input_mm, under)) > SHARED


def _residual(motion: Motion, best: Fit) -> Array:
    """Residual of the best alignment over other frames."""
    return most_likely(motion, best.at, (0.0, 0.08)).residual_mm
