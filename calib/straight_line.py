"""Straight line fitted to points that are uncertain in both coordinates."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from calib.errors import CalibrationError

Floats = NDArray[np.float64]

# Largest number of steps, and relative change at convergence; each step of York's iteration improves the result by
# several digits.
STEPS, SETTLED = 50, 1e-15


@dataclass(frozen=True, slots=True, eq=False)
class StraightLine:
    """A straight line y = intercept + slope x, with its covariance.

    Parameters
    ----------
    slope, intercept : float
        Parameters of the line.
    response : ndarray, shape (2, n)
        Change of (slope, intercept) per change of each y; the change per change of each x is minus the slope times
        this.
    covariance : ndarray, shape (2, 2)
        Covariance of (slope, intercept) from the stated uncertainties.
    residual : ndarray, shape (n,)
        y minus the line.
    residual_sd : float
        Standard deviation of the residuals with n - p degrees of freedom, weighted relative to the mean weight.
    chi_square : float
        Sum of the squared residuals divided by their variances.
    freedom : int
        Degrees of freedom n - p, with p = 2 parameters, or 1 for a line through the origin.
    """

    slope: float
    intercept: float
    response: Floats
    covariance: Floats
    residual: Floats
    residual_sd: float
    chi_square: float
    freedom: int


def line_with_errors(x: Floats, y: Floats, u_x: Floats, u_y: Floats) -> StraightLine:
    """Maximum-likelihood line for points whose x and y are both uncertain, with independent errors.

    Source: York, Evensen, Lopez Martinez & De Basabe Delgado, American Journal of Physics 72 (2004), 367-375. For `u_x`
    = 0 (exact x) the result is the weighted least-squares line.

    Parameters
    ----------
    x, y, u_x, u_y : ndarray, shape (n,)
        Points and their standard uncertainties.

    Raises
    ------
    CalibrationError
        If the points do not define a line.
    """
    if len(x) < 2 or np.ptp(x) <= 0.0:
        raise CalibrationError(
            f"A straight line needs at least two different sizes, but there are {len(np.unique(x))}."
        )
    # Sums relative to the mean avoid a loss of precision.
    x0, y0 = float(x.mean()), float(y.mean())
    slope = float((x - x0) @ (y - y0) / ((x - x0) @ (x - x0)))
    for _ in range(STEPS):
        weight, from_x, from_y, best = _york(x - x0, y - y0, u_x, u_y, slope)
        new = float(np.sum(weight * best * from_y) / np.sum(weight * best * from_x))
        settled = abs(new - slope) <= SETTLED * abs(new)
        slope = new
        if settled:
            break
    weight, from_x, from_y, best = _york(x - x0, y - y0, u_x, u_y, slope)
    share = weight / weight.sum()
    middle_x, middle_y = x0 + float(share @ (x - x0)), y0 + float(share @ (y - y0))
    adjusted = best - float(share @ best)
    by_slope = weight * adjusted / float(weight @ adjusted**2)
    at_x = middle_x + float(share @ best)
    response = np.array([by_slope, share - at_x * by_slope])
    residual = from_y - slope * from_x
    return _line(slope, middle_y - slope * middle_x, response, weight, residual, parameters=2)


def _york(x: Floats, y: Floats, u_x: Floats, u_y: Floats, slope: float) -> tuple[Floats, Floats, Floats, Floats]:
    weight = 1.0 / (u_y**2 + slope**2 * u_x**2)
    from_x, from_y = x - float(weight @ x) / weight.sum(), y - float(weight @ y) / weight.sum()
    best = weight * (from_x * u_y**2 + slope * from_y * u_x**2)
    return weight, from_x, from_y, best


def line_through_origin(x: Floats, y: Floats, u_x: Floats, u_y: Floats) -> StraightLine:
    """Fit a line through the origin, with each point weighted by its uncertainties in both coordinates.

    The arguments are those of `line_with_errors`.
    """
    if not np.any(x):
        raise CalibrationError("A straight line through the origin needs a size other than zero.")
    slope = float(x @ y / (x @ x))
    for _ in range(STEPS):
        weight = 1.0 / (u_y**2 + slope**2 * u_x**2)
        new = float(np.sum(weight * x * y) / np.sum(weight * x * x))
        settled = abs(new - slope) <= SETTLED * abs(new)
        slope = new
        if settled:
            break
    by_slope = weight * x / float(np.sum(weight * x * x))
    response = np.array([by_slope, np.zeros_like(by_slope)])
    return _line(slope, 0.0, response, weight, y - slope * x, parameters=1)


def _line(
    slope: float, intercept: float, response: Floats, weight: Floats, residual: Floats, parameters: int
) -> StraightLine:
    freedom = len(residual) - parameters
    chi_square = float(weight @ residual**2)
    return StraightLine(
        slope=slope,
        intercept=intercept,
        response=response,
        covariance=np.asarray((response / weight) @ response.T),
        residual=residual,
        residual_sd=sqrt(chi_square / weight.mean() / freedom) if freedom > 0 else 0.0,
        chi_square=chi_square,
        freedom=freedom,
    )
