"""A simulated measured table, with the truth about it."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Booleans = NDArray[np.bool_]
Integers = NDArray[np.int64]
Parameters = dict[str, float]


@dataclass(frozen=True, slots=True)
class Hidden:
    """A simulated effect, with its parameters as defined in effects.md."""

    name: str
    parameters: Parameters


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """True path of the input.

    Parameters
    ----------
    time_s, input_mm : ndarray, shape (m,)
        Points between which the input is linear in continuous motion, or successive positions at rest.
    row : ndarray of int, shape (n,)
        Point of the path at which each row of the table was taken.
    starts : ndarray of int, shape (runs + 1,)
        First point of each run, and m at the end.
    at_rest : bool
        Whether the set-up moves from point to point and rests before each reading.
    commanded : bool
        Whether the input is a command of one run whose corners are among the points, so that it can be delayed exactly.
    """

    time_s: Array
    input_mm: Array
    row: Integers
    starts: Integers
    at_rest: bool
    commanded: bool = False

    def delayed(self, delay_s: float) -> "Path":
        """Path of a command after a dead time: its corners are later, its rows are unchanged."""
        rows_s = self.time_s[self.row]
        time = np.union1d(rows_s, self.time_s + delay_s)
        u = np.interp(time - delay_s, self.time_s, self.input_mm)
        return Path(time, u, np.searchsorted(time, rows_s), np.array([0, time.size]), at_rest=False, commanded=True)

    @classmethod
    def of_rows(cls, time_s: Array, input_mm: Array, run: Integers, *, at_rest: bool) -> "Path":
        """Path whose points are the rows of the table."""
        changes = np.flatnonzero(np.diff(run)) + 1
        starts = np.concatenate([[0], changes, [len(run)]]).astype(np.int64)
        return cls(time_s, input_mm, np.arange(len(run)), starts, at_rest)


@dataclass(frozen=True, slots=True, eq=False)
class Simulation:
    """The simulation table, linearly interpolated between its rows."""

    input_mm: Array
    gap_mm: Array

    def gap(self, input_mm: Array) -> Array:
        """Gap (mm); beyond an end of the table, on a line through the quarter of the rows at that end."""
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
    """A simulated measured table with its simulation table and its truth.

    Parameters
    ----------
    kind : str
        Variant within the row of the benchmark, for information.
    run : ndarray of int, shape (n,)
        Number of the run; the table has no such column if there is only one run.
    time_s, input_mm, gap_mm : ndarray, shape (n,)
        Columns of the table; `time_s` may restart with each run.
    read : ndarray of bool, shape (n,)
        Rows with a gap; all other rows belong to the path only.
    clean_gap_mm : ndarray, shape (n,)
        Gap without reading noise.
    noise_mm : float
        Standard deviation of one reading, including rounding.
    simulation : Simulation
    path : Path
        True path of the input.
    hidden : tuple of Hidden
    input_error_mm : float
        Standard deviation of the recorded input about the true input.
    correlation : float
        AR(1) coefficient of the reading noise over the rows.
    run_gain : float
        Relative standard deviation of the gain between runs.
    outside : str or None
        Description of an effect that no entry of the catalogue can explain.
    wrong_sign : str or None
        Quantity with the wrong sign in the table: `directions`, `input` or `gap`.
    exact_forms : bool
        Whether the parameters are those of the catalogue's definitions, so that stated intervals can be tested.
    may_refuse : bool
        Whether a refusal with a sentence, without a report, is a right answer.
    may_agree : bool
        Whether `agrees` is right in spite of a simulated effect, which could be a large reading noise.
    note : str
        Remark for readers of the folder.
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
