"""Measured table: gap and finger positions with the recorded input."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from calib.short_repr import ShortRepr
from fingervision.domain.drive import DriveHistory

# A reference slot: an opening of known width in the fingers' plane, measured through the same camera and scale.


@dataclass(frozen=True, slots=True)
class ReferenceSlot:
    """One reference slot with its true and its measured width.

    Parameters
    ----------
    size_mm, u_size_mm : float
        True width of the slot, and its standard uncertainty.
    measured_mm, u_random_mm : float
        Width measured in the pictures, and its random standard uncertainty.
    """

    size_mm: float
    u_size_mm: float
    measured_mm: float
    u_random_mm: float


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Channel(ShortRepr):
    """A user-named column of a table: position (mm) or rotation (mrad) of a body or point of the mechanism.

    Parameters
    ----------
    value : ndarray of float, shape (n,)
        Measured values; 0 in rows without a value.
    present : ndarray of bool, shape (n,)
        Whether the row has a value.
    u : ndarray of float, shape (n,), or None
        Random standard uncertainties of the values; None if not stated.
    """

    value: NDArray[np.float64]
    present: NDArray[np.bool_]
    u: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class RecordedPath(ShortRepr):
    """All rows with an input, with or without a measured gap; run after run, each run sorted by time.

    Parameters
    ----------
    input_mm, time_s : ndarray of float, shape (m,)
        Recorded input and times.
    runs : tuple of slice
        Rows of each run.
    rows : ndarray of int, shape (n,)
        Indices of the rows that also have a gap.
    """

    input_mm: NDArray[np.float64]
    time_s: NDArray[np.float64]
    runs: tuple[slice, ...]
    rows: NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class FoundClock:
    """Offset between the clocks of input and gap, and the stage's corners, as far as their common motion shows them.

    Parameters
    ----------
    u_s : float
        Standard uncertainty of the offset; 0 if both have the same clock, or if no uncertainty is stated.
    corner_s, u_corner_s : float
        Duration of the stage's corners between two rows of the log, and its standard uncertainty.
    """

    u_s: float = 0.0
    corner_s: float = 0.0
    u_corner_s: float = 0.0


ONE_CLOCK = FoundClock()
"""Input and gap were recorded with the same clock."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MeasuredTable(ShortRepr):
    """Rows of a measured table that have a gap, run after run, each run sorted by time.

    Parameters
    ----------
    input_mm, gap_mm : ndarray of float, shape (n,)
        Recorded input and measured gap (`right_mm - left_mm` where both exist).
    midline_mm : ndarray of float, shape (n,), or None
        Mean position of the two fingers; None if only the gap was measured.
    time_s : ndarray of float, shape (n,), or None
        Times.
    runs : tuple of slice
        Samples of each run.
    run_names : tuple of str
        Names of the runs, as in the table.
    u_random_mm : ndarray of float, shape (n,), or None
        Random standard uncertainty of the gap, as stated by the measurement.
    force_n : ndarray of float, shape (n,), or None
        Force at the drive.
    notes : tuple of str
        Corrections and omissions that the reader of the table made, one sentence each.
    slots : tuple of ReferenceSlot
        Reference slots of known width that were measured with the same camera.
    path : RecordedPath or None
        All rows with an input, including those without a gap; None if every row has a gap, or without times.
    clock : FoundClock
        What was found about the clocks of input and gap from the motion in this table.
    log : DriveHistory or None
        The drive's log from which the input was read, on the clock of the gap; None if both were read together.
    stamp_s : float
        Resolution (s) of the times at which the input was read from a log; 0 if input and gap were read together, or
        if the times are not rounded.
    channels : mapping of str to Channel
        User-named columns, such as `right_finger.angle_mrad`.
    followed : str
        Name of the channel that stands for the gap, and is in `gap_mm`; empty for the gap itself.
    """

    input_mm: NDArray[np.float64]
    gap_mm: NDArray[np.float64]
    midline_mm: NDArray[np.float64] | None
    time_s: NDArray[np.float64] | None
    runs: tuple[slice, ...]
    run_names: tuple[str, ...]
    u_random_mm: NDArray[np.float64] | None = None
    force_n: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()
    slots: tuple[ReferenceSlot, ...] = ()
    path: RecordedPath | None = None
    clock: FoundClock = ONE_CLOCK
    log: DriveHistory | None = None
    stamp_s: float = 0.0
    channels: Mapping[str, Channel] = field(default_factory=lambda: MappingProxyType({}))
    followed: str = ""

    @property
    def path_rows(self) -> NDArray[np.intp]:
        """Rows of the path at which the measured rows lie; shape (n,)."""
        return np.arange(self.input_mm.size) if self.path is None else self.path.rows

    @property
    def shared_clock(self) -> bool:
        """Whether the runs' times follow one another without overlap."""
        if self.time_s is None:
            return False
        spans = sorted((self.time_s[run][0], self.time_s[run][-1]) for run in self.runs)
        return all(before[1] < after[0] for before, after in pairwise(spans))
