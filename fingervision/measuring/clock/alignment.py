"""Offset between the recording's clock and the stage log's clock, found from the motion that both record."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array
from fingervision.measuring.clock.correlation import LARGEST_RATE, Candidate, candidates
from fingervision.measuring.clock.joint_fit import WHITE, Alignment, Fit, Motion, Noise, inflation
from fingervision.measuring.clock.log_path import FINER, LogPath
from fingervision.measuring.clock.noise_of_motion import noise_of
from fingervision.measuring.clock.play_posterior import Posterior, most_likely, posterior

FEWEST_FRAMES, FEWEST_ROWS = 12, 3
"""Frames with a gap and rows of the log below which there is nothing to fit: the fit has eight free numbers."""
LEAST_GAIN = 40.0
"""Gain in chi-square of the motion over a gap that stands: by chance 20 come once in 10^4 recordings (four parameters),
as much again for the offsets among which was chosen."""
LEAST_SHARE = 0.5
"""Share of the gap's variance that the log must explain for it to be this recording's log."""
FOLLOWED = 0.95
"""Share below which something else moves the gap as well, and is said."""
CHANCE_SIGMAS = 3.0
"""Standard deviations that a rival's chi-square may be larger by the log's own noise: one rival in 700 is then lost."""
UNREFUTED = 25.0
"""Chi-square by which another offset must be worse, over the frames that both explain, to be refuted: 5 sigma."""
SHARED = 0.5
"""Share of the motion of either record that must lie in the overlap: less than half is no common motion."""
QUICK_PLAYS = (0.0, 0.02, 0.08, 0.3)
"""Plays from which every candidate is fitted, over the largest possible one."""
OUTLIER_SIGMAS = 6.0
"""Beyond so many (robust) standard deviations a frame's gap is taken for wrong and left out of the fit."""
SYSTEMATIC = 0.004
"""Share of the time between two frames and two rows that is known no better: what a curve between two rows is off at a
turn, found by `python -m tests.benchmarks.clock` as the scatter that many frames do not average out."""
MOST_PLAY_SHARE = 0.5
"""Of the stroke: where more is lost in play, an error of the log's turns shifts the whole motion, and the fit of
`python -m tests.benchmarks.clock --seed 404` was off by a frame."""
ONE_PEAK = 0.25
"""Frames: offsets closer than that are the same peak."""
REFINEMENTS = 3
"""Times that noise and fit are estimated in turn; the third changes an uncertainty by less than a tenth."""
SURE_RATE, ORDINARY_RATE = 3.0, 1e-4
"""Standard uncertainties, and relative rate, from which on a clock is said to run fast or slow: crystals differ by up
to 100 parts in a million, and compressed pictures bend a motion by as much."""


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """Relation of the two clocks: recording's time = log's time + offset_s + rate (log's time - reference_s).

    Parameters
    ----------
    offset_s, u_offset_s : float
        At the log's first row, with its standard uncertainty.
    rate, u_rate : float
        How much faster the recording's clock runs than the log's, relative.
    reference_s : float
        The log's first time.
    u_time_s : float
        Standard uncertainty of the common clock over the frames that have an input, as RMS.
    play_mm, u_play_mm : float
        Play that was fitted alongside.
    explained_share : float
        Of the gap's variance by the log.
    notes : tuple of str
        What a reader must know, a sentence each.
    """

    offset_s: float
    u_offset_s: float
    rate: float
    u_rate: float
    reference_s: float
    u_time_s: float
    play_mm: float
    u_play_mm: float
    explained_share: float
    notes: tuple[str, ...] = ()

    def log_time_s(self, time_s: float) -> float:
        """Convert a time of the recording to the log's clock (s)."""
        return self.reference_s + (time_s - self.reference_s - self.offset_s) / (1.0 + self.rate)

    def recording_time_s(self, log_time_s: Array) -> Array:
        """Convert times of the log to the recording's clock (s); shape (n,)."""
        return np.asarray(log_time_s + self.offset_s + self.rate * (log_time_s - self.reference_s))


@dataclass(frozen=True, slots=True)
class NoClockOffset:
    """Reason why the offset cannot be determined.

    Parameters
    ----------
    words : str
        What was found, in a sentence that says what to do.
    candidates_s : tuple of float
        Offsets among which the motion does not decide; empty where there is another reason.
    """

    words: str
    candidates_s: tuple[float, ...] = ()


