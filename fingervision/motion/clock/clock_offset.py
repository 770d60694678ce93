"""Relation between the clocks of a recording and of a log, or the reason why it could not be determined."""

from dataclasses import dataclass, replace

import numpy as np

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """Relation of two clocks: recording's time = log's time + offset_s + rate (log's time - reference_s).

    Parameters
    ----------
    offset_s, u_offset_s : float
        Offset at the log's first row, with its standard uncertainty.
    rate, u_rate : float
        Relative excess of the recording's clock rate over the log's, with its standard uncertainty.
    reference_s : float
        The log's first time.
    u_time_s : float
        Standard uncertainty of the relation of the two clocks, as RMS over the frames that have an input.
    play_mm, u_play_mm : float
        Play, fitted together with the offset, with its standard uncertainty.
    corner_s, u_corner_s : float
        Duration of the stage's corners between two rows of the log, with its standard uncertainty.
    explained_share : float
        Share of the gap's variance that the log explains.
    notes : tuple of str
        Remarks that a reader must know, one sentence each.
    runner_up_s : float or None
        Next best offset, at the middle of the recording, that was rejected; None if no other offset explains the
        motion.
    """

    offset_s: float
    u_offset_s: float
    rate: float
    u_rate: float
    reference_s: float
    u_time_s: float
    play_mm: float
    u_play_mm: float
    corner_s: float
    u_corner_s: float
    explained_share: float
    notes: tuple[str, ...] = ()
    runner_up_s: float | None = None

    def log_time_s(self, time_s: float) -> float:
        """Convert a time of the recording to the log's clock."""
        return self.reference_s + (time_s - self.reference_s - self.offset_s) / (1.0 + self.rate)

    def recording_time_s(self, log_time_s: Array) -> Array:
        """Convert times of the log to the recording's clock; shape (n,)."""
        return np.asarray(log_time_s + self.offset_s + self.rate * (log_time_s - self.reference_s))

    def on_the_recording(self, drive: DriveHistory) -> DriveHistory:
        """Return a log with its times on the recording's clock."""
        return replace(drive, time_s=self.recording_time_s(drive.time_s))


@dataclass(frozen=True, slots=True)
class NoClockOffset:
    """Reason why the clock offset cannot be determined.

    Parameters
    ----------
    words : str
        Sentence that states the reason, and what to do.
    candidates_s : tuple of float
        Offsets between which the motion does not decide; empty if there is another reason.
    """

    words: str
    candidates_s: tuple[float, ...] = ()
