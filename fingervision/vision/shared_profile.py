"""What all rows of a flank share of their residuals: how far a codec may have displaced the flank as a whole.

Where a codec treats all rows alike, the mean of their residuals over the rows does not average out. Along the window
across the edge the mean residual has one part that the fit takes for a displacement and others that it cannot take up;
these are seen, and the first is as large as they are.
"""

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.edge_filters import blurred_step, edge_filters
from fingervision.vision.edges import EdgePoints
from fingervision.vision.grey import GreyImage
from fingervision.vision.line_levels import line_levels
from fingervision.vision.profile_lines import INNER, ROWS

Floats = NDArray[np.float64]

FLANKS = (slice(0, INNER), slice(INNER, ROWS))
# A flank has so many rows, which lean by less than this (change of the edge from row to row).
FEWEST_ROWS, STEEPEST = 8, 0.3
# Level, contrast, position and blur are taken up by the fit.
FITTED = 4


def shared_shift_px(upright: GreyImage, edges: EdgePoints, light: Floats) -> float:
    """Standard uncertainty of one flank's place for what its rows share beyond chance (pixels); 0 where they do not.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels, seen with the tips up.
    edges : EdgePoints
        Fitted to them.
    light : ndarray of float, shape (levels,)
        Light of every grey level.
    """
    levels = line_levels(upright, edges.lines, light, edges.reach_px)
    offset = (edges.position - edges.lines.coarse) * edges.lines.outward
    filters = edge_filters(edges.reach_px)
    borders = np.arange(-edges.reach_px - 0.5, edges.reach_px + 1.0)
    found = []
    for k in range(2):
        sigma = float(edges.blur_px[k, 0])
        gain = float(filters.shift_gain[filters.middle(sigma)])
        for flank in FLANKS:
            is_used = (edges.lines.weight[k, flank] > 0.0) & (np.abs(edges.lines.slope[k, flank]) < STEEPEST)
            rows = int(np.count_nonzero(is_used))
            if rows < FEWEST_ROWS:
                continue
            own, contrast = levels[k, flank][is_used], edges.contrast[k, flank][is_used]
            step, _, _ = blurred_step(borders - offset[k, flank][is_used][:, None], np.full((rows, 1), sigma))
            residual = own - own.mean(axis=1, keepdims=True)
            residual -= contrast[:, None] * (step - step.mean(axis=1, keepdims=True))
            # Of rows that err each by itself the mean has this share of their variance.
            chance = float(np.mean(residual**2)) / rows
            excess = (float(np.mean(residual.mean(axis=0) ** 2)) - chance) * own.shape[1] / (own.shape[1] - FITTED)
            found.append(excess / (float(np.median(contrast)) * gain) ** 2)
    return float(np.sqrt(max(np.mean(found), 0.0))) if found else 0.0
