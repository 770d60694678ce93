"""Stress concentration at the rounded corners of a straight neck between deep shoulders.

The values come from plane finite elements (`tests/benchmarks/models_fillet_table.py`), because the usual charts
(Pilkey, Peterson's Stress Concentration Factors, charts 3.1 and 3.7) end where the shoulders are three times as high as
the neck. Between the table's nodes, the excess of the stress concentration factors over 1 is interpolated over the
logarithms of radius / thickness and depth / radius. Beyond the table's ends, the excess of the factors over 1 is
extrapolated as a power of the radius, because the stress at a sharp corner is unbounded; over the depth, the excess is
held constant.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

Array = NDArray[np.float64]

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
