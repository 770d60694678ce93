"""What was measured on the bench: gap and finger positions against the recorded input."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.reference_slot import ReferenceSlot


@dataclass(frozen=True, slots=True, eq=False)
class Channel:
    """A user-named column: position (mm) or rotation (mrad) of a body or point of the mechanism.

    Parameters
    ----------
    value : ndarray of float, shape (n,)
        Readings; 0 where there is none.
    present : ndarray of bool, shape (n,)
        Whether there is one.
    u : ndarray of float, shape (n,), or None
        Standard uncertainties from row to row, where they are stated.
    """

    value: NDArray[np.float64]
    present: NDArray[np.bool_]
    u: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class RecordedPath:
    """Every row with an input, whether its gap was measured or not; run after run, each sorted by time.

    Parameters
    ----------
    input_mm, time_s : ndarray of float, shape (m,)
        Recorded input and times.
    runs : tuple of slice
        Rows of each run.
    rows : ndarray of int, shape (n,)
        Those that have a gap too.
    """

    input_mm: NDArray[np.float64]
    time_s: NDArray[np.float64]
    runs: tuple[slice, ...]
    rows: NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredTable:
    """Rows of a measured table that have a gap, run after run, each sorted by time.

    Parameters
    ----------
    input_mm, gap_mm : ndarray of float, shape (n,)
        Recorded input and measured gap (`right_mm - left_mm` where both exist).
    midline_mm : ndarray of float, shape (n,), or None
        The middle between the fingers; None where only the gap was measured.
    time_s : ndarray of float, shape (n,), or None
        Times.
    runs : tuple of slice
        Samples of each run.
    run_names : tuple of str
        As in the table.
    u_random_mm : ndarray of float, shape (n,), or None
        The measurement's own random uncertainty of the gap.
    force_n : ndarray of float, shape (n,), or None
        Force at the drive.
    notes : tuple of str
        What the reader mended or left out, a sentence each.
    slots : tuple of ReferenceSlot
        Widths that are known, measured through the same camera.
    path : RecordedPath or None
        The rows with those that have an input and no gap; None where there are none of these, or no times.
    u_clock_s : float
        Standard uncertainty of the offset between the input's clock and the gap's, where that was found from this
        table's own motion; 0 where they share a clock, or nothing is stated.
    channels : mapping of str to Channel
        Columns of one's own, such as `right_finger.angle_mrad`.
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
    u_clock_s: float = 0.0
    channels: Mapping[str, Channel] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def shared_clock(self) -> bool:
        """Whether the runs' times follow one another without overlap."""
        if self.time_s is None:
            return False
        spans = sorted((self.time_s[run][0], self.time_s[run][-1]) for run in self.runs)
        return all(before[1] < after[0] for before, after in pairwise(spans))
