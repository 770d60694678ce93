"""Equilibrium in the deformed shape: the gap follows an arc, and the force grows faster than the input."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from fingervision.domain.effect import History, Values
from fingervision.domain.errors import FingervisionError
from fingervision.domain.model import PhysicalLaw
from fingervision.domain.response import Response
from fingervision.models.small_answer import DrawnAnswer

Array = NDArray[np.float64]

EFFECT = "large_deflection"
_BELOW, _ABOVE = 1, 4
"""Number of equilibria computed below and above zero input: for the published sample a spline through them is accurate
to 0.02 um."""
_ROWS = 400
_AS_DRAWN = 0.05
"""Relative uncertainty of the predicted arc parameters: the accuracy to which links are made."""


def law(drawn: DrawnAnswer) -> PhysicalLaw | None:
    """Use the drawing's equilibria; the parameters of the effect describe the best-fitting circular arc.

    Multiplying the radius `reach_mm` by n multiplies the whole curve of opening over input by n, as for a body n times
    as large. Changing the parameter `cross` by an amount c adds c times the height of the arc. The parameters of the
    best-fitting arc therefore reproduce the equilibria of the body in the drawing, and an infinite `reach_mm` gives a
    straight line. For the published gripper the best fit is `reach_mm` = 126 mm and `cross` = 0.12, and the arc alone
    deviates from the equilibria by less than 0.3 µm.
    """
    try:
        opening_mm, bent_mm, force_ratio = _equilibria(drawn)
    except FingervisionError:
        return None

    def off(arc: Array) -> Array:
        return np.asarray(_arc(opening_mm, arc[0], arc[1]) - bent_mm)

    largest = float(np.abs(opening_mm).max())
    start, bounds = [10.0 * largest, 0.0], ([0.5 * largest, -2.0], [1000.0 * largest, 2.0])
    reach, cross = np.asarray(least_squares(off, start, x_scale=[largest, 0.1], bounds=bounds).x).tolist()
    departure_mm = bent_mm - _arc(opening_mm, reach, cross)

    def act(response: Response, history: History, values: Values) -> Response:
        if values["reach_mm"] == 0.0:  # no arc given
            return response
        scale = values["reach_mm"] / reach
        free_mm = response.gap_mm - history.rest_gap_mm
        curve_mm = _arc(free_mm, values["reach_mm"], values["cross"])
        curve_mm = curve_mm + scale * np.interp(free_mm / scale, opening_mm, departure_mm)
        moved = response.with_gap(history.rest_gap_mm + curve_mm)
        if moved.force_n is None:
            return moved
        return replace(moved, force_n=np.interp(free_mm / scale, opening_mm, force_ratio) * moved.force_n)

    return PhysicalLaw(
        act,
        foretold={
            "reach_mm": ((1.0 - _AS_DRAWN) * reach, (1.0 + _AS_DRAWN) * reach),
            "cross": (cross - _AS_DRAWN * abs(cross), cross + _AS_DRAWN * abs(cross)),
        },
    )


def _arc(opening_mm: Array, reach_mm: float, cross: float) -> Array:
    angle = opening_mm / reach_mm
    return np.asarray(reach_mm * np.sin(angle) + cross * reach_mm * (1.0 - np.cos(angle)))


def _equilibria(drawn: DrawnAnswer) -> tuple[Array, Array, Array]:
    """Openings without and with large rotation, and the ratio of the forces (with over without), over the inputs."""
    model, (lowest_mm, highest_mm) = drawn.model, drawn.input_range_mm
    elastic, paths = model.elastic, [(0.0, model.rest_gap_mm, 0.0)]
    for end_mm, count in ((lowest_mm, _BELOW), (highest_mm, _ABOVE)):
        for value in np.linspace(0.0, end_mm, count + 1)[1:].tolist():
            found = elastic.driven.equilibrium(value, large_rotation=True)
            paths.append((value, elastic.pairs_mm(found.displacement, large=True)["gap"], found.force_n))
    at, gap, force = np.array(sorted(paths)).T
    inputs = np.linspace(lowest_mm, highest_mm, _ROWS)
    opening_mm = model.gap_per_input * inputs
    bent_mm = CubicSpline(at, gap)(inputs) - model.rest_gap_mm
    stiffness = model.force_per_input_n_mm
    moving = at != 0.0
    # The ratio is smooth through zero input, where both forces are zero and cannot be divided.
    ratio = CubicSpline(at[moving], force[moving] / (stiffness * at[moving]))(inputs)
    return opening_mm, np.asarray(bent_mm), np.asarray(ratio)
