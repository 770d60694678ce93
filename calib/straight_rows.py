"""Straight line fitted to an edge that was located in rows of pixels, with its uncertainty."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from calib.correlated_rows import rows_in_one
from calib.edge_spread import EdgeRows
from calib.errors import CalibrationError

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# A row farther off the line than so many robust standard deviations does not belong to it.
OUTLIER_SIGMAS = 4.0
# The fewest rows that make a straight edge.
FEWEST_ROWS = 10
# An edge bent by more than this (pixels), and by more than this part of its length, is a curve: a drop, a disc. What a
# finder of straight segments takes for one on a circle is bent by 0.02 to 0.05 of its length; a strong lens bends less.
LARGEST_BEND_PX, LARGEST_BEND = 0.35, 0.01
# The search for the rows that belong settles after two or three rounds.
ROUNDS = 10


@dataclass(frozen=True, slots=True, eq=False)
class StraightRows:
    """A straight edge, given by x = at_px + slope * (row - middle_row).

    Parameters
    ----------
    rows : ndarray of int, shape (n,)
        Rows that belong to the edge.
    residual_px : ndarray, shape (n,)
        Residuals about the line, along the row.
    middle_row : float
        Mean of `rows`.
    at_px, slope : float
        Parameters of the line.
    u_at_px, u_slope : float
        Standard uncertainties from the scatter of the rows, correlation between rows included.
    """

    rows: Ints
    residual_px: Floats
    middle_row: float
    at_px: float
    slope: float
    u_at_px: float
    u_slope: float

    @property
    def points_px(self) -> Floats:
        """Measured points (x, y), shape (n, 2)."""
        x = self.at_px + self.slope * (self.rows - self.middle_row) + self.residual_px
        return np.stack([x, self.rows.astype(np.float64)], axis=1)

    @classmethod
    def through(cls, edge: EdgeRows) -> "StraightRows":
        """Fit the line, excluding rows that do not belong to the edge.

        Raises
        ------
        CalibrationError
            If the edge is not straight, or too few rows belong to it.
        """
        kept = _belonging(edge.rows, edge.x_px)
        rows, x_px = edge.rows[kept], edge.x_px[kept]
        away = rows - rows.mean()
        bend_px = abs(float(np.polyfit(away, x_px, 2)[0])) * float(np.ptp(away)) ** 2 / 4.0
        if bend_px > max(LARGEST_BEND_PX, LARGEST_BEND * float(np.ptp(away))):
            raise CalibrationError(f"An edge must be straight, but is bent by {bend_px:.1f} px.")
        slope, at_px = (float(value) for value in np.polyfit(away, x_px, 1))
        residual = x_px - at_px - slope * away
        # The scatter that is seen, or the noise of the grey levels where the few rows happen to agree better.
        seen = float(np.sqrt(residual @ residual / (rows.size - 2)))
        scatter = max(seen, float(np.sqrt(np.mean(edge.u_x_px[kept] ** 2))))
        alike = rows_in_one(residual)
        return cls(
            rows=rows,
            residual_px=residual,
            middle_row=float(rows.mean()),
            at_px=at_px,
            slope=slope,
            u_at_px=scatter * sqrt(alike / rows.size),
            u_slope=scatter * sqrt(alike / float(away @ away)),
        )


def _belonging(rows: Ints, x_px: Floats) -> NDArray[np.bool_]:
    if rows.size < FEWEST_ROWS:
        raise CalibrationError("An edge must be sharp over at least ten rows, but is not.")
    # A first line that a quarter of the rows may be wrong about: the median of slopes between distant rows.
    half = rows.size // 2
    slope = float(np.median((x_px[half:] - x_px[:-half]) / (rows[half:] - rows[:-half])))
    at_px = float(np.median(x_px - slope * rows))
    kept = np.zeros(rows.size, dtype=bool)
    for _ in range(ROUNDS):
        left = x_px - at_px - slope * rows
        spread = 1.4826 * float(np.median(np.abs(left)))
        belonging = np.abs(left) <= OUTLIER_SIGMAS * max(spread, 1e-9)
        if np.count_nonzero(belonging) < FEWEST_ROWS:
            raise CalibrationError("An edge must be straight over at least ten rows, but is not.")
        if np.array_equal(belonging, kept):
            break
        kept = belonging
        slope, at_px = (float(value) for value in np.polyfit(rows[kept], x_px[kept], 1))
    return kept