def find_clock_offset(time_s: Array, gap_mm: Array, drive: DriveHistory) -> ClockOffset | NoClockOffset:
    """Find the offset between a recording and a log: by correlation, then by a joint fit with play and scale.

    Parameters
    ----------
    time_s, gap_mm : ndarray of float, shape (n,)
        Frames with a gap, on the recording's clock, in order.
    drive : DriveHistory
        Log on its own clock.

    Returns
    -------
    ClockOffset or NoClockOffset
    """
    refused = _too_little(time_s, gap_mm, drive)
    if refused is not None:
        return refused
    found = candidates(time_s, gap_mm, drive)
    if not found:
        return NoClockOffset(
            "at no offset do the recording and the drive share half of their time and motion: record and log the same "
            "moves, or state --drive-offset-s."
        )
    path = LogPath.of(drive)
    frame_s = float(np.median(np.diff(time_s)))
    fits = [(one, *_fitted(time_s, gap_mm, path, one, QUICK_PLAYS)) for one in found]
    fits = [entry for entry in fits if entry[1].time_s.size >= FEWEST_FRAMES]
    if not fits:
        return NoClockOffset("fewer than 12 frames with a gap lie within the drive's times: record longer.")
    best, motion, whole = max(fits, key=lambda entry: _information(entry[1], entry[2]))
    for _ in range(REFINEMENTS):
        kept = _inliers(whole.residual_mm)
        motion, near = _only(motion, kept), replace(whole, residual_mm=whole.residual_mm[kept])
        motion = replace(motion, noise=noise_of(motion, near))
        whole = most_likely(motion, whole.at)
    refused = _unlike(motion, whole)
    if refused is not None:
        return refused
    rivals = _unrefuted(motion, drive, whole, [one for one, _, _ in fits if one is not best], frame_s)
    if rivals:
        return _ambiguous([whole.at.offset_s, *rivals])
    at = posterior(motion, whole)
    return _stated(motion, at, whole, frame_s)


def _only(motion: Motion, kept: NDArray[np.bool_]) -> Motion:
    return replace(motion, time_s=motion.time_s[kept], gap_mm=motion.gap_mm[kept], noise=WHITE)


def _too_little(time_s: Array, gap_mm: Array, drive: DriveHistory) -> NoClockOffset | None:
    if time_s.size < FEWEST_FRAMES or float(np.ptp(time_s)) == 0.0:
        return NoClockOffset(f"only {time_s.size} frames have a time and a gap, and {FEWEST_FRAMES} are needed.")
    if drive.time_s.size < FEWEST_ROWS or float(np.ptp(drive.input_mm)) == 0.0:
        return NoClockOffset("the drive does not move: log a run that does.")
    if float(np.ptp(gap_mm)) == 0.0:
        return NoClockOffset("the gap does not move: record a run that does.")
    return None


def _fitted(
    time_s: Array, gap_mm: Array, path: LogPath, candidate: Candidate, plays: tuple[float, ...]
) -> tuple[Motion, Fit]:
    """Fit the frames that lie within the log, starting from a candidate offset."""
    middle_s = 0.5 * float(time_s[0] + time_s[-1])
    start = Alignment(candidate.offset_s, candidate.rate, 0.0, 0.0)
    motion = Motion(time_s, gap_mm, path, middle_s, WHITE)
    log_s = motion.log_time_s(start)
    times_s = path.drive.time_s
    motion = _only(motion, (log_s >= times_s[0]) & (log_s <= times_s[-1]) & ~_between_runs(log_s, path.drive))
    if motion.time_s.size < FEWEST_FRAMES:
        return motion, Fit(start, 1.0, 1, np.eye(3), np.zeros(0), 0.0)
    return motion, most_likely(motion, start, plays)


def _between_runs(log_s: Array, drive: DriveHistory) -> NDArray[np.bool_]:
    if drive.run is None:
        return np.zeros(log_s.size, dtype=bool)
    names = np.array(drive.run)
    after = np.clip(np.searchsorted(drive.time_s, log_s), 1, names.size - 1)
    return np.asarray(names[after] != names[after - 1])


