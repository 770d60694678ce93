"""Positions of the two measuring points: the response of a gripper or a measuring chain to an input history."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """Positions of both fingers' measuring points over a history, and the force at the drive where it is known.

    Parameters
    ----------
    left_mm, right_mm : ndarray of float, shape (n,)
        Across the fingers, origin at the image centre; `left` is the smaller.
    force_n : ndarray of float, shape (n,), or None
        Force at the drive.
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
        """Return the response with another gap and the same midline: both fingers move equally and oppositely."""
        half_mm = 0.5 * (gap_mm - self.gap_mm)
        return Response(self.left_mm - half_mm, self.right_mm + half_mm, self.force_n)

    def plus(self, more: "Response") -> "Response":
        """Add the displacements of `more` to the measuring points, and its force where both have one."""
        both = self.force_n is not None and more.force_n is not None
        force_n = self.force_n + more.force_n if both else self.force_n  # type: ignore[operator]
        return Response(self.left_mm + more.left_mm, self.right_mm + more.right_mm, force_n)

    def shifted(self, by_mm: NDArray[np.float64] | float) -> "Response":
        """Move both points by `by_mm`, to the right where it is positive."""
        return Response(self.left_mm + by_mm, self.right_mm + by_mm, self.force_n)

    def at(self, rows: NDArray[np.intp]) -> "Response":
        """Select samples; `rows` of shape (k,)."""
        force_n = None if self.force_n is None else self.force_n[rows]
        return Response(self.left_mm[rows], self.right_mm[rows], force_n)
