"""Select the model of the mean profile across a flank, from which the position of the finger's edge follows.

A shadow, a visible side wall and a line of glare each cause a characteristic mean profile. On one flank alone, some
structures are indistinguishable: a wall half as light as the background looks like motion blur, and glare looks like a
wall on the other side of the edge. Walls, motion, glare and shadows are distinguished by where they occur: a wall is
visible on the inner flank only, because the camera looks into the gap from its middle; motion blurs both flanks but not
the tip; glare and shadow surround the finger.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.vision.edge_filters import PIXEL_VARIANCE
from fingervision.vision.edge_moves import (
    are_of_size,
    beyond_wall,
    moved_edges,
    stated_marks,
    unsure_edges,
    without_additions,
)
from fingervision.vision.edges import EdgePoints
from fingervision.vision.grey import GreyImage
from fingervision.vision.mean_profile import (
    BIN_PX,
    REACH_PX,
    STRAIGHT_ONLY,
    STRAIGHT_OR_ROUND,
    MeanProfile,
    mean_profile,
)
from fingervision.vision.profile_lines import INNER, ROWS
from fingervision.vision.profile_models import (
    FADING,
    GLARE,
    MODEL_LEAVES,
    MODEL_TIMES,
    SHADOW,
    STEP,
    WALL,
    Flank,
    FlankFits,
    ProfileFit,
    best_fit,
    symmetric_squares,
)
from fingervision.vision.sharpening import U_SHIFT, Profile, is_curved, sharpening
from fingervision.vision.side_wall import (
    SIGNIFICANT,
    WIDER,
    Displacement,
    are_broader_together,
    are_outer_flanks_in_view,
    is_surely_broader,
    not_displaced,
    squared_blurs,
    wall_limits_px,
    with_narrow_wall,
)
from fingervision.vision.trail import with_trail

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Ratio of a step's residuals to the noise of the picture's flat parts above which other models are tried.
UNEXPLAINED = 1.2
# Ratios above which flanks without a common profile are not steps, but pads or shadows as wide as the window: residuals
# to the noise of the picture's flat parts, and squared blur of the flanks to that of the tips. Motion causes a ratio of
# residuals below 2, and texture does not change the blur.
NO_STEP, NO_EDGE, NO_MOTION = 3.0, 4.0, 2.0
# Difference between the levels inside the two fingers' edges, as a share of the contrast, above which one of them is
# not a finger's: fingers of one gripper are alike, and uneven light changes both levels by less.
UNLIKE_TONES = 0.25
# Largest integral of the squared residual of a Gaussian step, in units of contrast^2 times blur, that symmetric optics
# can cause: a disc of defocus causes at most 0.0017 (a box 0.0038). A larger residual means two steps, or a line
# between them, even if it is symmetric.
DISC_LEAVES = 0.002
# Ratio of the distance of a fitted glare to its blur below which defocus explains the glare; a disc of defocus of any
# size gives 1.0 to 1.1.
DISC_BREADTH = 1.12
# Distance from the end of the scale, in standard deviations of the noise, within which levels are sometimes clipped.
CUT_OFF_SIGMAS = 2.0
# Motion and defocus widen both flanks of a finger, and a wall widens the inner flanks of both fingers. If only one
# inner flank is wider than the finger's outer flank, by this share of the squared blur and by this number of pixels, a
# strip of a third tone lies beside it, such as a shadow. A strip of width w adds at most w / 2 to the blur, so that
# this strip is wider than two pixels, and its outer edge may have been measured.
ONE_SIDED, ONE_SIDED_PX, STRIP = 0.5, 1.2, "strip"
# Width of a wall or glare, as a multiple of the blur, below which it cannot be distinguished from blur.
RESOLVED_BLURS = 1.6
# Motion spreads a fillet of this radius like a box and not like a Gaussian: the half-level moves by up to half of the
# variance that it adds over the radius.
MOTION_RADIUS_PX = 15.0
# Relative standard uncertainty of a correction for shadow and for glare: real shadows are not exactly ramps, and glare
# has another position on a fillet than on the flank.
U_SHADOW, U_GLARE = 0.1, 0.35


def with_profile(
    upright: GreyImage,
    edges: EdgePoints,
    light: Floats,
    top_level: int,
    is_outline: bool = False,
    displaced_px: Displacement = not_displaced,
    *,
    may_be_sharpened: bool = True,
) -> EdgePoints:
    """Return the edge points moved to the finger's own edge, if a structure beside it displaced the fitted step.

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
    is_outline : bool
        Whether the edge of a thick part is that of its whole outline, side walls included, rather than that of its
        front face.
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
    inner = [mean_profile(upright, edges, light, k, slice(0, INNER), room, curves) for k in range(2)]
    if inner[0] is None or inner[1] is None:
        return _without_profiles(edges, displaced_px)
    if any(p.light.max() > light[top_level] - CUT_OFF_SIGMAS * edges.noise or p.light.min() <= 0.0 for p in inner if p):
        return edges  # the models do not describe a flank that is clipped at the end of the scale
    is_sharp = may_be_sharpened and is_curved(light, top_level)
    if is_sharp and (sharp := _sharpened(upright, edges, light, top_level, room)) is not None:
        return sharp
    blur = [float(np.hypot(edges.blur_px[k, 0], np.sqrt(PIXEL_VARIANCE))) for k in range(2)]
    # Lines along the picture's border do not cross a flank.
    outer: list[MeanProfile | None] = [None, None]
    if are_outer_flanks_in_view(edges):
        outer = [mean_profile(upright, edges, light, k, slice(INNER, ROWS), REACH_PX) for k in range(2)]
    trail = with_trail(edges, [[inner[k], outer[k]] for k in range(2)], blur) if is_unlike_tip else None
    if trail is not None and trail.is_on_each_flank:
        return trail.edges
    weight = 1.0 / edges.noise_flat**2
    profiles = [(profile, weight, blur[k]) for k, profile in enumerate(inner) if profile]
    seen = _Seen(upright, edges, light, is_outline, displaced_px, is_unlike_tip, profiles, FlankFits(profiles))
    if (found := _inner_shadow_or_glare(seen)) is not None:
        return found
    if outer[0] is None or outer[1] is None:
        return _by_inner_flanks(seen)
    if (found := _by_outer_flanks(seen, [outer[0], outer[1]])) is not None:
        return found
    if trail is not None:
        return trail.edges
    flanks, tips = squared_blurs(edges)
    widened = np.maximum(flanks - (1.0 + WIDER) * tips, 0.0)
    if np.any(widened):
        widened *= is_surely_broader(edges, displaced_px)
    if np.any(widened):
        return unsure_edges(edges, (0.5 * widened / MOTION_RADIUS_PX).tolist(), "motion")
    return _faint_glare(seen)


