"""The recorded input of a run: where the stage was, when."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class DriveHistory:
    """Input displacement over time.

    Parameters
    ----------
    time_s : ndarray of float, shape (n,)
        Strictly increasing within each run.
    input_mm : ndarray of float, shape (n,)
        Positive opens the gripper.
    run : tuple of str, length n, or None
        Name of the run that each sample belongs to.
    force_n : ndarray of float, shape (n,), or None
        Force at the drive.
    """

    time_s: NDArray[np.float64]
    input_mm: NDArray[np.float64]
    run: tuple[str, ...] | None = None
    force_n: NDArray[np.float64] | None = None