def _information(motion: Motion, found: Fit) -> float:
    """Log likelihood ratio against a constant gap.

    It grows with the number of frames that are explained equally well.
    """
    around = motion.gap_mm - motion.gap_mm.mean()
    return float(motion.time_s.size * np.log(max(float(around @ around), 1e-30) / max(found.squares, 1e-30)))


def _inliers(residual_mm: Array) -> NDArray[np.bool_]:
    spread = 1.4826 * float(np.median(np.abs(residual_mm - np.median(residual_mm))))
    return np.asarray(np.abs(residual_mm - np.median(residual_mm)) <= max(OUTLIER_SIGMAS * spread, 1e-12))


def _unlike(motion: Motion, found: Fit) -> NoClockOffset | None:
    """Refuse a log that the gap does not follow."""
    still = motion.whitened(motion.gap_mm - motion.gap_mm.mean())
    still = still - still.mean()
    gain = found.degrees * float(np.log(max(float(still @ still), 1e-30) / max(found.squares, 1e-30)))
    share = _explained(motion, found)
    if gain < LEAST_GAIN:
        moved_um, noise_um = 1e3 * float(np.ptp(motion.gap_mm)), 1e3 * float(np.std(found.residual_mm))
        return NoClockOffset(
            f"there is too little motion to find it: the gap changes by {moved_um:.3g} µm in all, of which the drive "
            f"explains a share of {max(share, 0.0):.2f} and {noise_um:.3g} µm RMS are noise. Record a run that moves."
        )
    if found.scale < 0.0:
        return NoClockOffset(
            "the gap follows the drive best with its sign reversed, closing as the input grows, and a motion that "
            "repeats can look so half a period off: check the drive's sign (positive opens)."
        )
    if share < LEAST_SHARE:
        return NoClockOffset(
            f"the gap does not follow the drive at any offset: at the best, {found.at.offset_s:.3f} s, it explains a "
            f"share of {max(share, 0.0):.2f} of the gap's variance. Is this the log of this recording?"
        )
    return None


def _explained(motion: Motion, found: Fit) -> float:
    return 1.0 - float(np.var(found.residual_mm) / np.var(motion.gap_mm))


def _unrefuted(motion: Motion, drive: DriveHistory, best: Fit, others: list[Candidate], frame_s: float) -> list[float]:
    """Offsets that explain the frames shared with the best offset as well as that one does."""
    found = []
    by_chance = _by_chance(motion, drive, best)
    for candidate in others:
        shared, first = _fitted(motion.time_s, motion.gap_mm, motion.path, candidate, QUICK_PLAYS)
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
    """How much worse another part of the log may fit because of its own noise only, in chi-square.

    The frames' noise is the same under every offset, but the log's noise is not: two sums of n squares of it differ by
    a standard deviation of 2 n^(1/2). That smoothing reduces the log's noise is not taken into account, which gives
    rather one candidate too many.
    """
    # Second differences of white noise have six times its variance; turns of the motion are few.
    log_mm2 = (1.4826 * float(np.median(np.abs(np.diff(drive.input_mm, 2))))) ** 2 / 6.0
    gain = float(np.ptp(motion.gap_mm) / np.ptp(drive.input_mm))
    share = min(1.0, gain**2 * log_mm2 / max(best.variance_mm2, 1e-30))
    return CHANCE_SIGMAS * share * 2.0 * float(np.sqrt(motion.time_s.size))


def _shares_motion(motion: Motion, at: Alignment) -> bool:
    """Whether the frames within the log contain half of the gap's motion, or half of the log's."""
    log_s, times_s = motion.log_time_s(at), motion.drive.time_s
    inside = (log_s >= times_s[0]) & (log_s <= times_s[-1])
    under = (times_s >= log_s[0]) & (times_s <= log_s[-1])

    def share(signal: Array, kept: NDArray[np.bool_]) -> float:
        around = signal[kept] - signal[kept].mean() if kept.any() else np.zeros(1)
        return float(around @ around) / max(float(np.sum((signal - signal.mean()) ** 2)), 1e-30)

    return max(share(motion.gap_mm, inside), share(motion.drive.input_mm, under)) > SHARED


def _residual(motion: Motion, best: Fit) -> Array:
    """Residual of the best alignment, computed over other frames."""
    return most_likely(motion, best.at, (0.0, 0.08)).residual_mm


