"""Other clock offsets that fit as well: other peaks of the correlation, and other minima near the best offset."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array
from fingervision.motion.clock.corner_rounding import STRETCHES, Spread
from fingervision.motion.clock.correlation import Candidate
from fingervision.motion.clock.joint_fit import Fit, fit, squares_at
from fingervision.motion.clock.motion_model import WHITE, Alignment, Motion, Noise
from fingervision.motion.clock.noise import LARGEST_ROOT, noise_of
from fingervision.motion.clock.play_posterior import BESIDE_S, BESIDE_STEP_S, VALLEYS, longest_play_mm, most_likely
from fingervision.motion.clock.refusals import FEWEST_FRAMES, LEAST_SHARE, explained
from fingervision.motion.log_path import LogPath

CHANCE_SIGMAS = 3.0
"""Number of standard deviations by which the log's own noise may increase the chi-square of another offset; one of 700
valid offsets is then missed.
"""
UNREFUTED = 25.0
"""Increase of chi-square, over common frames, above which another offset is rejected: 5 standard deviations."""
SHARED = 0.5
"""Least share of the motion of either record that must lie in the overlap."""
ONE_PEAK = 0.25
"""Distance in frames within which two offsets are the same peak."""
BENT = 0.1
"""Change of speed at a row, over the largest of the log, from which on the path beside the row is bent."""
SURE_FRAMES = 0.4
"""Least share of the frames that lie elsewhere: with fewer, the bends themselves are the motion, as of a sine."""
MOST_SHARED = 2.0 / 3.0
"""Share of the best offset's frames that another one must cover to be judged without the bends: a few halts alone fit
elsewhere by chance, as scale and zero of the gap are free."""
QUICK_PLAYS = (0.0, 0.02, 0.08, 0.3)
"""Initial values of the play for the fit of every candidate, relative to the largest possible play."""


def fitted(
    time_s: Array, gap_mm: Array, path: LogPath, candidate: Candidate, plays: tuple[float, ...]
) -> tuple[Motion, Fit]:
    """Fit the frames that lie within the log's time for a candidate offset."""
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
    """Keep only the selected frames; their noise is assumed to be white until the noise is estimated again."""
    return replace(motion, time_s=motion.time_s[kept], gap_mm=motion.gap_mm[kept], noise=WHITE)


@dataclass(frozen=True, slots=True)
class RunnerUp:
    """The most likely of the rejected offsets.

    Parameters
    ----------
    offset_s : float
        Offset at the middle of the recording.
    share : float
        Share of the gap's variance that the log explains there, of the frames in common with the best offset.
    best_share : float
        The same share at the best offset.
    """

    offset_s: float
    share: float
    best_share: float

    def words(self) -> str:
        """Sentence that names the offset."""
        return (
            f"The next best offset, {self.offset_s:.3f} s, is rejected: the drive explains a share of "
            f"{self.share:.3f} of the gap's variance at this offset, and of {self.best_share:.5f} at the chosen offset."
        )


def unrefuted(
    motion: Motion, drive: DriveHistory, best: Fit, others: list[Candidate], frame_s: float
) -> tuple[list[float], RunnerUp | None]:
    """Find offsets that fit as well as the best offset in the frames that both cover, and the best rejected offset.

    A rejected offset is reported only if it would have been accepted in the absence of all others.
    """
    found: list[float] = []
    rejected: list[tuple[float, RunnerUp]] = []
    by_chance = _by_chance(motion, drive, best)
    for candidate in others:
        shared, first = fitted(motion.time_s, motion.gap_mm, motion.path, candidate, QUICK_PLAYS)
        if shared.time_s.size < FEWEST_FRAMES or abs(first.at.offset_s - best.at.offset_s) < ONE_PEAK * frame_s:
            continue
        # Both offsets are compared for the same frames, with the noise of the best fit in these frames.
        own = replace(shared, noise=Noise(motion.noise.terms, np.empty(0)))
        own = replace(own, noise=noise_of(own, replace(best, residual_mm=_residual(own, best))))
        ours, rival = most_likely(own, best.at, QUICK_PLAYS), most_likely(own, first.at, QUICK_PLAYS)
        apart_s = abs(rival.at.offset_s - best.at.offset_s)
        if rival.scale <= 0.0 or apart_s < ONE_PEAK * frame_s or not _shares_motion(motion, rival.at):
            continue
        worse = (rival.squares - ours.squares) / ours.variance_mm2
        is_long = own.time_s.size >= MOST_SHARED * motion.time_s.size
        if worse < UNREFUTED + by_chance or (is_long and _refuted_at_bends_only(own, ours, rival)):
            found.append(rival.at.offset_s)
        elif (share := explained(own, rival)) > LEAST_SHARE:
            rejected.append((worse, RunnerUp(rival.at.offset_s, share, explained(own, ours))))
    return found, min(rejected, key=lambda entry: entry[0])[1] if rejected else None


