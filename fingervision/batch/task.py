"""Task and outcome of a worker, as sent between processes and computers."""

import errno
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

# Summary of one result for the overview: a table row and a small plot.


Cell = str | float | int | None
CURVE_POINTS = 48
"""Number of points in a small plot, whose width is about 150 px; a page with ten thousand small plots then has a few
MB."""


@dataclass(frozen=True, slots=True)
class Digest:
    """Summary of one result.

    Parameters
    ----------
    cells : mapping of str to text, number or None
        Cells of the result's table row, by column.
    curve : tuple of float or None
        At most `CURVE_POINTS` evenly spaced values for the small plot; None for a missing value.
    caption : str
        Short caption of the plot.
    """

    cells: Mapping[str, Cell]
    curve: tuple[float | None, ...]
    caption: str


def thinned(values: "NDArray[np.float64]") -> tuple[float | None, ...]:
    """Select evenly spaced elements of an array, rounded to five significant digits.

    Parameters
    ----------
    values : ndarray of float, shape (n,)
        Values; NaN for a missing value.
    """
    if values.size > CURVE_POINTS:
        last = values.size - 1
        values = values[[round(place * last / (CURVE_POINTS - 1)) for place in range(CURVE_POINTS)]]
    return tuple(float(f"{value:.5g}") if isfinite(value) else None for value in values.tolist())


NO_ROOM = (errno.ENOSPC, errno.EDQUOT)
"""Errors of the operating system that mean a full disk."""


@dataclass(frozen=True, slots=True)
class Task:
    """One input to be processed by one command.

    Parameters
    ----------
    command : str
        `measure` or `diagnose`.
    input : str
        The input as named by the user.
    arguments : tuple of str
        Options of the command as on the command line, without the input and --out.
    folder : Path
        Folder for the result.
    options_key : str
        Hash of everything besides the input that determines the result: the options, the files that the options name,
        and the version.
    """

    command: str
    input: str
    arguments: tuple[str, ...]
    folder: Path
    options_key: str


@dataclass(frozen=True, slots=True)
class Ended:
    """Outcome of one executed command: exit code and message.

    Parameters
    ----------
    exit_code : int
        Exit code, as on the command line.
    words : str
        Sentence with which the command ended; empty without a problem.
    finished : bool
        Whether the command was completed, so that its files are the result, even if they contain no values.
    disk_full : bool
        Whether the command was stopped because the disk was full.
    """

    exit_code: int
    words: str
    finished: bool
    disk_full: bool = False


Perform = Callable[[str, tuple[str, ...]], Ended]


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result for one input.

    Parameters
    ----------
    input : str
        The input as named by the user.
    folder : Path or None
        Folder of the result; None without a result.
    exit_code : int
        0 for success, 3 for a damaged input, 1 or 2 if the input could not be processed.
    words : str
        Sentence with which the command ended; empty without a problem.
    digest : Digest or None
        Table row and small plot of the result; None without a result.
    seconds : float
        Duration of the processing, including hashing.
    disk_full : bool
        Whether the disk was too full for the result.
    kept : bool
        Whether the result existed already and was kept.
    """

    input: str
    folder: Path | None
    exit_code: int
    words: str
    digest: Digest | None
    seconds: float
    disk_full: bool = False
    kept: bool = False


def failure(task: Task, words: str, seconds: float = 0.0, exit_code: int = 1, *, disk_full: bool = False) -> Outcome:
    """Return the outcome of an input without a result."""
    return Outcome(task.input, None, exit_code, words, None, seconds, disk_full)
