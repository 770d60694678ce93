"""Abrupt, lasting change of the contrast in a recording: another exposure, gain, picture profile or camera.

The camera is learnt from the first frames, so that what was learnt may not hold after such a change.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Least number of frames before and after a change. Least change of the natural logarithm of the contrast: a change of
# light by a tenth displaces an edge whose tone curve is wrong by a few hundredths of a pixel. Least change in standard
# deviations of the frames on either side: a drift or a flicker, which scatters them as well, stays far below.
FEWEST, LEAST, SIGMAS = 6, 0.1, 8.0


class LightChange(NamedTuple):
    """Number of the first value after a change, and ratio of the contrasts after and before."""

    at: int
    ratio: float


def light_change(contrast: Floats) -> LightChange | None:
    """Change point of the contrast (least squares with one step); None if there is no abrupt, lasting change.

    Parameters
    ----------
    contrast : ndarray of float, shape (n,)
        Contrast at the edges, frame by frame; positive.
    """
    n = contrast.size
    if n < 2 * FEWEST:
        return None
    value = np.log(np.maximum(contrast, 1e-9))
    total = np.cumsum(value)
    before = np.arange(FEWEST, n - FEWEST + 1)
    after = n - before
    apart = total[before - 1] / before - (total[-1] - total[before - 1]) / after
    at = int(before[np.argmax(apart**2 * before * after)])
    parts = value[:at], value[at:]
    middles = [float(np.median(part)) for part in parts]
    scatter = max(1.4826 * float(np.median(np.abs(part - own))) for part, own in zip(parts, middles, strict=True))
    step = middles[1] - middles[0]
    return LightChange(at, float(np.exp(step))) if abs(step) > max(LEAST, SIGMAS * scatter) else None
