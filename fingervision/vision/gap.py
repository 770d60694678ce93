"""Step 8, the gap: the distance between the two measuring points, with its uncertainty."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan, degrees, hypot, nan, sqrt

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.camera import Roughness
from fingervision.domain.frame import Coding
from fingervision.domain.gap import FingerEdge, GapMeasurement, HeldPart, NoGap
from fingervision.domain.loops import loop
from fingervision.domain.status import Status
from fingervision.vision.edge_filters import PIXEL_VARIANCE
from fingervision.vision.edges import EdgePoints
from fingervision.vision.finger_end import FingerEnd, fit_from_any_radius
from fingervision.vision.finger_shape import OUTER_M, PARAMETERS
from fingervision.vision.fingers import CoarseFinger, CoarseFingers, is_hidden
from fingervision.vision.first_guess import first_guess
from fingervision.vision.flanks import has_straight_flanks
from fingervision.vision.held_part import held_part
from fingervision.vision.likeness import FARTHEST_TURNED, LEANS_ALIKE, common_turn
from fingervision.vision.local_outline import FLATTEST, local_measuring_point
from fingervision.vision.measuring_point import MeasuringPoint, measuring_point, squared
from fingervision.vision.median import middle
from fingervision.vision.outline_points import OutlinePoints, finger_origin, outline_points
from fingervision.vision.outline_shapes import LikelyPoints, likely_points
from fingervision.vision.profile_lines import INNER, PLACES, ROWS
from fingervision.vision.residuals import (
    SHARED_POINTS,
    is_open,
    set_aside_variance,
    shape_holds,
    shared_points,
    spread,
)
from fingervision.vision.roughness import SUSPECT, best_linear, roughness, with_roughness
from fingervision.vision.third_tone import THIRD_TONE

Floats = NDArray[np.float64]

# Largest blur of an edge (sigma_e, pixels).
BLUR_LIMIT_PX = 5.0
# Least number of points for a line and its scatter.
FEWEST_ROWS = 4
# Least number of lines across a finger's outline, twice the number of the shape's parameters.
FEWEST_LINES = 2 * PARAMETERS
# Largest share of a flank that may lie beyond the end of the scale.
CUT_OFF_LIMIT = 0.08
# Least contrast of a tip as a share of the flanks' contrast.
TIP_CONTRAST = 0.2
# Largest standard uncertainty of a gap (pixels): counting pixels in the binary picture would be as accurate. For a
# codec with errors common to several points, the limit is multiplied by the root of their number.
LEAST_SURE_PX = 0.5
# Largest standard uncertainty of a gap (pixels) between rough flanks, before they are measured again over a longer
# stretch.
LEAST_SURE_AT_FIRST_PX = 5.0
# Largest possible displacement of the edges by structures beside them (pixels); a larger displacement means a strip as
# wide as the window.
LEAST_SURE_SHIFT_PX = 5.0
BROKEN = "The outline of a finger near the measuring height is neither smooth nor straight"
# A lossy codec causes steps at its blocks' borders, which look like dirt on an outline.
BROKEN_BY = {
    Coding.LOSSLESS: f"{BROKEN}: clean the fingers, or change the light.",
    Coding.INTRAFRAME: f"{BROKEN}: clean the fingers, change the light, or record losslessly.",
}
BROKEN_BY[Coding.INTERFRAME] = BROKEN_BY[Coding.INTRAFRAME]
TOO_ROUGH = NoGap(Status.NO_FINGERS, "The outlines are too rough to determine the tip and the edge of a finger.")
SMEARED = "The fingers moved while the shutter was open"
# Motion during the exposure (pixels) above which a rounded tip cannot be measured; a motion w adds w^2 / 12 to the
# squared blur.
SMEARED_PX = 4.0
# Least ratio of contrast to noise.
CONTRAST_TO_NOISE = 3.0

_lines_within = loop("gap_lines_within")


def measure_gap(
    fingers: CoarseFingers,
    edges: EdgePoints,
    below_tip_px: float,
    full_scale: int,
    light_gap: bool,
    steepest: float,
    coding: Coding,
    coded_points: float,
    known: Roughness | None = None,
) -> GapMeasurement | NoGap:
    """Measure the gap from the edge points of both fingers.

    Parameters
    ----------
    fingers : CoarseFingers
        The fingers to the nearest pixel.
    edges : EdgePoints
        Sub-pixel outlines of the fingers.
    below_tip_px : float
        Distance of the measuring point below the tip.
    full_scale : int
        Largest grey level.
    light_gap : bool
        Whether the fingers are darker than the gap.
    steepest : float
        Largest inclination of a flank against the finger's axis.
    coding : Coding
        Coding of the picture.
    coded_points : float
        Number of neighbouring points that share an error of the codec that nothing else states.
    known : Roughness or None
        Roughness of the edges, if the recording has told it.

    Returns
    -------
    GapMeasurement or NoGap
        The measured gap, or the reason why there is none. Its `roughness_px` is NaN if the flanks are too short to
        determine their roughness.
    """
    refusal = _refuse(edges, full_scale, light_gap)
    if refusal is not None:
        return refusal
    points = outline_points(fingers, edges)
    behind = _gripping(fingers, below_tip_px)
    if min(len(p.x) for p in points) < FEWEST_LINES:
        return behind or NoGap(Status.NO_FINGERS, "Too little of a finger's outline is in view for a measurement.")
    shape = _described(points, below_tip_px, max(coded_points, edges.shared_lines), known)
    points, rough = shape.points, shape.rough
    left, right = shape.ends
    shared = max(shared_points(points, (left, right), coded_points), shape.noise_shared)
    fitted = [
        measuring_point(end, below_tip_px, float(p.blur[0])) for p, end in zip(points, (left, right), strict=True)
    ]
    stray = 1.0 if rough is None else rough.shared_px
    holds = [shape_holds(*one, below_tip_px, stray) for one in zip(points, (left, right), fitted, strict=True)]
    refusal = _no_fingers(fingers, (left, right), below_tip_px, steepest)
    if refusal is not None:
        return refusal
    held = None
    if fingers.held_along_px is not None and (all(holds) or behind is not None):
        held = held_part(fingers, (left, right), (spread(left) * shared, spread(right) * shared), light_gap)
    if behind is not None:
        return replace(behind, held=held)
    likely, measured = _measuring_points(shape, fitted, holds, below_tip_px, shared, coding)
    if isinstance(measured, NoGap):
        return measured
    is_smooth = likely is not None and _is_smooth(likely)
    has_part = any(finger.hidden.size for finger in (fingers.left, fingers.right))
    least_px = LEAST_SURE_PX if rough is None or has_part else LEAST_SURE_AT_FIRST_PX
    largest_variance = least_px**2 * coded_points
    roughness_px = nan if shape.is_untold and not is_smooth else 0.0
    roughness_px = roughness_px if rough is None else rough.deviation_px
    outcome = _assemble(fingers, edges, measured, below_tip_px, light_gap, largest_variance, roughness_px, held)
    if outcome is TOO_ROUGH:
        outcome = _why_too_rough(edges, measured, has_part)
    if isinstance(outcome, NoGap):
        return replace(outcome, held=held) if held is not None else outcome
    return outcome


def specimen_roughness(seen: Sequence[tuple[CoarseFingers, EdgePoints]], below_tip_px: float) -> Roughness | None:
    """Mean roughness of the edges in several frames; None if most are smooth, or corners look like roughness.

    Parameters
    ----------
    seen : sequence of (CoarseFingers, EdgePoints)
        The fingers, and their sub-pixel outlines, in each frame.
    below_tip_px : float
        Distance of the measuring point below the tip.
    """
    told = []
    for fingers, edges in seen:
        points = outline_points(fingers, edges)
        left, right = (fit_from_any_radius(p, *first_guess(p, below_tip_px)) for p in points)
        rough = roughness(points, (left, right))
        if rough is None or not rough.is_told:
            continue
        if _is_smooth(likely_points(points, (left, right), (None, None), below_tip_px, edges.shared_lines)):
            return None
        told.append((rough.covariance, fingers.are_long))
    if 2 * len(told) <= len(seen):
        return None
    are_long = 2 * sum(is_long for _, is_long in told) > len(told)
    return Roughness(np.mean([covariance for covariance, _ in told], axis=0), are_flanks_long=are_long)


@dataclass(frozen=True, slots=True)
class _Shapes:
    """Shapes fitted to the outlines of both fingers.

    Parameters
    ----------
    points : (OutlinePoints, OutlinePoints)
        Points of the outlines, with the roughness of the flanks among their variances.
    fits, ends : list of FingerEnd, (FingerEnd, FingerEnd)
        Sides with fillets, and the same with tops perpendicular to the flanks where the points do not contradict this.
    likely : LikelyPoints or None
        Measuring points by the likeliest shapes, where these explain what seemed to be roughness.
    rough : Roughness or None
        Roughness of the flanks, if there is any.
    is_untold : bool
        Whether the flanks are too short to determine it.
    noise_shared : float
        Number of neighbouring points with a common error.
    """

    points: tuple[OutlinePoints, OutlinePoints]
    fits: list[FingerEnd]
    ends: tuple[FingerEnd, FingerEnd]
    likely: LikelyPoints | None
    rough: Roughness | None
    is_untold: bool
    noise_shared: float


def _is_smooth(likely: LikelyPoints) -> bool:
    """Whether a shape describes both outlines down to their noise."""
    return None not in likely.points and likely.misfit < SUSPECT


def _described(
    points: tuple[OutlinePoints, OutlinePoints], below_tip_px: float, noise_shared: float, known: Roughness | None
) -> _Shapes:
    """Fit sides with fillets to each finger's end, and tell rough flanks from corners."""
    guesses = [first_guess(p, below_tip_px) for p in points]
    fits = [fit_from_any_radius(p, *guess) for p, guess in zip(points, guesses, strict=True)]
    rough = roughness(points, (fits[0], fits[1]), known)
    is_untold = rough is not None and not rough.is_told
    rough = None if is_untold else rough
    likely = None
    if rough is not None and known is None:
        # Corners that are not part of the three-sided shape cause residuals like those of roughness.
        likely = likely_points(points, fits, (None, None), below_tip_px, noise_shared)
        likely, rough = (likely, None) if _is_smooth(likely) else (None, rough)
    if rough is not None:
        bare = points
        points = (with_roughness(points[0], rough, fits[0]), with_roughness(points[1], rough, fits[1]))
        fits = [
            best_linear(p, fit_from_any_radius(p, *guess), guess[0], guess[2], own, rough)
            for p, guess, own in zip(points, guesses, bare, strict=True)
        ]
        noise_shared = max(noise_shared, rough.shared_px)
    ends = (squared(fits[0]), squared(fits[1]))
    return _Shapes(points, fits, ends, likely, rough, is_untold, noise_shared)


