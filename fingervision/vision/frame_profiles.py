"""What the flanks of one frame show about the camera and its motion: sharpening, a trail, motion, flanks too broad.

What stands beside the edges (walls, bright lines, shadows) is learnt from several profiles together (`learnt_scene`); a
frame by itself only tells what changes from frame to frame.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.edge_filters import PIXEL_VARIANCE
from fingervision.vision.edge_moves import stated_marks, unsure_edges
from fingervision.vision.edges import EdgePoints
from fingervision.vision.grey import GreyImage
from fingervision.vision.mean_profile import REACH_PX, STRAIGHT_ONLY, STRAIGHT_OR_ROUND, mean_profile
from fingervision.vision.profile_lines import INNER, ROWS
from fingervision.vision.sharpening import U_SHIFT, Profile, is_curved, sharpening
from fingervision.vision.side_wall import (
    WIDER,
    Displacement,
    are_broader_together,
    are_outer_flanks_in_view,
    is_surely_broader,
    squared_blurs,
    wall_limits_px,
)
from fingervision.vision.trail import with_trail

Floats = NDArray[np.float64]

# Ratio of a step's squared residuals to the noise of the picture's flat parts above which the profiles are looked at.
UNEXPLAINED = 1.2
# Distance from the end of the scale, in standard deviations of the noise, within which levels are sometimes clipped.
CUT_OFF_SIGMAS = 2.0
# Motion spreads a fillet of this radius like a box and not like a Gaussian: the half-level moves by up to half of the
# variance that it adds over the radius.
MOTION_RADIUS_PX = 15.0


def with_frame_profiles(
    upright: GreyImage,
    edges: EdgePoints,
    light: Floats,
    top_level: int,
    displaced_px: Displacement,
    *,
    may_be_sharpened: bool,
) -> EdgePoints:
    """Return the edge points with what sharpening, a trail, motion, or a wall that only widens the flanks may mean.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels of the picture, turned so that the tips point up.
    edges : EdgePoints
        Steps fitted to every line of pixels.
    light : ndarray of float, shape (levels,)
        Light for every grey level (look-up table).
    top_level : int
        Highest level of the scale.
    displaced_px : callable
        Standard uncertainty of both flanks' positions by a codec (pixels), from the edges; called only where a width
        is in question.
    may_be_sharpened : bool
        Whether the camera may sharpen its pictures; not if it is known from the recording, because the profile of a
        defocused edge resembles that of a sharpened one.
    """
    flank, tip = edges.blur_px[:, 0].max(), edges.blur_px[:, 1].min()
    is_unlike_tip = flank**2 > (1.0 + WIDER) * (tip**2 + PIXEL_VARIANCE) or are_broader_together(edges, displaced_px)
    if edges.noise_flat <= 0.0 or not (is_unlike_tip or edges.noise**2 > UNEXPLAINED * edges.noise_flat**2):
        return _unsure_of_width(edges, displaced_px)
    room = _room(edges)
    # Mean profiles of round flanks take ten times as long, and are computed only if no displacement of the edges is
    # stated yet.
    curves = STRAIGHT_ONLY if any(mark.shift_px for mark in edges.marks) else STRAIGHT_OR_ROUND
    left, right = (mean_profile(upright, edges, light, k, slice(0, INNER), room, curves) for k in range(2))
    if left is None or right is None:
        return _unsure_of_width(edges, displaced_px)
    if any(
        p.light.max() > light[top_level] - CUT_OFF_SIGMAS * edges.noise or p.light.min() <= 0.0 for p in (left, right)
    ):
        return edges  # the models do not describe a flank that is clipped at the end of the scale
    is_sharp = may_be_sharpened and is_curved(light, top_level)
    if is_sharp and (sharp := _sharpened(upright, edges, light, top_level, room)) is not None:
        return sharp
    if not are_outer_flanks_in_view(edges):
        return _unsure_of_width(edges, displaced_px)
    if not is_unlike_tip:
        return edges
    outer = [mean_profile(upright, edges, light, k, slice(INNER, ROWS), REACH_PX) for k in range(2)]
    blur = np.hypot(edges.blur_px[:, 0], np.sqrt(PIXEL_VARIANCE)).tolist()
    trail = with_trail(edges, [[left, outer[0]], [right, outer[1]]], blur)
    if trail is not None:
        return trail
    flanks, tips = squared_blurs(edges)
    widened = np.maximum(flanks - (1.0 + WIDER) * tips, 0.0)
    if np.any(widened):
        widened *= is_surely_broader(edges, displaced_px)
    if np.any(widened):
        return unsure_edges(edges, (0.5 * widened / MOTION_RADIUS_PX).tolist(), "motion")
    return edges


def _sharpened(upright: GreyImage, edges: EdgePoints, light: Floats, top_level: int, room: int) -> EdgePoints | None:
    """Return the points corrected for sharpening of the stored levels; None if there was no sharpening."""
    stored = np.arange(float(light.size))
    left, right = (mean_profile(upright, edges, stored, k, slice(0, INNER), room) for k in range(2))
    if left is None or right is None:
        return None
    blur = float(np.hypot(edges.blur_px[:, 0].mean(), np.sqrt(PIXEL_VARIANCE)))
    profiles = Profile(left.t, left.light, left.count), Profile(right.t, right.light, right.count)
    found = sharpening(profiles, light, top_level, blur)
    if found is None:
        return None
    moves = np.array(found.shift_px)
    by_pixel = np.hypot(1.0, edges.lines.slope)
    moved = replace(edges, position=edges.position + edges.lines.outward * moves[:, None] * by_pixel)
    u_px = [U_SHIFT * abs(move) for move in moves.tolist()]
    return replace(moved, marks=stated_marks(moved, u_px), beside="sharpening")


def _room(edges: EdgePoints) -> int:
    """Largest length (px) of a fit window that does not reach the other finger."""
    real = [edges.position[k, :INNER][edges.lines.weight[k, :INNER] > 0] for k in range(2)]
    if not (real[0].size and real[1].size):
        return 0
    return int(min(REACH_PX, 0.5 * (real[1].min() - real[0].max())))


def _unsure_of_width(edges: EdgePoints, displaced_px: Displacement) -> EdgePoints:
    """State how far a side wall may have moved the edges, if only the blur of the edges indicates a wall."""
    limits = wall_limits_px(edges, displaced_px)
    return edges if limits is None else unsure_edges(edges, limits, "wall")
