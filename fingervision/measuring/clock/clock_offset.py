"""The relation of the clocks of a recording and a log, or the reason why none was found."""

from dataclasses import dataclass

import numpy as np

from fingervision.domain.effect import Array


@dataclass(frozen=True, slots=True)
class ClockOffset:
    """One clock for both records: recording's time = log's time + offset_s + rate (log's time - reference_s).

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
        """Give the log's time at an instant of the recording."""
        return self.reference_s + (time_s - self.reference_s - self.offset_s) / (1.0 + self.rate)

    def recording_time_s(self, log_time_s: Array) -> Array:
        """Give the recording's times at times of the log; shape (n,)."""
        return np.asarray(log_time_s + self.offset_s + self.rate * (log_time_s - self.reference_s))


@dataclass(frozen=True, slots=True)
class NoClockOffset:
    """Why no offset can be told.

    Parameters
    ----------
    words : str
        What was found, in a sentence that says what to do.
    candidates_s : tuple of float
        Offsets among which the motion does not decide; empty where there is another reason.
    """

    words: str
    candidates_s: tuple[float, ...] = ()