def _measuring_points(
    shape: _Shapes,
    fitted: list[MeasuringPoint],
    holds: list[bool],
    below_tip_px: float,
    shared: float,
    coding: Coding,
) -> tuple[LikelyPoints | None, list[MeasuringPoint] | NoGap]:
    """Measuring points of both fingers: by fillets where they leave nothing, else by the likeliest shapes."""
    points, ends, likely = shape.points, shape.ends, shape.likely
    aside = [
        set_aside_variance(p, end, found.edge, found.tip + below_tip_px)
        for p, end, found in zip(points, ends, fitted, strict=True)
    ]
    are_open = [is_open(*one, below_tip_px, shared) for one in zip(points, ends, fitted, strict=True)]
    if likely is None and (not all(holds) or any(aside) or any(are_open) or shape.rough is not None):
        known = [found if does_hold else None for found, does_hold in zip(fitted, holds, strict=True)]
        likely = likely_points(points, shape.fits, known, below_tip_px, shape.noise_shared)
    # A codec's errors extend over its blocks, also where the quantiser states their size.
    stray = max(shape.noise_shared, SHARED_POINTS[coding])
    by_shape = [None, None] if likely is None else likely.points
    # An outline of another shape is usually that of both fingers, and one method gives both the same errors.
    are_known = all(does_hold or own is not None for does_hold, own in zip(holds, by_shape, strict=True))
    measured = []
    for p, end, found, does_hold, beyond, likeliest in zip(points, ends, fitted, holds, aside, by_shape, strict=True):
        own = likeliest if are_known else local_measuring_point(p, below_tip_px, shape.noise_shared) or likeliest
        # If there is no other description of the outline, residuals that common errors of neighbouring points may
        # cause do not reject the shape.
        if own is None and (does_hold or shape_holds(p, end, found, below_tip_px, stray)):
            if found.apex < p.x.min() - 1.0:
                return likely, NoGap(Status.TIP_OUT_OF_VIEW, "A finger's tip lies beyond the picture's border.")
            covariance = found.covariance * (spread(end) * shared if shape.rough is None else 1.0)
            covariance[1, 1] += beyond
            own = MeasuringPoint(found.tip, found.apex, found.edge, found.slope, covariance)
        if own is None:
            return likely, NoGap(Status.NO_FINGERS, BROKEN_BY[coding])
        measured.append(own)
    return likely, measured


