"""Displacement of an edge that a side wall may have caused, estimated only from the blur of the flanks.

A wall of breadth w whose light is a share s of the step's adds s (1 - s) w^2 to the variance of the flank's spread, and
puts a single fitted step (1 - s) w beyond the finger's own edge. If the wall is narrower than the blur, or the flank
too curved for a mean profile, only the variance that the wall adds indicates the wall. The outer flanks would
distinguish a wall from motion; if they are out of view, the flanks can be compared only with the tips.
"""

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.blur_uncertainty import Displacement, u_squared_blur
from fingervision.vision.edge_filters import LEAST_RESOLVED_BLUR_PX, PIXEL_VARIANCE
from fingervision.vision.edges import EdgePoints
from fingervision.vision.mean_profile import FEWEST_ROWS
from fingervision.vision.median import median
from fingervision.vision.profile_lines import INNER, ROWS

Floats = NDArray[np.float64]

# Relative excess of the inner flank's squared blur over that of the outer flank, or of the tip, above which the inner
# flank is wider.
WIDER = 0.15
# The same excess for the flanks of both fingers together, which have less noise; walls of 1 px cause such an excess.
BOTH_WIDER = 0.08
# Least excess in standard uncertainties, which 3 of 1000 normal differences exceed; without a wall, a codec with usual
# quantiser steps occasionally widens a flank by 20 %.
SURE = 3.0
# Least light of a wall, as a share of the step, that is only visible by the flank's width; a darker wall is resolved.
DARKEST_WALL = 0.2
# Least contrast of an outer flank as a share of the inner flank's; the picture's border has no step.
EDGE_SHARE = 0.3


def wall_limits_px(edges: EdgePoints, displaced_px: Displacement) -> list[float] | None:
    """Largest displacement of each inner edge by a side wall; None where the flanks are as sharp as the tips.

    The result is also None if the outer flanks are in view, because these distinguish a wall from motion.

    Parameters
    ----------
    edges : EdgePoints
        Steps that were fitted to every line.
    displaced_px : callable
        Standard uncertainty of both flanks' positions by a codec (pixels), from the edges.

    Returns
    -------
    list of float or None
        Largest displacement for the left and for the right finger (pixels).
    """
    if are_outer_flanks_in_view(edges) or not (edges.lines.weight[:, :INNER] > 0).any():
        return None
    flanks, tips = squared_blurs(edges)
    more = flanks - tips
    is_both = more.sum() > BOTH_WIDER * tips.sum()
    is_one = more > WIDER * tips
    if not (is_both or is_one.any()):
        return None
    u_more = _u_excess(edges, displaced_px)
    if not (is_both and more.sum() > SURE * float(np.hypot(*u_more))) and not np.any(is_one & (more > SURE * u_more)):
        return None
    limits: list[float] = np.sqrt((1.0 - DARKEST_WALL) / DARKEST_WALL * np.maximum(more, 0.0)).tolist()
    return limits


def are_broader_together(edges: EdgePoints, displaced_px: Displacement) -> bool:
    """Whether the flanks of both fingers together are wider than the tips by more than noise and codec explain."""
    flanks, tips = squared_blurs(edges)
    more = float((flanks - tips).sum())
    return more > BOTH_WIDER * tips.sum() and more > SURE * float(np.hypot(*_u_excess(edges, displaced_px)))


def are_outer_flanks_in_view(edges: EdgePoints) -> bool:
    """Whether both fingers' outer flanks can be compared with the inner ones; the picture's border is not a flank."""
    size, is_real = np.abs(edges.contrast), edges.lines.weight > 0
    inner = size[:, :INNER][is_real[:, :INNER]]
    if not inner.size:
        return False
    is_in_view = is_real[:, INNER:ROWS] & (size[:, INNER:ROWS] > EDGE_SHARE * median(inner))
    return min(int(np.count_nonzero(rows)) for rows in is_in_view) >= FEWEST_ROWS


def squared_blurs(edges: EdgePoints) -> tuple[Floats, Floats]:
    """Squared spread of inner flanks and tips of both fingers, pixel width included (px^2)."""
    flanks, tips = (np.maximum(edges.blur_px[:, part], LEAST_RESOLVED_BLUR_PX) ** 2 + PIXEL_VARIANCE for part in (0, 1))
    return flanks, tips


def is_surely_broader(edges: EdgePoints, displaced_px: Displacement) -> NDArray[np.bool_]:
    """Whether each finger's inner flank is broader than its tip by more than noise and codec explain, shape (2,)."""
    flanks, tips = squared_blurs(edges)
    return np.asarray(flanks - tips > SURE * _u_excess(edges, displaced_px))


def _u_excess(edges: EdgePoints, displaced_px: Displacement) -> Floats:
    """Standard uncertainty of the excess of each flank's squared spread over its tip's, shape (2,) (pixels squared)."""
    return np.asarray(np.hypot(*u_squared_blur(edges, displaced_px(edges)).T))
