"""Mean profiles of stored levels across the four straight flanks, from all frames with their sub-pixel phases."""

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from calib.edge_profile import EdgeProfile, binned_profile
from fingervision.vision.edges import EdgePoints
from fingervision.vision.grey import GreyImage
from fingervision.vision.profile_lines import INNER, ROWS

Floats = NDArray[np.float64]

# Extent of a profile to either side: this multiple of the blur plus these pixels, at most the last number of pixels,
# at most half of the distance to the next edge, and within the picture.
REACH_SIGMAS, REACH_EXTRA_PX, FARTHEST_PX = 4.0, 4.0, 20
# Degrees of the curve along a flank, in the part far from the tip: a long fillet bends it. Scatter of the rows beyond
# their noise up to which the lower degree is enough, largest scatter about the curve (pixels), and fewest fitted rows.
DEGREES, STRAIGHT_PX, MOST_SCATTER_PX, FEWEST_ROWS = (1, 4), 0.03, 0.4, 6
# Least contrast of a flank (share of full scale) within which a curve can be seen, and levels beyond which it is
# clipped.
LEAST_CONTRAST, CLIPPED = 0.08, (0.5 / 255.0, 0.99)

# Length of a part along a flank (pixels), longer than texture and dirt are correlated.
PART_PX = 8

# A picture (NaN where the sensor is defective) and the edges in it.
Levels = GreyImage | NDArray[np.float32]
Seen = tuple[Levels, EdgePoints]


def flank_profiles(seen: Sequence[Seen], top_level: int, extra_px: float = REACH_EXTRA_PX) -> list[EdgeProfile]:
    """Profiles of the inner and outer flanks of both fingers, as far as they are straight and in view.

    Parameters
    ----------
    seen : sequence of (ndarray, EdgePoints)
        Pictures turned so that the tips point up, and the edges fitted in them.
    top_level : int
        Full scale of the pictures.
    extra_px : float
        Extent to either side beyond a multiple of the blur (pixels).
    """
    found = (
        flank_profile(seen, finger, is_inner=is_inner, top_level=top_level, extra_px=extra_px)
        for finger in range(2)
        for is_inner in (True, False)
    )
    return [profile for profile in found if profile is not None]


def unclipped_profiles(seen: Sequence[Seen], top_level: int, extra_px: float = REACH_EXTRA_PX) -> list[EdgeProfile]:
    """Profiles with enough contrast whose plateaus lie within the scale; see `flank_profiles`."""
    return [each for each in flank_profiles(seen, top_level, extra_px) if _is_unclipped(each)]


def _is_unclipped(profile: EdgeProfile) -> bool:
    dark, light = profile.ends
    return profile.contrast > LEAST_CONTRAST and dark > CLIPPED[0] and light < CLIPPED[1]


def flank_profile(
    seen: Sequence[Seen], finger: int, *, is_inner: bool, top_level: int, extra_px: float = REACH_EXTRA_PX
) -> EdgeProfile | None:
    """Profile of one flank of the left (0) or right (1) finger; None if it is too short, bent, or out of view."""
    part = slice(0, INNER) if is_inner else slice(INNER, ROWS)
    gathered = [each for upright, edges in seen if (each := _one(upright, edges, finger, part, extra_px)) is not None]
    if not gathered:
        return None
    away = np.concatenate([found for found, *_ in gathered])
    level = np.concatenate([stored for _, stored, _ in gathered]) / top_level
    frame = np.repeat(np.arange(len(gathered)), [found.size for found, *_ in gathered])
    rows = np.concatenate([row for *_, row in gathered])
    outward = float(seen[0][1].lines.outward[finger, part][0])
    return binned_profile(
        away,
        level,
        frame,
        1.0 / top_level,
        outward,
        is_outer=not is_inner,
        part=(rows - rows.min()) // PART_PX,
        shared_rows=float(np.median([edges.shared_lines for _, edges in seen])),
    )


def _one(
    upright: Levels, edges: EdgePoints, finger: int, part: slice, extra_px: float
) -> tuple[Floats, Floats, NDArray[np.intp]] | None:
    """Distances outwards from the flank's line, stored levels, and rows counted from the first, of one picture."""
    real = np.flatnonzero(edges.lines.weight[finger, part] > 0)
    rows = real[real.size // 2 :]
    if rows.size < FEWEST_ROWS:
        return None
    fixed, found = edges.lines.fixed[finger, part][rows].astype(float), edges.position[finger, part][rows]
    noise = float(np.median(edges.u_position[finger, part][rows]))
    for degree in DEGREES:
        if rows.size < FEWEST_ROWS + degree - 1:
            return None
        off = np.abs(found - Polynomial.fit(fixed, found, degree)(fixed))
        spread = 1.4826 * float(np.median(off))
        if spread < 2.0 * noise + STRAIGHT_PX:
            break
    if spread > MOST_SCATTER_PX:
        return None
    keep = off < 3.0 * max(spread, 0.02)
    if np.count_nonzero(keep) < FEWEST_ROWS:
        return None
    every = np.arange(int(fixed.min()), int(fixed.max()) + 1)
    # Rows beside one that does not fit are left out: what lies there, such as dirt, is no part of the profile.
    order = np.argsort(fixed)
    is_clean = np.interp(every, fixed[order], keep[order].astype(float)) == 1.0
    if np.count_nonzero(is_clean) < FEWEST_ROWS:
        is_clean[:] = True
    curve = Polynomial.fit(fixed[keep], found[keep], degree)
    line = curve(every)
    outward = int(edges.lines.outward[finger, part][0])
    room = _room_px(upright, edges, line)
    sigma = float(edges.blur_px[finger, 0])
    reach = int(min(REACH_SIGMAS * sigma + extra_px, FARTHEST_PX, room))
    if reach < REACH_SIGMAS * sigma:
        return None
    columns = np.rint(line).astype(int)[:, None] + outward * np.arange(-reach, reach + 1)
    inside = (columns >= 0) & (columns < upright.shape[1]) & is_clean[:, None]
    levels = upright[np.broadcast_to(every[:, None], columns.shape)[inside], columns[inside]].astype(np.float64)
    is_known = np.isfinite(levels)
    cosine = (1.0 / np.hypot(1.0, curve.deriv()(every)))[:, None]
    away, row = (
        outward * (columns - line[:, None]) * cosine,
        np.broadcast_to((every - every[0])[:, None], columns.shape),
    )
    return away[inside][is_known], levels[is_known], row[inside][is_known]


def _room_px(upright: Levels, edges: EdgePoints, line: Floats) -> float:
    """Half of the smallest distance from the middle of a flank to another flank; at most that to the border."""
    middle = float(np.median(line))
    # A profile that the border cuts off shows no plateau there.
    room = float(min(FARTHEST_PX, line.min(), upright.shape[1] - 1.0 - line.max()))
    for finger in range(2):
        for part in (slice(0, INNER), slice(INNER, ROWS)):
            mine = edges.lines.weight[finger, part] > 0
            if not mine.any():
                continue
            apart = abs(float(np.median(edges.position[finger, part][mine])) - middle)
            if apart > 2.0:
                room = min(room, 0.5 * apart)
    return room