def _why_too_rough(edges: EdgePoints, measured: list[MeasuringPoint], has_part: bool) -> NoGap:
    """Reason why the position of an edge is too uncertain."""
    if (way_px := _way_px(edges)) > SMEARED_PX:
        words = (
            f"{SMEARED}, by about {way_px:.0f} px: shorten the exposure, or move more slowly while frames are taken."
        )
        return NoGap(Status.BLURRED, words)
    if max(abs(m.slope) for m in measured) > FLATTEST:
        return NoGap(
            Status.NO_FINGERS,
            "The measuring height crosses the top of a finger instead of its inner side: turn the camera until the "
            "tips are level, or measure farther below the tips (--below-tip-mm).",
        )
    words = "A part between the fingers leaves too little of their inner edges in view."
    return NoGap(Status.GRIPPING, words) if has_part else TOO_ROUGH


def _gripping(fingers: CoarseFingers, below_tip_px: float) -> NoGap | None:
    """Return the status `gripping` if a part hides an inner edge at the measuring height."""
    sides = [
        name
        for name, finger in (("left", fingers.left), ("right", fingers.right))
        if is_hidden(finger, finger.top_along_px + below_tip_px)
    ]
    if not sides:
        return None
    edges = "inner edges" if len(sides) == 2 else f"{sides[0]} finger's inner edge"
    return NoGap(Status.GRIPPING, f"A part between the fingers hides the {edges} at the measuring height.")


