"""Move edges to the finger's own edge according to a model of the profile, or increase their uncertainty."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.edge_filters import PIXEL_VARIANCE
from fingervision.vision.edge_profile import EdgeMark
from fingervision.vision.edges import EdgePoints
from fingervision.vision.profile_lines import IS_INNER, IS_ROW
from fingervision.vision.profile_models import ProfileFit

Floats = NDArray[np.float64]

# Limits of the share of the contrast due to a structure beside an edge: a smaller share is texture, a larger share
# means that the edge is not that of a finger.
SHARES = (0.05, 0.85)


def are_of_size(fits: list[ProfileFit], sign: float) -> bool:
    """Whether the fitted structure beside a dark finger's edge has a plausible sign and size."""
    return all(SHARES[0] < sign * fit.share < SHARES[1] for fit in fits)


def moved_by_wall(edges: EdgePoints) -> Floats:
    """Displacement along every line of pixels if a side wall displaces the inner edge horizontally by one pixel."""
    towards_gap = edges.lines.outward[:, :1] * edges.lines.slope
    return np.where(IS_INNER, 1.0, np.where(IS_ROW, 0.0, np.maximum(towards_gap, 0.0)))


def beyond_wall(fit: ProfileFit) -> ProfileFit:
    """Move the position of a fitted wall from its near to its far edge."""
    return fit._replace(position=fit.position + fit.breadth)


def moved_edges(
    edges: EdgePoints, fits: list[ProfileFit], u_relative: float, by_pixel: Floats, beside: str
) -> EdgePoints:
    """Move the edges to the positions given by a model, and state the remaining uncertainty."""
    moves = np.array([fit.position for fit in fits])[:, None] * by_pixel
    u_px = [float(np.hypot(fit.u_position, u_relative * fit.position)) for fit in fits]
    position = edges.position + edges.lines.outward * moves
    return replace(edges, position=position, marks=stated_marks(edges, u_px), beside=beside)


def with_blur(edges: EdgePoints, widths: list[float]) -> EdgePoints:
    """Set the blur of the inner flanks to a given value, because a wall beside an edge is not blur."""
    blur_px = edges.blur_px.copy()
    blur_px[:, 0] = [np.sqrt(max(width**2 - PIXEL_VARIANCE, 0.0)) for width in widths]
    blur_px[:, 1] = np.minimum(blur_px[:, 0], blur_px[:, 1])
    return replace(edges, blur_px=blur_px)


def unsure_edges(edges: EdgePoints, limit_px: list[float], beside: str) -> EdgePoints:
    """Leave the edges in place, with an uncertainty for the possible displacement, because its cause is undecided."""
    u_px = [max(abs(m.shift_px), limit / np.sqrt(3.0)) for m, limit in zip(edges.marks, limit_px, strict=True)]
    return replace(edges, marks=stated_marks(edges, u_px), beside=beside)


def stated_marks(edges: EdgePoints, u_px: list[float]) -> tuple[EdgeMark, EdgeMark]:
    """Edge marks with the given uncertainties, one for each finger."""
    left, right = (EdgeMark(u, mark.beyond) for u, mark in zip(u_px, edges.marks, strict=True))
    return left, right
