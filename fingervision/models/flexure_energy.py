"""Share of a notch flexure's strain energy that is not in the intended deformation, bending of its neck."""

import numpy as np
from numpy.typing import NDArray

from fingervision.models.flexure_span import FlexureSpan

Array = NDArray[np.float64]


def misused_energy(span: FlexureSpan, end_loads: Array, compliances: Array, plate_mm: float) -> tuple[float, float]:
    """Strain energy of a flexure outside its intended deformation, and the flexure's total strain energy (N mm).

    Parameters
    ----------
    span : FlexureSpan
        The flexure.
    end_loads : ndarray of float, shape (segments, 3)
        Tension in N and moments in N mm at both ends of every segment, as returned by `CorotationalFrame.end_loads`.
    compliances : ndarray of float, shape (segments, 3, 3)
        Compliance of each segment at its end.
    plate_mm : float
        Thickness of the plate.
    """
    stations = span.stations_mm(plate_mm)
    tension, first, second = end_loads.T
    shear = -(first + second) / np.diff(stations)
    loads = np.column_stack([tension, shear, second])
    whole = 0.5 * float(np.einsum("mi,mij,mj->", loads, compliances, loads))
    if not span.flexure.is_notch:  # a leaf bends as a beam in every direction
        return 0.0, whole
    at_neck = float(np.interp(0.0, stations, np.append(-first, second[-1])))
    bent = 0.5 * at_neck**2 * float(np.sum(compliances[:, 2, 2]))
    return max(whole - bent, 0.0), whole