def _refuse(edges: EdgePoints, full_scale: int, light_gap: bool) -> NoGap | None:
    """Return the reason why the edges give no gap; None if there is no such reason."""
    seen = (edges.lines.weight, edges.contrast, edges.is_clipped)
    left, right, contrast, clipped = _lines_within(*seen, 0, INNER)
    left_tip, right_tip, tip_contrast, tip_clipped = _lines_within(*seen, ROWS, PLACES)
    if left + right < FEWEST_ROWS:  # on a slanted or touching tip, the side towards the gap is measured in columns
        left, right, contrast, clipped = left_tip, right_tip, tip_contrast, tip_clipped
    if left + right < FEWEST_ROWS:
        return NoGap(Status.NO_FINGERS, "The visible inner edges of the fingers are too short to be measured.")
    if min(left, right) == 0 and max(left, right) >= FEWEST_ROWS:
        return NoGap(Status.NO_FINGERS, "Only one of the fingers' two inner edges is visible.")
    contrast *= 1.0 if light_gap else -1.0
    if contrast < CONTRAST_TO_NOISE * edges.noise or contrast < 0.02 * full_scale:
        return NoGap(Status.LOW_CONTRAST, "The contrast between fingers and background is too low.")
    if left_tip + right_tip and abs(tip_contrast) < TIP_CONTRAST * abs(contrast):
        return NoGap(Status.NO_FINGERS, "The objects in view have no sharp end where the tip of a finger would be.")
    if 2 * clipped > left + right or max(mark.beyond for mark in edges.marks) > CUT_OFF_LIMIT:
        return NoGap(Status.SATURATED, "The flank of the edges is clipped at the end of the grey scale.")
    blur = sqrt(max(edges.blur_px[:, 0].tolist()) ** 2 + PIXEL_VARIANCE)
    if blur > BLUR_LIMIT_PX:
        return NoGap(
            Status.BLURRED, f"The blur of the edges is {blur:.1f} px (standard deviation), which is too large."
        )
    return None


def _way_px(edges: EdgePoints) -> float:
    """Displacement of the faster finger during the exposure (pixels), from the extra blur of its flanks."""
    flanks, tips = (edges.blur_px[:, part] ** 2 for part in (0, 1))
    return sqrt(12.0 * max(0.0, float((flanks - tips).max())))


