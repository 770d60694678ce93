"""Uncertainty of a gap below round tips because the edge bias also shifts the tips, unlike at straight edges.

The edge bias b moves the whole outline inwards by b / 2, including the tip. The measuring point lies at a fixed
distance below the tip, and moves with the tip. At an edge of slope m (movement into the gap per pixel towards the root)
the measured edge moves by (b / 2) (sqrt(1 + m^2) - m) instead of b / 2. The gap is corrected by the calibration's
formula for straight edges; the difference is added to its uncertainty.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gap import GapMeasurement


def u_tip_bias_mm(measured: Sequence[GapMeasurement], edge_bias_px: float, px_per_mm: float) -> NDArray[np.float64]:
    """Standard uncertainty (mm) of each gap, because the shift of the tips compensates part of the bias; shape (n,).

    Parameters
    ----------
    measured : sequence of GapMeasurement
        Measurements with the slopes of both edges.
    edge_bias_px : float
        Edge bias b of the calibration.
    px_per_mm : float
        Scale of the calibration.
    """
    # Slopes refer to the picture's axis across the fingers; the gap is to the right of the left finger, and to the left
    # of the right finger.
    slopes = np.array([(m.left.slope, -m.right.slope) for m in measured], dtype=float)
    share = (np.sqrt(1.0 + slopes**2) - slopes).mean(axis=1)
    return np.asarray(np.abs((1.0 - share) * edge_bias_px) / px_per_mm)
