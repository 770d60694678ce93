"""Positions of the two measuring points: the response of a gripper or a measuring chain to an input history."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calib.short_repr import ShortRepr


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Response(ShortRepr):
    """Positions of the measuring points of both fingers over an input history, and the drive force if known.

    Parameters
    ----------
    left_mm, right_mm : ndarray of float, shape (n,)
        Positions across the fingers, with the origin at the image centre; `left` is the smaller coordinate.
    force_n : ndarray of float, shape (n,), or None
        Force at the drive; None if unknown.
    """

    left_mm: NDArray[np.float64]
    right_mm: NDArray[np.float64]
    force_n: NDArray[np.float64] | None = None

    @property
    def gap_mm(self) -> NDArray[np.float64]:
        """Distance between the points across the fingers, shape (n,)."""
        return self.right_mm - self.left_mm

    @property
    def midline_mm(self) -> NDArray[np.float64]:
        """Mean of the two measuring points' positions, shape (n,)."""
        return 0.5 * (self.left_mm + self.right_mm)

    def with_gap(self, gap_mm: NDArray[np.float64]) -> "Response":
        """Return the response with another gap and the same midline: the fingers move by equal and opposite amounts."""
        half_mm = 0.5 * (gap_mm - self.gap_mm)
        return Response(self.left_mm - half_mm, self.right_mm + half_mm, self.force_n)

    def plus(self, more: "Response") -> "Response":
        """Add the displacements of `more` to the measuring points, and its force if both responses have forces."""
        both = self.force_n is not None and more.force_n is not None
        force_n = self.force_n + more.force_n if both else self.force_n  # type: ignore[operator]
        return Response(self.left_mm + more.left_mm, self.right_mm + more.right_mm, force_n)

    def shifted(self, by_mm: NDArray[np.float64] | float) -> "Response":
        """Return the response with both points moved by `by_mm`; positive values move them to the right."""
        return Response(self.left_mm + by_mm, self.right_mm + by_mm, self.force_n)

    def at(self, rows: NDArray[np.intp]) -> "Response":
        """Return the response at selected samples; `rows` has shape (k,)."""
        force_n = None if self.force_n is None else self.force_n[rows]
        return Response(self.left_mm[rows], self.right_mm[rows], force_n)