def _no_fingers(
    fingers: CoarseFingers, ends: tuple[FingerEnd, FingerEnd], below_tip_px: float, steepest: float
) -> NoGap | None:
    """Return the status `no_fingers` or `one_finger` if an object has no straight flanks, as fingers have."""
    pair = (fingers.left, fingers.right)
    turn = common_turn([finger.inner_sign * end.parameters[OUTER_M] for finger, end in zip(pair, ends, strict=True)])
    are_fingers = [has_straight_flanks(finger.top, below_tip_px, steepest + abs(turn)) for finger in pair]
    if abs(turn) > FARTHEST_TURNED and any(are_fingers):
        return NoGap(
            Status.NO_FINGERS,
            f"The fingers are rotated by {degrees(atan(abs(turn))):.0f} degrees in the picture, but at most 25 "
            "degrees are permitted: turn the camera.",
        )
    if all(are_fingers):
        return None
    if any(are_fingers):
        return NoGap(Status.ONE_FINGER, "Only one of two objects in view has the straight flanks of a finger.")
    return NoGap(Status.NO_FINGERS, "The objects in view do not have the straight flanks of fingers.")


def _assemble(
    fingers: CoarseFingers,
    edges: EdgePoints,
    measured: list[MeasuringPoint],
    below_tip_px: float,
    light_gap: bool,
    largest_variance: float,
    roughness_px: float,
    held: HeldPart | None,
) -> GapMeasurement | NoGap:
    """Transform the result from the fingers' axes to the picture; refuse a result with too large a variance."""
    orientation = fingers.orientation
    across, along, found = [], [], []
    for k, (finger, m) in enumerate(zip((fingers.left, fingers.right), measured, strict=True)):
        across0, along0 = finger_origin(finger)
        across.append(across0 + finger.inner_sign * m.edge)
        along.append(along0 + m.tip + below_tip_px)
        x, y = orientation.to_pixels(across[k], along[k])
        found.append(_finger_edge(finger, m, edges, k, (x, y), orientation.along_to_pixels(along[k] - below_tip_px)))
    dx, dy = across[1] - across[0], along[1] - along[0]
    if dx <= 0:
        return NoGap(Status.TOUCHING, "The fingers touch at the measuring height.")
    # Each edge's slope in its finger's own axes: level fingers of one gripper have the same, and a camera rotated by as
    # much as is permitted slants the gap by half of this.
    if abs(dy) > dx and abs(measured[0].slope - measured[1].slope) > LEANS_ALIKE:
        return NoGap(
            Status.ONE_FINGER,
            f"The two measuring points lie {abs(dy):.0f} px apart along the fingers and only {dx:.0f} px across, and "
            "their edges differ in direction: one of them is on a part that protrudes beyond a finger. Hold the part "
            "lower, or state the region of the fingers (--roi).",
        )
    gap = hypot(dx, dy)
    variance = 0.0
    for m, end in zip(measured, (-1.0, 1.0), strict=True):
        # In its finger's axes, each edge reduces the gap as its position increases; a tip changes the height of its
        # measuring point.
        by_tip, by_edge = end * dy / gap, -dx / gap
        (tip_tip, tip_edge), (_, edge_edge) = m.covariance.tolist()
        variance += by_tip**2 * tip_tip + 2.0 * by_tip * by_edge * tip_edge + by_edge**2 * edge_edge
    if not variance < largest_variance:
        return TOO_ROUGH
    # A rim or clipping displaces both edges in the same way, so that the displacements are added.
    u_shift = float(abs(sum(mark.shift_px for mark in edges.marks)))
    if u_shift > LEAST_SURE_SHIFT_PX:
        return THIRD_TONE
    return GapMeasurement(
        found[0],
        found[1],
        orientation.direction,
        sqrt(variance),
        light_gap,
        u_shift,
        roughness_px=roughness_px,
        held=held,
    )


def _finger_edge(
    finger: CoarseFinger, m: MeasuringPoint, edges: EdgePoints, k: int, point: tuple[float, float], tip: float
) -> FingerEdge:
    mine = edges.lines.weight[k, :INNER] > 0
    return FingerEdge(
        x_px=point[0],
        y_px=point[1],
        tip_px=tip,
        u_across_px=sqrt(m.covariance[1, 1]),
        u_tip_px=sqrt(m.covariance[0, 0]),
        slope=finger.inner_sign * m.slope,
        blur_px=sqrt(edges.blur_px[k, 0] ** 2 + PIXEL_VARIANCE),
        contrast=middle(edges.contrast[k, :INNER][mine]),
    )