class _Seen:
    """What the edges of a picture show: the profiles of both inner flanks, and the models that explain them.

    Parameters
    ----------
    upright, edges, light, is_outline, displaced_px
        As for `with_profile`.
    is_unlike_tip : bool
        Whether the flanks are more blurred than the tips.
    profiles : list of Flank
        Mean profiles of both inner flanks.
    fits : FlankFits
        Models fitted to these profiles, each when it is first asked for.
    """

    def __init__(
        self,
        upright: GreyImage,
        edges: EdgePoints,
        light: Floats,
        is_outline: bool,
        displaced_px: Displacement,
        is_unlike_tip: bool,
        profiles: list[Flank],
        fits: FlankFits,
    ) -> None:
        self.upright, self.edges, self.light = upright, edges, light
        self.is_outline, self.displaced_px, self.is_unlike_tip = is_outline, displaced_px, is_unlike_tip
        self.profiles, self.fits = profiles, fits
        self.steps = fits.of(STEP)
        self.is_step = fits.is_step()
        # A profile that symmetric optics of any shape explain (a disc of defocus, a halo) is neither shadow nor glare.
        self.is_lopsided = not self.is_step and not _is_symmetric(profiles, self.steps)
        # Models are fitted where they are needed, because most of the time is spent in these fits.
        self.may_be_shadow = self.is_lopsided and fits.explains(SHADOW)
        self.may_be_glare = not self.is_step and fits.explains(GLARE)

    def without_shadow(self) -> EdgePoints:
        """Edges corrected for a soft shadow."""
        fading = [best_fit(FADING, *seen) for seen in self.profiles]
        return _without_shadow(self.upright, self.edges, self.light, self.fits.of(SHADOW), fading, self.fits.bins)

    def without_glare(self) -> EdgePoints:
        """Edges corrected for a bright line on the fingers."""
        glare = self.fits.of(GLARE)
        moved = moved_edges(self.edges, glare, U_GLARE, np.hypot(1.0, self.edges.lines.slope), "glare")
        return without_additions(self.upright, moved, self.light, GLARE, glare)


