"""Model of the gap from a stage's log: play, clock offset and rate, a line with bends, creep and noise."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.drive import DriveHistory
from fingervision.domain.effect import Array
from fingervision.effects.play_operator import play
from fingervision.motion.log_path import LogPath
from fingervision.motion.recursion import recursion

CREEP_S = (0.5, 5.0)
"""Time constants of creep (s), a decade apart: faster creep acts as a delay and becomes part of the offset; slower
creep hardly depends on the motion.
"""
CREEP_STEP = 0.1
"""Step of the time grid for creep, as a share of the shortest time constant: the error is 1e-3 of the lag."""
MOST_KNOTS, FRAMES_A_KNOT = 11, 20
"""Largest number of knots of gap against input, and least number of frames per knot; between two knots, a twelfth of
the range, the kink of a contact is not resolved, and its frames are left out as outliers.
"""


@dataclass(frozen=True, slots=True)
class Alignment:
    """Offset and rate between the clocks of two records, and the play between their two motions.

    Parameters
    ----------
    offset_s : float
        Recording's time minus log's time at `Motion.middle_s`.
    rate : float
        Growth of that offset per time of the recording.
    play_mm : float
        Full width of the play.
    start : float
        State of the play at the log's first sample, in units of half the play's width.
    """

    offset_s: float
    rate: float
    play_mm: float
    start: float


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """Noise of the gap from frame to frame.

    Parameters
    ----------
    terms : ndarray of float, shape (p,)
        Coefficients of an autoregression; empty for white noise.
    weights : ndarray of float, shape (n - p,)
        Weights of the whitened rows: below 1 for rows with an uncertain input; empty if all are equal.
    starts : ndarray of int, shape (g,)
        First whitened row of each stretch in which all inputs have an error in common; empty without such stretches.
    unit : ndarray of float, shape (n - p,)
        Effect of the shared error on the whitened rows, normalised to length 1 within each stretch.
    shrink : ndarray of float, shape (g,)
        Share of a stretch's projection on `unit` that is subtracted, 1 - 1 / sqrt(1 + variance ratio).
    variance_mm2 : float
        Variance of the frames' own noise after the autoregression.
    """

    terms: Array
    weights: Array
    starts: NDArray[np.intp] = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    unit: Array = field(default_factory=lambda: np.empty(0))
    shrink: Array = field(default_factory=lambda: np.empty(0))
    variance_mm2: float = 0.0


WHITE = Noise(np.empty(0), np.empty(0))


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """The frames that lie within the log's time, together with the log.

    Parameters
    ----------
    time_s, gap_mm : ndarray of float, shape (n,)
        Times and gaps of the frames.
    path : LogPath
        Path of the input.
    middle_s : float
        Recording's time at which the offset is stated.
    noise : Noise
        Noise from frame to frame.
    creeps : bool
        Whether the model includes creep of the gap.
    creep_s : tuple of float
        Time constants of the creep.
    """

    time_s: Array
    gap_mm: Array
    path: LogPath
    middle_s: float
    noise: Noise
    creeps: bool = False
    creep_s: tuple[float, ...] = CREEP_S

    @property
    def drive(self) -> DriveHistory:
        """The log, densely interpolated."""
        return self.path.drive

    def log_time_s(self, at: Alignment) -> Array:
        """Times of the frames on the log's clock; shape (n,)."""
        return np.asarray(self.time_s - at.offset_s - at.rate * (self.time_s - self.middle_s))

    def _behind_play(self, at: Alignment) -> tuple[Array, Array]:
        """Output of the play operator at the frames, and at the log's points.

        The output is exact for a log that is linear between its points.

        Between two samples the input is monotonic, so that the play operator clips the state at the earlier sample
        once.
        """
        log_s = self.log_time_s(at)
        inputs = np.interp(log_s, self.drive.time_s, self.drive.input_mm)
        if at.play_mm == 0.0:
            return np.asarray(inputs), self.drive.input_mm
        states = play(self.drive.input_mm, at.play_mm, at.start)
        before = np.clip(np.searchsorted(self.drive.time_s, log_s, side="right") - 1, 0, states.size - 1)
        half = 0.5 * at.play_mm
        return np.asarray(np.clip(states[before], inputs - half, inputs + half)), states

    def design(self, at: Alignment) -> Array:
        """Regressors of the gap: 1, z, max(0, z - z_k) and creep, with z the play's output relative to the log's range.

        The gap is a piecewise linear function of the input that may bend at every knot z_k; it represents a gripper's
        curve, and the kink where the fingers meet. Creep has two columns per time constant: the lag behind the input,
        and the decay of the lag that the motion before the log's first row left. The result has shape
        (n, 2 + knots [+ 4]).
        """
        low, high = float(self.drive.input_mm.min()), float(self.drive.input_mm.max())
        half = 0.5 * max(high - low, 1e-12)
        inputs, states = self._behind_play(at)
        z = (inputs - 0.5 * (low + high)) / half
        count = min(MOST_KNOTS, self.time_s.size // FRAMES_A_KNOT)
        knots = np.linspace(-1.0, 1.0, count + 2)[1:-1]
        lags = []
        if self.creeps:
            since_s = np.maximum(self.log_time_s(at) - float(self.drive.time_s[0]), 0.0)
            lags = [(self._lagging(at, states, tau_s) - inputs) / half for tau_s in self.creep_s]
            lags += [np.exp(-since_s / tau_s) for tau_s in self.creep_s]
        return np.column_stack([np.ones_like(z), z, np.maximum(z[:, None] - knots, 0.0), *lags])

    def _lagging(self, at: Alignment, states: Array, tau_s: float) -> Array:
        """Exponentially weighted mean of past `states` with a given time constant, at the frames; shape (n,)."""
        times_s = self.drive.time_s
        step_s = CREEP_STEP * min(self.creep_s)
        grid_s = times_s[0] + step_s * np.arange(int((times_s[-1] - times_s[0]) / step_s) + 2)
        past = np.interp(grid_s, times_s, states)
        share = 1.0 - float(np.exp(-step_s / tau_s))
        # Between grid points the path is a straight line, so that its mean is used for each step.
        middle = np.append(past[:1], 0.5 * (past[1:] + past[:-1]))
        mean = recursion(1.0 - share, share * (middle - past[0])) + past[0]
        return np.asarray(np.interp(self.log_time_s(at), grid_s, mean))

    def whitened(self, columns: Array) -> Array:
        """Remove the autoregression along time, and the errors that stretches share, from columns.

        The first frames, which have no past, are left out. A shared error is whitened by the symmetric square root of
        the inverse covariance matrix, which is the unit matrix plus a matrix of rank one.
        """
        noise = self.noise
        terms = noise.terms
        out = columns[terms.size :].copy()
        for k, share in enumerate(terms, start=1):
            out -= share * columns[terms.size - k : columns.shape[0] - k]
        table = out if out.ndim == 2 else out[:, None]
        if noise.weights.size:
            table *= noise.weights[:, None]
        table = self._without_shared(table)
        return np.asarray(table if out.ndim == 2 else table[:, 0])

    def _without_shared(self, table: Array) -> Array:
        """Subtract a share of the shared error's time course from whitened columns; shape (m, k)."""
        noise = self.noise
        if not noise.starts.size:
            return table
        counts = np.diff(np.append(noise.starts, table.shape[0]))
        along = np.add.reduceat(table * noise.unit[:, None], noise.starts, axis=0) * noise.shrink[:, None]
        return np.asarray(table - noise.unit[:, None] * np.repeat(along, counts, axis=0))

    def weighed(self, pulls: Array) -> Array:
        """Weights of the frames' own noise (white after the autoregression) in sums over whitened frames; shape (m, k).

        The weights are the transpose of those in `whitened`; the part for shared errors is symmetric.
        """
        table = self._without_shared(pulls)
        return table * self.noise.weights[:, None] if self.noise.weights.size else table
