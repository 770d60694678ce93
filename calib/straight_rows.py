"""Straight line fitted to an edge that was located in rows of pixels, with its uncertainty."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from calib.edge_spread import EdgeRows
from calib.errors import CalibrationError

# Largest lag of the correlation, as a share of the number of rows.
LONGEST_PART = 0.25


def rows_in_one(residual: NDArray[np.float64]) -> float:
    """Return the integrated correlation time of residuals in rows, at least 1.

    The variance of a mean over n rows is the variance of one row times the correlation time, divided by n. The sum over
    lags stops where the sum of two neighbouring correlations becomes negative (Geyer's initial positive sequence,
    Statistical Science 7(4), 1992, 473-483).

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Residuals about a straight line, row by row.
    """
    count = residual.size
    power = float(residual @ residual)
    if count < 8 or power <= 0.0:
        return 1.0
    lags = int(LONGEST_PART * count)
    correlation = np.array([float(residual[: count - lag] @ residual[lag:]) for lag in range(lags + 1)]) / power
    pairs = correlation[: lags + 1 - (lags + 1) % 2].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(pairs <= 0.0)
    total = float(pairs[: negative[0] if negative.size else pairs.size].sum())
    return max(1.0, 2.0 * total - 1.0)


Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Largest distance of a row from the line, in robust standard deviations.
OUTLIER_SIGMAS = 4.0
# Smallest number of rows of a straight edge.
FEWEST_ROWS = 10
# Limits of the bend of a straight edge, in pixels and as a share of its length; an edge that exceeds both is a curve.
# Segments found on a circle are bent by 0.02 to 0.05 of their length; a strong lens bends a straight edge less.
LARGEST_BEND_PX, LARGEST_BEND = 0.35, 0.01
# Largest number of rounds of the search for valid rows, which usually ends after two or three rounds.
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
            raise CalibrationError(
                f"An edge must be straight, but is bent by {bend_px:.1f} px: use an object with straight edges."
            )
        slope, at_px = (float(value) for value in np.polyfit(away, x_px, 1))
        residual = x_px - at_px - slope * away
        # The scatter is at least that expected from the noise of the grey levels, because few rows may agree by chance.
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
        raise CalibrationError(
            "An edge must be sharp over at least ten rows of pixels, but is not: check light and focus."
        )
    # The first line has the median slope between distant rows, so that a quarter of the rows may be wrong.
    half = rows.size // 2
    slope = float(np.median((x_px[half:] - x_px[:-half]) / (rows[half:] - rows[:-half])))
    at_px = float(np.median(x_px - slope * rows))
    kept = np.zeros(rows.size, dtype=bool)
    for _ in range(ROUNDS):
        left = x_px - at_px - slope * rows
        spread = 1.4826 * float(np.median(np.abs(left)))
        belonging = np.abs(left) <= OUTLIER_SIGMAS * max(spread, 1e-9)
        if np.count_nonzero(belonging) < FEWEST_ROWS:
            raise CalibrationError(
                "An edge must be straight over at least ten rows of pixels, but is not: use an "
                "object with straight edges."
            )
        if np.array_equal(belonging, kept):
            break
        kept = belonging
        slope, at_px = (float(value) for value in np.polyfit(rows[kept], x_px[kept], 1))
    return kept