def _without_profiles(edges: EdgePoints, displaced_px: Displacement) -> EdgePoints:
    """State what can be known where the flanks have no mean profile."""
    flanks, tips = squared_blurs(edges)
    is_none = edges.noise > NO_STEP * edges.noise_flat and bool(np.any(flanks > NO_EDGE * tips))
    # A shadow on one side only, so wide that some rows follow its far edge and others the finger's.
    is_wider = flanks.max() > flanks.min() + max(ONE_SIDED * flanks.min(), ONE_SIDED_PX**2)
    is_none |= edges.noise > NO_MOTION * edges.noise_flat and bool(is_wider)
    # A dark shadow with sharp borders was taken for the finger: what lies inside the edges differs.
    apart = abs(edges.inside[0] - edges.inside[1]) / np.abs(edges.contrast[:, :INNER]).max()
    is_none |= edges.noise > NO_STEP * edges.noise_flat and bool(apart > UNLIKE_TONES)
    return replace(edges, beside=STRIP) if is_none else _unsure_of_width(edges, displaced_px)


def _inner_shadow_or_glare(seen: _Seen) -> EdgePoints | None:
    """Correct a shadow or glare that the inner flanks alone distinguish from a wall; None if they do not."""
    fits, left = seen.fits, seen.fits.squares
    is_shadow = seen.may_be_shadow and left(SHADOW) + fits.margin(SHADOW) < min(left(WALL), left(GLARE))
    if is_shadow and are_of_size(fits.of(SHADOW), -1.0):
        return seen.without_shadow()
    is_glare = seen.is_lopsided and seen.may_be_glare and left(GLARE) + fits.margin(GLARE) < left(WALL)
    if is_glare and are_of_size(fits.of(GLARE), 1.0):
        return seen.without_glare()
    return None


def _by_inner_flanks(seen: _Seen) -> EdgePoints:
    """State how far a wall may have displaced the edges, where the outer flanks are not in view."""
    fits, edges, profiles = seen.fits, seen.edges, seen.profiles
    wall = fits.of(WALL)
    is_wall = not seen.is_step and fits.explains(WALL) and are_of_size(wall, -1.0)
    is_strip = [
        step.squares > max(MODEL_LEAVES * profile.t.size, MODEL_TIMES * fit.squares)
        for step, fit, (profile, _, _) in zip(seen.steps, wall, profiles, strict=True)
    ]
    if is_strip[0] != is_strip[1]:
        return replace(edges, beside=STRIP)
    if not is_wall and seen.is_unlike_tip:
        # The flanks are more blurred than the tips, because of a wall or of motion, which cannot be distinguished
        # here.
        wall = [
            best_fit(WALL, *each[:2], float(np.hypot(tip, np.sqrt(PIXEL_VARIANCE))), True)
            for each, tip in zip(profiles, edges.blur_px[:, 1], strict=True)
        ]
        is_wall = sum(fit.squares for fit in wall) < fits.squares(STEP) - SIGNIFICANT and are_of_size(wall, -1.0)
    unsure = _unsure_of_width(edges, seen.displaced_px)
    if not is_wall:
        return unsure
    chosen = [beyond_wall(fit) for fit in wall] if seen.is_outline else wall
    # There is a wall, so that the edge may be displaced by the fitted distance plus its uncertainty.
    farthest = [abs(fit.position) + 2.0 * fit.u_position for fit in chosen]
    # The profile of a wall narrower than the blur does not determine its tone, so that only its width is used.
    is_narrow = any(fit.breadth < RESOLVED_BLURS * fit.blur for fit in wall)
    return unsure_edges(unsure if is_narrow else edges, farthest, "wall")


def _by_outer_flanks(seen: _Seen, outer: list[MeanProfile]) -> EdgePoints | None:
    """Tell shadow, strip and wall by the outer flanks, which face the light and the camera otherwise; None if none."""
    fits, edges, steps = seen.fits, seen.edges, seen.steps
    flanks = [(profile, *seen.profiles[k][1:]) for k, profile in enumerate(outer)]
    if seen.may_be_shadow:
        # A shadow, which the inner flanks cannot distinguish from a wall, is also visible on the outer side.
        beyond = np.array([[best_fit(kind, *flank).squares for kind in range(3)] for flank in flanks])
        both = np.array([fits.squares(kind) for kind in range(3)]) + beyond.sum(axis=0)
        is_likelier = both[SHADOW] + fits.margin(SHADOW) < both[WALL] and both[SHADOW] < both[STEP] / MODEL_TIMES
        if is_likelier and are_of_size(fits.of(SHADOW), -1.0):
            return seen.without_shadow()
    widths = [best_fit(STEP, *flank).blur for flank in flanks]
    is_one_sided = [
        step.blur**2 > width**2 + max(ONE_SIDED * width**2, ONE_SIDED_PX**2)
        and step.squares > MODEL_LEAVES * profile.t.size
        for step, width, (profile, _, _) in zip(steps, widths, seen.profiles, strict=True)
    ]
    if is_one_sided[0] != is_one_sided[1]:
        return replace(edges, beside=STRIP)
    # Only light from one side casts a shadow beside one finger's inner flank and the other finger's outer flank. A
    # shadow up to two pixels wide only increases the blur: a strip of two equal steps by half of its width.
    wider = [step.blur**2 - width**2 for step, width in zip(steps, widths, strict=True)]
    if min(wider) < -ONE_SIDED * min(step.blur for step in steps) ** 2 and max(wider) > ONE_SIDED * min(widths) ** 2:
        return unsure_edges(edges, [2.0 * np.sqrt(max(more, 0.0)) for more in wider], "shadow")
    if all(step.blur**2 > (1.0 + WIDER) * width**2 for step, width in zip(steps, widths, strict=True)):
        return with_narrow_wall(edges, seen.profiles, outer, fits.enough, seen.is_outline, seen.displaced_px)
    return None


