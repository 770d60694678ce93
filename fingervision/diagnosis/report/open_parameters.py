"""Parameters that may lie beyond the range in which they were sought: a warming slower than the table is long."""

import numpy as np

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.domain.parameter import Parameter

COVERED = 2.0
"""Standard uncertainties that must fit between a value and the end of its range: the usual expanded uncertainty."""


def open_parameters(best: Explanation, problem: Problem) -> list[tuple[str, Parameter]]:
    """Find time constants and widths that the data do not keep away from the upper end of their search range.

    Beyond that end the effect does the same: an exponential that is far from over is a straight line, whose slope alone
    is known. The posterior within the range would state both time constant and amplitude too surely.

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
