"""Share of the calibration's edge bias at each measured edge: all of it at a straight edge, less below a round tip.

The edge bias b moves the whole outline of a finger along its normal by b / 2, including the tip. The measuring point
lies at a fixed distance below the tip, and moves with it. At an edge of slope m (movement into the gap per pixel
towards the root) the measured edge therefore moves by (b / 2) (sqrt(1 + m^2) - m) instead of b / 2.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gap import GapMeasurement


def bias_shares(measured: Sequence[GapMeasurement]) -> NDArray[np.float64]:
    """Share of the edge bias at the left and the right edge of each gap, shape (n, 2).

    Parameters
    ----------
    measured : sequence of GapMeasurement
        Measurements with the slopes of both edges.
    """
    # Slopes refer to the picture's axis across the fingers; the gap is to the right of the left finger, and to the left
    # of the right finger.
    slopes = np.array([(m.left.slope, -m.right.slope) for m in measured], dtype=float).reshape(-1, 2)
    return np.asarray(np.hypot(1.0, slopes) - slopes)
