"""Nominal stress in a lumped flexure, from bending and tension, with stress concentration of a notch or of fillets."""

from math import atan, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from fingervision.models.elastic_mechanism import LargestStress
from fingervision.models.flexure_span import FlexureSpan
from fingervision.models.hinge_correction import HingeTheory, Notch
from fingervision.models.mechanism import Mechanism

Array = NDArray[np.float64]

# Stress concentration at the rounded corners of a straight neck between deep shoulders.
#
# The values come from plane finite elements (`tests/benchmarks/models_fillet_table.py`), because the usual charts
# (Pilkey, Peterson's Stress Concentration Factors, charts 3.1 and 3.7) end where the shoulders are three times as high
# as the neck. Between the table's nodes, the excess of the stress concentration factors over 1 is interpolated over the
# logarithms of radius / thickness and depth / radius. Beyond the table's ends, the excess of the factors over 1 is
# extrapolated as a power of the radius, because the stress at a sharp corner is unbounded; over the depth, the excess
# is held constant.

RADII = (0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4)
"""Fillet radii in the table, divided by the thickness of the neck."""
DEPTHS = (1.0, 1.5, 3.0, 8.0)
"""Shoulder depths in the table, divided by the fillet radius."""
_FACTORS = (
    ((1.9725, 1.7687), (2.1170, 1.8355), (2.3616, 1.9162), (2.6177, 1.9518)),
    ((1.8162, 1.5461), (1.8996, 1.5644), (2.0103, 1.5778), (2.0912, 1.5752)),
    ((1.5942, 1.3299), (1.6198, 1.3307), (1.6404, 1.3290), (1.6435, 1.3283)),
    ((1.3496, 1.1794), (1.3455, 1.1791), (1.3379, 1.1787), (1.3310, 1.1793)),
    ((1.1692, 1.0941), (1.1671, 1.0942), (1.1654, 1.0943), (1.1641, 1.0938)),
    ((1.0849, 1.0484), (1.0849, 1.0485), (1.0851, 1.0486), (1.0850, 1.0487)),
    ((1.0437, 1.0249), (1.0435, 1.0247), (1.0435, 1.0251), (1.0435, 1.0248)),
)
"""Stress concentration factors (tension, bending), by radius, then by depth, for a neck so long that the stresses at
its two ends do not influence each other."""


def fillet_factors(thickness_mm: float, fillet_mm: float, depth_mm: float) -> tuple[float, float]:
    """Ratio of the largest stress to the nominal stress of the straight neck, in tension and in bending.

    Parameters
    ----------
    thickness_mm, fillet_mm : float
        Thickness of the neck, and radius of its corners; at radius 0 the stress is unbounded, and both factors are
        returned as 1.
    depth_mm : float
        Depth of the shoulder, from the neck's surface.
    """
    if fillet_mm <= 0.0:
        return 1.0, 1.0
    table = RegularGridInterpolator(
        (np.log(RADII), np.log(DEPTHS)), np.log(np.array(_FACTORS) - 1.0), bounds_error=False, fill_value=None
    )
    depth = np.clip(depth_mm / fillet_mm, DEPTHS[0], DEPTHS[-1])
    tension, bending = (1.0 + np.exp(table((np.log(fillet_mm / thickness_mm), np.log(depth))))).ravel().tolist()
    return tension, bending


# At the surface of a notch the stress is a few per cent higher than in a straight bar, by Neuber's factors for a deep
# notch (Kerbspannungslehre, 1937; Pilkey, Peterson's Stress Concentration Factors, charts 2.10 and 2.31). A wide plate
# restrains the hinge, and the resulting stress across the plate lowers the von Mises stress.


def notch_factors(notch: Notch) -> tuple[float, float]:
    """Neuber's stress concentration factors, in tension and bending, of a bar with deep notches on both sides."""
    ratio = 0.5 * notch.curvature_ratio  # half the neck's height over the radius of curvature
    root, angle = sqrt(ratio), atan(sqrt(ratio))
    tension = 2.0 * (ratio + 1.0) * root / ((ratio + 1.0) * angle + root)
    return tension, 4.0 * ratio * root / (3.0 * (root + (ratio - 1.0) * angle))


BESIDE_CORNER = 0.5
"""Distance from a sharp corner, in thicknesses of the thinnest flexure, within which stress is left out: there it is
singular."""
_SAMPLES = 401


def nominal_stress(
    span: FlexureSpan, end_loads: Array, mechanism: Mechanism, theory: HingeTheory, *, width_effect: bool = True,
    stations_mm: Array | None = None,
) -> LargestStress:  # fmt: skip
    """Find the largest stress |N| / (b h) + 6 |M| / (b h^2) over the free length of a flexure.

    It is on the side of the section where tension and bending stresses add, and half a thickness from sharp roots.

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
    stations_mm : ndarray of float, shape (segments + 1,), or None
        Ends of the segments along the axis; None for those of the span.
    """
    plate_mm = mechanism.plate_mm
    stations = span.stations_mm(plate_mm) if stations_mm is None else stations_mm
    at_ends = np.concatenate([-end_loads[:, 1], end_loads[-1:, 2]])
    # The moment of a beam is linear between the ends of its segments, and is extrapolated linearly to its roots.
    low, high = span.free_mm
    beside = 0.0 if span.flexure.is_notch or span.flexure.fillet_mm else BESIDE_CORNER * span.flexure.thickness_mm
    x = np.linspace(low + beside, high - beside, _SAMPLES)
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
        share = span.flexure.zone(plate_mm).stressed if width_effect else 0.0
        across = share * mechanism.material.poisson_ratio
        held = float(np.sqrt(1.0 - across + across**2))
    stress = factors[0] * np.abs(tension) / (plate_mm * height)
    stress += factors[1] * 6.0 * np.abs(moment) / (plate_mm * height**2)
    highest = int(np.argmax(stress))
    side = float(np.sign(tension[highest]) * np.sign(moment[highest])) or 1.0
    place = span.flexure.section_mm(float(x[highest]), -0.5 * side * float(height[highest]))
    return LargestStress(float(held * stress[highest]), place)


def _factors(span: FlexureSpan, plate_mm: float) -> tuple[float, float]:
    """Stress concentration factors in tension and bending: of a notch, or of a neck's fillets; 1 for a leaf."""
    flexure = span.flexure
    if flexure.is_notch:
        return notch_factors(span.notch(plate_mm))
    return fillet_factors(flexure.thickness_mm, flexure.fillet_mm, flexure.depth_mm)
