"""A simulation table as a model, linear between its rows."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.response import Response


@dataclass(frozen=True, slots=True, eq=False)
class TableModel:
    """A table from Comsol, MATLAB, Ansys or any other source that gives the gap at some inputs.

    Parameters
    ----------
    name : str
        How the report calls it.
    input_mm : ndarray of float, shape (n,)
        Strictly increasing.
    left_mm, right_mm : ndarray of float, shape (n,)
        The measuring points; symmetric halves of the gap where the table knows no more.
    force_n : ndarray of float, shape (n,), or None
        Force at the drive.
    """

    name: str
    input_mm: NDArray[np.float64]
    left_mm: NDArray[np.float64]
    right_mm: NDArray[np.float64]
    force_n: NDArray[np.float64] | None = None

    @property
    def input_range_mm(self) -> tuple[float, float]:
        """Smallest and largest input of the table."""
        return float(self.input_mm[0]), float(self.input_mm[-1])

    def respond(self, input_mm: NDArray[np.float64]) -> Response:
        """Interpolate linearly.

        Beyond an end, extrapolate the straight line through the last quarter of the rows there.
        """
        force = None if self.force_n is None else self._interpolate(input_mm, self.force_n)
        return Response(self._interpolate(input_mm, self.left_mm), self._interpolate(input_mm, self.right_mm), force)

    def _interpolate(self, input_mm: NDArray[np.float64], column: NDArray[np.float64]) -> NDArray[np.float64]:
        inside = np.interp(input_mm, self.input_mm, column)
        lowest, highest = self.input_range_mm
        if input_mm.min() >= lowest and input_mm.max() <= highest:
            return inside
        rows = max(2, -(-len(column) // 4))
        low = np.polyfit(self.input_mm[:rows], column[:rows], 1)[0]
        high = np.polyfit(self.input_mm[-rows:], column[-rows:], 1)[0]
        below, above = np.minimum(input_mm - lowest, 0.0), np.maximum(input_mm - highest, 0.0)
        return np.asarray(inside + low * below + high * above, dtype=np.float64)
