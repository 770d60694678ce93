"""Displacement of an edge that a side wall may have caused, by the width of the flanks alone.

A wall of breadth w whose light is a share s of the step's adds s (1 - s) w^2 to the variance of the flank's spread, and
puts a single fitted step (1 - s) w beyond the finger's own edge. If the wall is narrower than the blur, or the flank
too curved for a mean profile, only this added variance indicates the wall. The outer flanks would distinguish a wall
from motion; if they are out of view, the flanks can be compared only with the tips.
"""

import numpy as np

from fingervision.vision.edge_filters import LEAST_RESOLVED_BLUR_PX, PIXEL_VARIANCE
from fingervision.vision.edges import EdgePoints
from fingervision.vision.mean_profile import FEWEST_ROWS
from fingervision.vision.profile_lines import INNER, ROWS

# The inner flank is wider than the outer one, or than the tip, where its variance is larger by this share.
WIDER = 0.15
# The same for the flanks of both fingers together, whose noise is less: walls of 1 px add as much.
BOTH_WIDER = 0.08
# A wall that nothing shows but the flank's width has at least this share of the step's light: darker ones are resolved.
DARKEST_WALL = 0.2
# An outer flank has at least this share of the inner one's contrast; along the picture's border there is no step.
EDGE_SHARE = 0.3


def wall_limits_px(edges: EdgePoints) -> list[float] | None:
    """Largest displacement of each inner edge by a side wall; None if the flanks are as sharp as the tips.

    The result is also None if the outer flanks are in view, because these distinguish a wall from motion.

    Parameters
    ----------
    edges : EdgePoints
        Steps that were fitted to every line.

    Returns
    -------
    list of float or None
        Of the left and of the right finger (pixels).
    """
    size, is_real = np.abs(edges.contrast), edges.lines.weight > 0
    inner = size[:, :INNER][is_real[:, :INNER]]
    if not inner.size:
        return None
    is_in_view = is_real[:, INNER:ROWS] & (size[:, INNER:ROWS] > EDGE_SHARE * np.median(inner))
    if np.count_nonzero(is_in_view, axis=1).min() >= FEWEST_ROWS:
        return None
    flanks, tips = (np.maximum(edges.blur_px[:, part], LEAST_RESOLVED_BLUR_PX) ** 2 + PIXEL_VARIANCE for part in (0, 1))
    if flanks.sum() < (1.0 + BOTH_WIDER) * tips.sum() and not np.any(flanks > (1.0 + WIDER) * tips):
        return None
    limits: list[float] = np.sqrt((1.0 - DARKEST_WALL) / DARKEST_WALL * np.maximum(flanks - tips, 0.0)).tolist()
    return limits
