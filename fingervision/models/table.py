"""A simulation table as a model, linearly interpolated between its rows."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from calib.short_repr import ShortRepr
from fingervision.domain.response import Response


@dataclass(frozen=True, eq=False, repr=False)
class TableModel(ShortRepr):
    """A table from Comsol, MATLAB, Ansys or any other source that gives the gap at some inputs.

    Parameters
    ----------
    name : str
        Name of the model in the report.
    input_mm : ndarray of float, shape (n,)
        Inputs, strictly increasing.
    left_mm, right_mm : ndarray of float, shape (n,)
        Positions of the measuring points; symmetric halves of the gap if the table has the gap only.
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
        """Interpolate the table linearly.

        Beyond an end of the table, a straight line fitted to the quarter of the rows at that end is extrapolated.
        """
        lowest, highest = self.input_range_mm
        inside = input_mm.min() >= lowest and input_mm.max() <= highest
        beyond = None if inside else (np.minimum(input_mm - lowest, 0.0), np.maximum(input_mm - highest, 0.0))
        right = self._at(input_mm, "right", self.right_mm, beyond)
        left = -right if self._symmetric else self._at(input_mm, "left", self.left_mm, beyond)
        force = None if self.force_n is None else self._at(input_mm, "force", self.force_n, beyond)
        return Response(left, right, force)

    def _at(
        self,
        input_mm: NDArray[np.float64],
        name: str,
        column: NDArray[np.float64],
        beyond: tuple[NDArray[np.float64], NDArray[np.float64]] | None,
    ) -> NDArray[np.float64]:
        """Interpolate one column of the table; `beyond` is how far the inputs lie below and above the table."""
        found = np.interp(input_mm, self.input_mm, column)
        if beyond is None:
            return found
        low, high = self._end_slopes[name]
        return np.asarray(found + low * beyond[0] + high * beyond[1], dtype=np.float64)

    @cached_property
    def _symmetric(self) -> bool:
        """Whether the fingers are mirror images, which is assumed if the table has only the gap."""
        return bool(np.array_equal(self.left_mm, -self.right_mm))

    @cached_property
    def _end_slopes(self) -> dict[str, tuple[float, float]]:
        """Slope of each column at the lower and upper end of the table; cached, because a diagnosis uses it often."""
        columns = {"left": self.left_mm, "right": self.right_mm, "force": self.force_n}
        rows = max(2, -(-self.input_mm.size // 4))

        def slope(column: NDArray[np.float64], end: slice) -> float:
            return float(np.polyfit(self.input_mm[end], column[end], 1)[0])

        return {
            name: (slope(column, slice(rows)), slope(column, slice(-rows, None)))
            for name, column in columns.items()
            if column is not None
        }
