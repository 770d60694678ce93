"""Parameters that may lie beyond the range in which they were sought: a warming slower than the table is long."""

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.domain.parameter import Parameter

COVERED = 2.0
"""Standard uncertainties that must fit between a value and the end of its range: the usual expanded uncertainty."""


def open_parameters(best: Explanation, problem: Problem) -> list[tuple[str, Parameter]]:
    """Find time constants and widths that the data do not bound above within their search range.

    Beyond the upper end of the range the effect does not change: an exponential at its beginning is a straight line, of
    which only the slope is known. The posterior within the range would state time constant and amplitude with too small
    an uncertainty.

    Parameters
    ----------
    best : Explanation
        The answer, with its covariance.
    problem : Problem
        Where the ranges come from.

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
