"""Side walls of thick parts that only the width of the flanks indicates: how far they may have moved the edges.

A wall of breadth w whose light is a share s of the step's adds s (1 - s) w^2 to the variance of the flank's spread, and
puts a single fitted step (1 - s) w beyond the finger's own edge. The outer flanks distinguish a wall from motion; if
they are out of view, the flanks can be compared only with the tips.

For a step of contrast A blurred by sigma, the derivative of a line's light with respect to position has the squared
norm A^2 / (2 sqrt(pi) sigma), and the derivative with respect to sigma has half this squared norm. Noise of standard
deviation n on N lines therefore causes the standard uncertainty n / A sqrt(4 sqrt(pi) sigma / N) of sigma (Cramer-Rao
bound; Kay, Estimation Theory, 1993, section 3.9). If a codec may change the light by a certain squared error, it may
displace the edge by d, or widen the edge by sqrt(2) d with the same squared error.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.edge_filters import LEAST_RESOLVED_BLUR_PX, PIXEL_VARIANCE
from fingervision.vision.edges import EdgePoints
from fingervision.vision.mean_profile import FEWEST_ROWS
from fingervision.vision.median import median
from fingervision.vision.profile_lines import INNER, IS_INNER, IS_ROW, ROWS

Floats = NDArray[np.float64]
# Function that returns the standard uncertainty, due to a codec, of the positions of the left and of the right finger's
# edges (pixels).
Displacement = Callable[[EdgePoints], tuple[float, float]]


def u_squared_blur(edges: EdgePoints, displaced_px: tuple[float, float]) -> Floats:
    """Standard uncertainty of the squared spread of each finger's flanks and tip, shape (2, 2) (pixels squared).

    Parameters
    ----------
    edges : EdgePoints
        Steps that were fitted to every line.
    displaced_px : (float, float)
        Standard uncertainty of the position of the left and of the right finger's edges by a codec (pixels); 0 for a
        picture that was not compressed.

    Returns
    -------
    ndarray of float, shape (2, 2)
        Indices: left or right finger; flanks or tip.
    """
    spread = np.sqrt(edges.blur_px**2 + PIXEL_VARIANCE)
    by_noise = np.zeros((2, 2))
    for part, is_part in enumerate((IS_INNER, ~IS_ROW)):
        is_seen = edges.lines.weight[:, is_part] > 0
        contrast = np.abs(edges.contrast[:, is_part])
        # Lines of different contrast are weighted by the square of their contrast.
        power = np.maximum(np.where(is_seen, contrast**2, 0.0).sum(axis=1), 1e-9)
        by_noise[:, part] = edges.noise * np.sqrt(4.0 * np.sqrt(np.pi) * edges.shared_lines * spread[:, part] / power)
    u_blur = np.hypot(by_noise, np.sqrt(2.0) * np.array(displaced_px)[:, None])
    return np.asarray(2.0 * spread * u_blur)


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
