"""Parameters that may lie beyond their search range, such as the time constant of a warming longer than the table."""

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Point, Problem
from fingervision.domain.effect import Array
from fingervision.domain.parameter import Estimate, Parameter

COVERED = 2.0
"""Standard uncertainties that must fit between a value and the end of its range: the usual expanded uncertainty."""
TAIL = 0.05
"""Probability beyond a one-sided 95 % limit."""


def open_parameters(best: Explanation, problem: Problem) -> list[tuple[str, Parameter]]:
    """Find time constants and widths for which the data give no upper limit within their search range.

    Beyond the upper end of the search range of a time constant, the effect does not change: an exponential at its
    beginning is a straight line, of which only the slope is known. If the posterior were limited to the search range,
    the stated uncertainties of time constant and amplitude would be too small.

    Parameters
    ----------
    best : Explanation
        The best explanation, with its covariance.
    problem : Problem
        Estimation problem with the search ranges.

    Returns
    -------
    list of (str, Parameter)
        Effects with the parameter.
    """
    listed = [entry for entry in problem.parameters(best.names) if entry[1].run is None]
    u = np.sqrt(np.maximum(np.diag(best.covariance), 0.0))
    return [
        (name, parameter)
        for i, (name, parameter) in enumerate(listed)
        if parameter.unit == "s"
        and parameter.neutral is None
        and best.values[name][parameter.name] + COVERED * u[i] >= parameter.upper
    ]


def limited(value: float, parameter: Parameter, drawn: Array, open_ended: Array) -> Estimate:
    """State a parameter by a one-sided limit, on the side opposite to that on which another parameter is unbounded.

    The posterior ends where the search range ends. Beyond the search range, all values of the parameter are farther
    from the limit, so that the quantile within the range is also a limit for the whole posterior.

    Parameters
    ----------
    value : float
        Value with which the prediction was computed.
    parameter : Parameter
        The parameter.
    drawn, open_ended : ndarray of float, shape (k,)
        Posterior draws of this parameter and of the open one (the same, for the open parameter itself).
    """
    if not drawn.size:
        return Estimate(value, None, parameter.unit)
    along = float(np.mean((drawn - drawn.mean()) * (np.log(open_ended) - np.log(open_ended).mean())))
    if along == 0.0:
        return Estimate(value, None, parameter.unit)
    if along > 0.0:
        return Estimate(value, None, parameter.unit, at_least=float(np.quantile(drawn, TAIL)))
    return Estimate(value, None, parameter.unit, at_most=float(np.quantile(drawn, 1.0 - TAIL)))


def draws_of(posterior: tuple[Point, ...], effect: str, parameter: str) -> Array:
    """Posterior draws of one parameter, shape (k,); empty if the parameter was not sampled."""
    return np.array([point[effect][parameter] for point in posterior if parameter in point.get(effect, {})])
