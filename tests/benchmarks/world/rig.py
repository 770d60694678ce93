"""A measured table of a made-up rig, with everything that is known about it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Booleans = NDArray[np.bool_]
Integers = NDArray[np.int64]
Parameters = dict[str, float]


@dataclass(frozen=True, slots=True)
class Hidden:
    """One effect that acts, with its parameters in the definitions of effects.md."""

    name: str
    parameters: Parameters


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """The true way of the input.

    Parameters
    ----------
    time_s, input_mm : ndarray, shape (m,)
        Linear between these points where the rig moves continuously; places of rest, one after another, where it is
        read at rest.
    row : ndarray of int, shape (n,)
        Point of the path at which each row of the table was taken.
    starts : ndarray of int, shape (runs + 1,)
        First point of each run, and m.
    at_rest : bool
        Whether the rig moves from point to point and waits there before it is read.
    commanded : bool
        Whether the input is a command, of one run, whose corners are among the points: it is delayed exactly.
    """

    time_s: Array
    input_mm: Array
    row: Integers
    starts: Integers
    at_rest: bool
    commanded: bool = False

    def delayed(self, delay_s: float) -> "Path":
        """A command's path after a dead time: its corners come later, the rows stay."""
        rows_s = self.time_s[self.row]
        time = np.union1d(rows_s, self.time_s + delay_s)
        u = np.interp(time - delay_s, self.time_s, self.input_mm)
        return Path(time, u, np.searchsorted(time, rows_s), np.array([0, time.size]), at_rest=False, commanded=True)

    @classmethod
    def of_rows(cls, time_s: Array, input_mm: Array, run: Integers, *, at_rest: bool) -> "Path":
        """The rows themselves are the points."""
        changes = np.flatnonzero(np.diff(run)) + 1
        starts = np.concatenate([[0], changes, [len(run)]]).astype(np.int64)
        return cls(time_s, input_mm, np.arange(len(run)), starts, at_rest)


@dataclass(frozen=True, slots=True, eq=False)
class Simulation:
    """Rows of the simulation table, linear between them."""

    input_mm: Array
    gap_mm: Array

    def gap(self, input_mm: Array) -> Array:
        """Gap in mm; beyond the table's end on a line through its last quarter of rows."""
        quarter = max(2, len(self.input_mm) // 4)
        inside = np.interp(input_mm, self.input_mm, self.gap_mm)
        for end, rows in ((0, slice(0, quarter)), (-1, slice(-quarter, None))):
            slope = np.polyfit(self.input_mm[rows], self.gap_mm[rows], 1)[0]
            beyond = input_mm - self.input_mm[end]
            outside = beyond < 0 if end == 0 else beyond > 0
            inside = np.where(outside, self.gap_mm[end] + slope * beyond, inside)
        return inside


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """A measured table, its simulation and its truth.

    Parameters
    ----------
    kind : str
        The variant within its row, for a person who asks.
    run : ndarray of int, shape (n,)
        Number of the run; one number alone writes no column.
    time_s, input_mm, gap_mm : ndarray, shape (n,)
        The table's columns; `time_s` may restart with each run.
    read : ndarray of bool, shape (n,)
        Rows with a gap; the others are part of the path.
    clean_gap_mm : ndarray, shape (n,)
        The gap without the noise of reading.
    noise_mm : float
        Standard deviation of one reading, rounding included.
    simulation : Simulation
    path : Path
        True input.
    hidden : tuple of Hidden
    input_error_mm : float
        Standard deviation of the recorded input about the true one.
    correlation : float
        AR(1) coefficient of the reading noise from row to row.
    run_gain : float
        Standard deviation of the gain from run to run, relative.
    outside : str or None
        What no entry of the catalogue can be.
    wrong_sign : str or None
        What is turned round in the table: `directions`, `input` or `gap`.
    exact_forms : bool
        Whether the drawn parameters are those of the catalogue's definitions, so that intervals may be held to them.
    may_refuse : bool
        Whether a sentence and no report is a right answer.
    may_agree : bool
        Whether `agrees` is right although something is there: it could be a large reading noise.
    note : str
        What a reader of the folder should know.
    """

    kind: str
    run: Integers
    time_s: Array
    input_mm: Array
    gap_mm: Array
    read: Booleans
    clean_gap_mm: Array
    noise_mm: float
    simulation: Simulation
    path: Path
    hidden: tuple[Hidden, ...] = ()
    input_error_mm: float = 0.0
    correlation: float = 0.0
    run_gain: float = 0.0
    outside: str | None = None
    wrong_sign: str | None = None
    exact_forms: bool = True
    may_refuse: bool = False
    may_agree: bool = False
    note: str = ""
    names: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", frozenset(h.name for h in self.hidden))

    @property
    def runs(self) -> int:
        """Number of runs."""
        return len(self.path.starts) - 1