def _refuted_at_bends_only(motion: Motion, best: Fit, rival: Fit) -> bool:
    """Whether another offset fits as well, except where the log's path bends between two rows.

    In a staircase of equal steps, all halts fit one step on as well. What is left to decide are the starts and ends of
    the moves, where the path between rows is least known, and of several offsets the luckiest one would be taken.
    """
    rows = motion.path.rows
    bend = np.pad(np.abs(np.diff(np.diff(rows.input_mm) / np.diff(rows.time_s))), 1, mode="edge")
    is_bent = np.maximum(bend[:-1], bend[1:]) > BENT * float(bend.max())
    sure = np.ones(motion.time_s.size, dtype=np.bool_)
    for one in (best, rival):
        interval = np.searchsorted(rows.time_s, motion.log_time_s(one.at), side="right") - 1
        sure &= ~is_bent[np.clip(interval, 0, is_bent.size - 1)]
    if np.count_nonzero(sure) < max(FEWEST_FRAMES, SURE_FRAMES * sure.size):
        return False
    ours, theirs = best.residual_mm[sure], rival.residual_mm[sure]
    # The frames' noise is correlated: of its mean over a halt, the variance is larger by this.
    slow = 1.0 / max(1.0 - float(motion.noise.terms.sum()), 1.0 - LARGEST_ROOT) ** 2
    variance_mm2 = float(ours @ ours) / ours.size * slow
    return float(theirs @ theirs - ours @ ours) < UNREFUTED * variance_mm2


def _by_chance(motion: Motion, drive: DriveHistory, best: Fit) -> float:
    """Increase of chi-square that the log's own noise may cause at another offset.

    The frames' noise is the same for every offset, but the log's noise differs from one part of the log to another: two
    sums of n squared normalised errors differ with a standard deviation of 2 n^(1/2). The reduction of the log's noise
    by smoothing is ignored, so that rather too many candidates are kept than too few.
    """
    # Second differences of white noise have six times its variance; the few reversals of the motion do not affect the
    # median.
    log_mm2 = (1.4826 * float(np.median(np.abs(np.diff(drive.input_mm, 2))))) ** 2 / 6.0
    gain = float(np.ptp(motion.gap_mm) / np.ptp(drive.input_mm))
    share = min(1.0, gain**2 * log_mm2 / max(best.variance_mm2, 1e-30))
    return CHANCE_SIGMAS * share * 2.0 * float(np.sqrt(motion.time_s.size))


def _shares_motion(motion: Motion, at: Alignment) -> bool:
    """Whether the overlap contains half of the gap's motion, or half of the log's."""
    log_s, times_s = motion.log_time_s(at), motion.drive.time_s
    inside = (log_s >= times_s[0]) & (log_s <= times_s[-1])
    under = (times_s >= log_s[0]) & (times_s <= log_s[-1])

    def share(signal: Array, kept: NDArray[np.bool_]) -> float:
        around = signal[kept] - signal[kept].mean() if kept.any() else np.zeros(1)
        return float(around @ around) / max(float(np.sum((signal - signal.mean()) ** 2)), 1e-30)

    return max(share(motion.gap_mm, inside), share(motion.drive.input_mm, under)) > SHARED


def _residual(motion: Motion, best: Fit) -> Array:
    """Residuals of the best alignment, refitted to other frames."""
    return most_likely(motion, best.at, (0.0, 0.08)).residual_mm


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
