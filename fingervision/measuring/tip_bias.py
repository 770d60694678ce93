"""Effect of the edge bias on a gap below round tips, where it is smaller than at the calibration's straight edges.

Light that blooms over an outline moves the whole outline inwards by half of the edge bias b, including the tip. The
measuring point is counted from the tip, and moves down with it. At an edge of slope m (movement into the gap per pixel
towards the root) it moves by (b / 2) (sqrt(1 + m^2) - m) instead of b / 2. The gap follows the calibration's formula;
this difference is added to its uncertainty.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gap import GapMeasurement


def u_tip_bias_mm(measured: Sequence[GapMeasurement], edge_bias_px: float, px_per_mm: float) -> NDArray[np.float64]:
    """Standard uncertainty of each gap from the part of the edge bias that its tips compensate, shape (n,) (mm).

    Parameters
    ----------
    measured : sequence of GapMeasurement
        With the slopes of both edges.
    edge_bias_px : float
        b of the calibration.
    px_per_mm : float
        Its scale.
    """
    # Slopes are given across the picture: the left finger grows into the gap to the right, the right one to the left.
    slopes = np.array([(m.left.slope, -m.right.slope) for m in measured], dtype=float)
    share = (np.sqrt(1.0 + slopes**2) - slopes).mean(axis=1)
    return np.asarray(np.abs((1.0 - share) * edge_bias_px) / px_per_mm)
