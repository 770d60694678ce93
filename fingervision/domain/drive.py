"""The recorded input of a run: position of the stage over time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calib.short_repr import ShortRepr


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class DriveHistory(ShortRepr):
    """Input displacement over time.

    Parameters
    ----------
    time_s : ndarray of float, shape (n,)
        Times, strictly increasing within each run.
    input_mm : ndarray of float, shape (n,)
        Displacement of the drive point; positive values open the gripper.
    run : tuple of str, length n, or None
        Name of the run to which each sample belongs.
    force_n : ndarray of float, shape (n,), or None
        Force at the drive; None if not recorded.
    """

    time_s: NDArray[np.float64]
    input_mm: NDArray[np.float64]
    run: tuple[str, ...] | None = None
    force_n: NDArray[np.float64] | None = None