def _faint_glare(seen: _Seen) -> EdgePoints:
    """Correct or state a bright line that is no more likely than a wall or than the optics."""
    fits, edges = seen.fits, seen.edges
    if not seen.may_be_glare or not are_of_size(glare := fits.of(GLARE), 1.0):
        return edges
    if not seen.is_lopsided:
        if min(fit.breadth / fit.blur for fit in glare) > DISC_BREADTH:  # a line of glare may be hidden by such optics
            return unsure_edges(edges, [abs(fit.position) for fit in glare], "glare")
        return edges
    wall = fits.of(WALL)
    if not all(fit.breadth > RESOLVED_BLURS * fit.blur for fit in wall):
        return edges
    # The bright line is glare on the finger, or a bevel around it; the outline lies between the two positions.
    bevel = [abs(w.position + w.breadth - g.position) / np.sqrt(3.0) for w, g in zip(wall, glare, strict=True)]
    moved = seen.without_glare()
    u_px = [max(mark.shift_px, u) for mark, u in zip(moved.marks, bevel, strict=True)]
    return replace(moved, marks=stated_marks(moved, u_px))


def _without_shadow(
    upright: GreyImage, edges: EdgePoints, light: Floats, ramps: list[ProfileFit], fading: list[ProfileFit], bins: int
) -> EdgePoints:
    """Edges corrected for a soft shadow, whose light recovers with distance linearly or exponentially.

    The edge is placed between the positions of the linear and the exponential model, nearer to the model with the
    smaller sum of squared residuals beyond noise. The distance between the chosen position and the position of the
    better model is a standard uncertainty.
    """
    squares = [sum(fit.squares for fit in fits) for fits in (ramps, fading)]
    if squares[0] <= squares[1] or not are_of_size(fading, -1.0):
        kind, fits, others = SHADOW, ramps, fading
    else:
        kind, fits, others = FADING, fading, ramps
    beyond = [max(each - bins, np.sqrt(2.0 * bins)) for each in squares]
    share = min(beyond) / sum(beyond) if are_of_size(others, -1.0) else 0.0
    towards = [share * (other.position - fit.position) for fit, other in zip(fits, others, strict=True)]
    by_pixel = np.hypot(1.0, edges.lines.slope)
    moved = without_additions(upright, moved_edges(edges, fits, U_SHADOW, by_pixel, "shadow"), light, kind, fits)
    further = np.array(towards)[:, None] * np.hypot(1.0, moved.lines.slope)
    u_px = [float(np.hypot(mark.shift_px, by)) for mark, by in zip(moved.marks, towards, strict=True)]
    position = moved.position + moved.lines.outward * further
    return replace(moved, position=position, marks=stated_marks(moved, u_px))


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


def _is_symmetric(flanks: list[Flank], steps: list[ProfileFit]) -> bool:
    """Whether the profiles of both flanks could be caused by optics that spread light symmetrically."""
    left = 0.0
    for (profile, weight, _), step in zip(flanks, steps, strict=True):
        contrast = float(np.ptp(profile.light))
        by_noise = weight * float(profile.count.mean()) * contrast**2 * step.blur
        left += BIN_PX * max(step.squares - profile.t.size, 0.0) / by_noise / len(flanks)
    # Fits with a free shape take ten times as long, and are only made if the residuals are no larger than those of a
    # fitted disc of defocus.
    if left >= DISC_LEAVES:
        return False
    bins = sum(profile.t.size for profile, _, _ in flanks)
    squares = sum(symmetric_squares(p.t, p.light, weight * p.count, blur) for p, weight, blur in flanks)
    return squares < 0.5 * MODEL_LEAVES * bins


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