def _ambiguous(offsets_s: list[float]) -> NoClockOffset:
    """List the offsets that fit a periodic motion equally well."""
    nearest = np.unique(np.round(offsets_s, 4))
    said = ", ".join(f"{one:.3f}" for one in nearest[:6]) + (" ..." if nearest.size > 6 else "")
    apart = f", {np.median(np.diff(nearest)):.3g} s apart," if nearest.size > 1 else ""
    return NoClockOffset(
        f"the motion repeats and fits at {nearest.size} offsets{apart} equally well ({said} s): give --drive-offset-s, "
        "or record a run that starts, stops or turns once where it does not repeat.",
        tuple(float(one) for one in nearest),
    )


def _stated(motion: Motion, at: Posterior, best: Fit, frame_s: float) -> ClockOffset | NoClockOffset:
    """Convert the fit to an offset at the log's first row, on the log's clock."""
    first_s = float(motion.drive.time_s[0])
    more = np.sqrt(inflation(motion, best.at))
    offset_s, rate, covariance = at.offset_s, at.rate, at.covariance * np.outer(more[:2], more[:2])
    # Recording's time at which the log begins; there the offset is middle's plus the rate times the way to it.
    begins_s = (first_s + offset_s - rate * motion.middle_s) / (1.0 - rate)
    away_s = np.append(motion.time_s, begins_s) - motion.middle_s
    variance = covariance[0, 0] + 2.0 * away_s * covariance[0, 1] + away_s**2 * covariance[1, 1]
    row_s = float(np.median(np.diff(motion.path.drive.time_s))) * FINER
    variance += (SYSTEMATIC * np.hypot(frame_s, row_s)) ** 2
    u_time_s = float(np.sqrt(np.mean(variance[:-1])))
    u_offset_s, u_rate = float(np.sqrt(variance[-1])), float(np.sqrt(covariance[1, 1]))
    if not np.isfinite(u_time_s) or u_time_s > 0.1 * float(np.ptp(motion.time_s)):
        return NoClockOffset(
            f"the motion leaves it open by +-{2.0 * u_time_s:.3g} s (k = 2): a move at one speed, or one that is "
            "over between two frames, looks the same at every offset near. Record a run that starts, stops or turns."
        )
    stroke_mm = float(np.ptp(motion.drive.input_mm))
    if at.play_mm > MOST_PLAY_SHARE * stroke_mm:
        return NoClockOffset(
            f"a play of {1e3 * at.play_mm:.3g} µm takes up most of the stroke of {1e3 * stroke_mm:.3g} µm, and what is "
            "left of the motion does not tell the offset. Record a run with a longer stroke."
        )
    if abs(rate) > LARGEST_RATE:
        return NoClockOffset(
            f"at the best offset, {offset_s:.3f} s, the clocks would differ by {1e2 * abs(rate):.2f} %, and clocks "
            "differ by 0.1 % at the most: is this the log of this recording, and are its times in seconds?"
        )
    notes = []
    share = _explained(motion, best)
    if abs(rate) > max(SURE_RATE * u_rate, ORDINARY_RATE):
        runs = "fast" if rate > 0.0 else "slow"
        notes.append(
            f"The recording's clock runs {runs} against the drive's by {1e2 * abs(rate):.3f} % "
            f"(U = {2e2 * u_rate:.3f} %, k = 2): allowed for."
        )
    if u_time_s > 0.5 * frame_s:
        notes.append(
            f"The clock offset is known to no better than U = {2.0 * u_time_s:.3g} s (k = 2), more than one frame of "
            f"{frame_s:.3g} s: there is little motion that starts, stops or turns."
        )
    if share < FOLLOWED:
        notes.append(
            f"The drive explains a share of {share:.2f} of the gap's variance: the gap moves by something else as well."
        )
    return ClockOffset(
        offset_s=begins_s - first_s,
        u_offset_s=u_offset_s,
        rate=rate / (1.0 - rate),
        u_rate=u_rate,
        reference_s=first_s,
        u_time_s=u_time_s,
        play_mm=at.play_mm,
        u_play_mm=at.u_play_mm * float(more[2]),
        explained_share=share,
        notes=tuple(notes),
    )
