"""Nominal stress in a lumped flexure, from bending and tension, with stress concentration of a notch or of fillets."""

import numpy as np
from numpy.typing import NDArray

from fingervision.models.fillet_stress import fillet_factors
from fingervision.models.flexure_span import FlexureSpan
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.hinge_stress import notch_factors
from fingervision.models.mechanism import Mechanism

Array = NDArray[np.float64]

_SAMPLES = 401


def nominal_stress_mpa(
    span: FlexureSpan, end_loads: Array, mechanism: Mechanism, theory: HingeTheory, *, width_effect: bool = True
) -> float:
    """Find the largest stress |N| / (b h) + 6 |M| / (b h^2) over the free length of a flexure.

    Parameters
    ----------
    span : FlexureSpan
        The flexure.
    end_loads : ndarray of float, shape (segments, 3)
        Tension in N and moments in N mm at both ends of every segment, as returned by `CorotationalFrame.end_loads`.
    mechanism : Mechanism
        Mechanism that gives the plate thickness and the material.
    theory : HingeTheory
        Beam theory gives the nominal stress of a straight bar; the corrected theory includes Neuber's factors, or those
        of the fillets, and the constraint by the plate's width.
    width_effect : bool
        Whether the constraint of the flexure by the plate's width is included.
    """
    plate_mm = mechanism.plate_mm
    stations = span.stations_mm(plate_mm)
    at_ends = np.concatenate([-end_loads[:, 1], end_loads[-1:, 2]])
    # The moment of a beam is linear between the ends of its segments, and is extrapolated linearly to its roots.
    x = np.linspace(*span.free_mm, _SAMPLES)
    moment = np.interp(x, stations, at_ends)
    for beyond, (i, j) in ((x < stations[0], (0, 1)), (x > stations[-1], (-2, -1))):
        slope = (at_ends[j] - at_ends[i]) / (stations[j] - stations[i])
        moment[beyond] = at_ends[i] + slope * (x[beyond] - stations[i])
    tension = np.interp(x, 0.5 * (stations[1:] + stations[:-1]), end_loads[:, 0])
    height = span.flexure.height_mm(x)
    factors = (1.0, 1.0)
    held = 1.0
    if theory is HingeTheory.CORRECTED:
        factors = _factors(span, plate_mm)
        share = span.flexure.width_share(plate_mm) if width_effect else 0.0
        across = share * mechanism.material.poisson_ratio
        held = float(np.sqrt(1.0 - across + across**2))
    stress = factors[0] * np.abs(tension) / (plate_mm * height)
    stress += factors[1] * 6.0 * np.abs(moment) / (plate_mm * height**2)
    return float(held * stress.max())


def _factors(span: FlexureSpan, plate_mm: float) -> tuple[float, float]:
    """Stress concentration factors in tension and bending: of a notch, or of a neck's fillets; 1 for a leaf."""
    flexure = span.flexure
    if flexure.is_notch:
        return notch_factors(span.notch(plate_mm))
    return fillet_factors(flexure.thickness_mm, flexure.fillet_mm, flexure.depth_mm)
