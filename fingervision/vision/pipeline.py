"""Run the image processing steps on one video frame: grey, denoise, binarise, fingers, edges, tip, gap.

Only the module `pipeline` determines the order of the steps.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from math import hypot, isnan, sqrt
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.camera_response import CameraResponse
from fingervision.domain.camera import CameraModel, Origin
from fingervision.domain.errors import DataError
from fingervision.domain.frame import Frame, Pixels, Region
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.domain.status import Status
from fingervision.vision.binarise import Binary, binarise, split_at
from fingervision.vision.candidates import candidates, found, has_edges, local_change
from fingervision.vision.coded_picture import CodedPicture, coded_picture
from fingervision.vision.defect_pixels import blanked, repaired
from fingervision.vision.edge_moves import STEPS_ALONE, moved_by_recording, u_aslant_px
from fingervision.vision.edges import EdgePoints, fit_edges
from fingervision.vision.fingers import CoarseFingers
from fingervision.vision.flank_profiles import Seen
from fingervision.vision.frame_profiles import with_frame_profiles
from fingervision.vision.gap import LEAST_SURE_PX, TOO_ROUGH, measure_gap
from fingervision.vision.grey import GreyImage, denoise, full_scale, to_grey, top_level
from fingervision.vision.held_part import visible_lines
from fingervision.vision.interlace import at_half_way
from fingervision.vision.overlay import draw_boundary, draw_edge_points, draw_overlay, in_eight_bits
from fingervision.vision.picture_memory import keep_picture_memory
from fingervision.vision.profile_lines import profile_lines
from fingervision.vision.response_shift import u_gap_response_px
from fingervision.vision.roughness import is_surer, with_longer_flanks
from fingervision.vision.settings import LINEAR_CAMERA, Settings
from fingervision.vision.stripes import with_stripes
from fingervision.vision.third_tone import THIRD_TONE, other_threshold

__all__ = [
    "LINEAR_CAMERA",
    "Settings",
    "contradicts",
    "look_closely",
    "measure_frame",
    "region_of_interest",
    "steps",
    "steps_alone",
]

# Least contrast between the two classes of a picture, as a share of full scale.
CONTRAST_FLOOR = 0.03
SATURATED_SHARE = 0.99
# Least side of a picture (pixels) that can contain two fingers and the edges between them.
SMALLEST_SIDE_PX = 16
# Statuses after which no other objects are tried as fingers, because the fingers were found but cannot be measured.
FINAL = (Status.SATURATED, Status.BLURRED, Status.GRIPPING)
# Largest standard uncertainty (pixels) of a gap that is measured beside a shadow or pad with another threshold; a
# larger uncertainty suggests that other edges were measured.
LEAST_SURE_AGAIN_PX = 0.3
# Distance (pixels) beyond a window of the end of a strip that does not act on it: two standard deviations of a usual
# blur, and the error to which the breadth is known.
ALONE_PX = 3.0
# Standard deviations by which what a frame's edges show differs from the usual if something else stands beside them,
# and least relative differences of the squared residuals and of the flanks' squared blur.
UNLIKE_SIGMAS, LEAST_UNLIKE = 5.0, (0.3, 0.06)
NOT_ASKED = NoGap(Status.NOT_ASKED, "Nothing asks for the gap between fingers.")
UNIFORM = NoGap(Status.LOW_CONTRAST, "The picture is uniform: no object differs from the background.")


def measure_frame(frame: Frame, settings: Settings) -> GapMeasurement | NoGap:
    """Measure one video frame, without any memory of earlier frames.

    The first call limits OpenCV to one thread in this process: the waiting of OpenCV's other threads between frames
    would take two thirds of a processor core that the decoder needs. The first call also lets the process keep the
    memory of intermediate pictures (`keep_picture_memory`).

    Parameters
    ----------
    frame : Frame
        The picture.
    settings : Settings
        Settings of the user.

    Returns
    -------
    GapMeasurement or NoGap
        The gap with its uncertainty, or the reason why there is none.
    """
    if cv2.getNumThreads() != 1:
        cv2.setNumThreads(1)
    keep_picture_memory()
    grey = _measured_levels(frame, settings)
    return _shifted(_attempt(grey, settings, coded_picture(frame, settings)).outcome, settings.region)


def look_closely(
    frame: Frame, settings: Settings, *, only_steps: bool = False
) -> tuple[GapMeasurement | NoGap, CoarseFingers | None, EdgePoints | None]:
    """Measure one video frame and return the intermediate results, for reports on what limits the measurement.

    Parameters
    ----------
    frame : Frame
        The picture.
    settings : Settings
        Settings of the user.
    only_steps : bool
        Whether the edges stay where steps were fitted, whatever stands beside them.

    Returns
    -------
    outcome : GapMeasurement or NoGap
        Same result as `measure_frame`, in pixels of the full frame.
    fingers : CoarseFingers or None
        The fingers to the nearest pixel, in pixels of the measured region; None if none were found.
    edges : EdgePoints or None
        Sub-pixel outlines of the fingers, in pixels of the measured region; None if not measured.
    """
    if only_steps:
        settings = replace(settings, camera=replace(settings.camera, beside=STEPS_ALONE))
    attempt = _attempt(_measured_levels(frame, settings), settings, coded_picture(frame, settings))
    return _shifted(attempt.outcome, settings.region), attempt.fingers, attempt.edges


def steps_alone(frame: Frame, settings: Settings) -> tuple[Seen, bool, CoarseFingers] | None:
    """Picture and fitted steps of a frame with a gap, whether its fingers are darker than the ground, and the fingers.

    Parameters
    ----------
    frame : Frame
        The picture.
    settings : Settings
        Settings of the user.
    """
    outcome, fingers, edges = look_closely(frame, settings, only_steps=True)
    if not isinstance(outcome, GapMeasurement) or fingers is None or edges is None:
        return None
    grey = region_of_interest(blanked(to_grey(frame.pixels), settings.camera.defects), settings.region)
    return (fingers.orientation.view(grey), edges), outcome.light_gap, fingers


def steps(frame: Frame, settings: Settings) -> list[tuple[str, Pixels]]:
    """Pictures of every step for one video frame, in order, each with the size of the measured region.

    Parameters
    ----------
    frame : Frame
        The picture.
    settings : Settings
        Settings of the user.

    Returns
    -------
    list of (str, ndarray of uint8)
        Name and picture of each step: grey, denoised, binary, boundary, edges, and the measured gap.
    """
    grey = _measured_levels(frame, settings)
    denoised = denoise(grey)
    attempt = _attempt(grey, settings, coded_picture(frame, settings))
    own = Frame(in_eight_bits(grey), frame.index)
    outcome = attempt.outcome
    words = f"gap {outcome.gap_px:.3f} px" if isinstance(outcome, GapMeasurement) else outcome.words
    return [
        ("grey", in_eight_bits(grey)),
        ("denoised", in_eight_bits(denoised)),
        ("binary", attempt.binary.dark if attempt.binary is not None else binarise(denoised).dark),
        ("boundary", draw_boundary(own, attempt.fingers)),
        ("edges", draw_edge_points(own, attempt.fingers, attempt.edges)),
        ("gap", draw_overlay(own, outcome, words)),
    ]


def _measured_levels(frame: Frame, settings: Settings) -> GreyImage:
    """Grey levels of the part of a frame that is measured, without the camera's defect pixels."""
    return region_of_interest(to_grey(repaired(frame, settings.camera).pixels), settings.region)


def region_of_interest(grey: NDArray[Any], region: Region | None) -> NDArray[Any]:
    """Part of a picture that is measured."""
    if region is None:
        return grey
    rows = slice(region.y_px, region.y_px + region.height_px)
    return grey[rows, region.x_px : region.x_px + region.width_px]


@dataclass(frozen=True, slots=True)
class _Scale:
    """Full scale of the light, and the level at which the picture is clipped."""

    top: int
    highest: int


@dataclass(frozen=True, slots=True, eq=False)
class _Attempt:
    """Intermediate results of a frame's analysis: the binary picture, the fingers, their edges, and the result."""

    outcome: GapMeasurement | NoGap
    binary: Binary | None = None
    fingers: CoarseFingers | None = None
    edges: EdgePoints | None = None


def _attempt(grey: GreyImage, settings: Settings, coded: CodedPicture) -> _Attempt:
    if not settings.has_fingers:
        return _Attempt(NOT_ASKED)
    if min(grey.shape) < SMALLEST_SIDE_PX:
        return _Attempt(NoGap(Status.NO_FINGERS, "The picture is too small to contain two fingers."))
    top = _top_level(grey, settings)
    scale = _Scale(top, settings.response.cut_off_at(grey, top))
    denoised = denoise(grey)
    binary = binarise(denoised, top)
    # The full-scale pixels of the original picture are counted only if the denoised picture is nearly white.
    is_bright = binary.full_scale_share > 0.9 or scale.highest < top
    if is_bright and np.count_nonzero(grey >= scale.highest) > SATURATED_SHARE * grey.size:
        words = "The picture is white: nearly every pixel is at full scale."
        return _Attempt(NoGap(Status.SATURATED, words), binary)
    if binary.contrast < CONTRAST_FLOOR * top:
        return _Attempt(UNIFORM, binary)
    first: _Attempt | None = None
    are_edges: dict[Binary, bool] = {}
    change: GreyImage | None = None
    for split, fingers, light_gap in candidates(denoised, binary, settings):
        if isinstance(fingers, NoGap):
            if fingers.status is not Status.NO_FINGERS and split not in are_edges:
                change = local_change(denoised) if change is None else change
                are_edges[split] = has_edges(change, split, binary.contrast)
            if fingers.status is not Status.NO_FINGERS and not are_edges[split]:
                fingers = NoGap(
                    Status.NO_FINGERS, "The picture has only gradual transitions from light to dark, but no edge."
                )
            attempt = _Attempt(fingers, split)
        else:
            attempt = _measured(grey, split, fingers, light_gap, settings, coded, scale)
            attempt = _with_two_tones(attempt, grey, denoised, light_gap, settings, coded, scale)
        if isinstance(attempt.outcome, GapMeasurement) or attempt.outcome.status in FINAL:
            return attempt
        first = first or attempt
    return first or _Attempt(UNIFORM, binary)


def _measured(
    grey: GreyImage,
    split: Binary,
    fingers: CoarseFingers,
    light_gap: bool,
    settings: Settings,
    coded: CodedPicture,
    scale: _Scale,
) -> _Attempt:
    """Measure a pair of fingers; if they are rough, measure longer flanks too, and keep the more certain result.

    Where the recording has told that longer flanks are the more certain ones, they are measured alone.
    """
    upright = fingers.orientation.view(grey)
    how = (settings, scale, light_gap, coded.with_traces(grey))
    known, near = settings.camera.roughness, fingers
    if known is not None and known.are_flanks_long:
        fingers = with_longer_flanks(near, settings.below_tip_px)
    edges, outcome = _edges_and_gap(upright, fingers, *how)
    if fingers is not near and not isinstance(outcome, GapMeasurement):
        fingers = near
        edges, outcome = _edges_and_gap(upright, fingers, *how)
    if isinstance(outcome, GapMeasurement) and outcome.roughness_px:
        longer = with_longer_flanks(near, settings.below_tip_px)
        if known is None and is_surer((also := _edges_and_gap(upright, longer, *how))[1], outcome):
            fingers, (edges, outcome) = longer, also
        if isinstance(outcome, GapMeasurement) and isnan(outcome.roughness_px):
            outcome = replace(outcome, roughness_px=0.0)
        if isinstance(outcome, GapMeasurement) and outcome.u_gap_px > LEAST_SURE_PX * sqrt(coded.shared_points):
            outcome = replace(TOO_ROUGH, held=outcome.held)
    if isinstance(outcome, GapMeasurement):
        outcome = replace(outcome, u_response_px=u_gap_response_px(outcome, edges, settings.camera.response, scale.top))
    return _Attempt(outcome, split, fingers, edges)


def _edges_and_gap(
    upright: GreyImage, fingers: CoarseFingers, settings: Settings, scale: _Scale, light_gap: bool, coded: CodedPicture
) -> tuple[EdgePoints, GapMeasurement | NoGap]:
    """Fit the edges of a pair of fingers, and derive the result."""
    top, levels = scale.top, full_scale(upright) + 1
    light = _light(settings.response, top, levels, scale.highest)
    lines = visible_lines(profile_lines((fingers.left, fingers.right)), fingers)
    edges, apart_px = fit_edges(upright, lines, light, top), 0.0
    if fingers.orientation.direction.is_vertical:
        edges, apart_px = at_half_way(edges)

    def displaced_px(found: EdgePoints) -> tuple[float, float]:
        return coded.flanks_displaced_px(upright, found, fingers.orientation, light, top)

    is_unlike = _is_unlike(edges, settings.camera)
    may_be_sharpened = settings.camera.sharpening.origin is Origin.ASSUMED
    beside = settings.camera.beside
    if not _is_told_beside(settings.camera):
        edges = with_frame_profiles(upright, edges, light, top, displaced_px, may_be_sharpened=may_be_sharpened)
    if beside is not None:
        edges = moved_by_recording(upright, edges, light, beside, settings.is_outline)
    edges = with_stripes(upright, edges, light)
    outcome = measure_gap(
        fingers,
        edges,
        settings.below_tip_px,
        top,
        light_gap,
        settings.steepest,
        coded.coding,
        coded.shared_points,
        settings.camera.roughness,
    )
    if isinstance(outcome, GapMeasurement):
        outcome = coded.less_sure(outcome, upright, edges, fingers.orientation, light, top)
    if isinstance(outcome, GapMeasurement) and beside is not None:
        u_px = u_aslant_px(beside, (outcome.left.slope, outcome.right.slope))
        outcome = replace(outcome, u_shift_px=hypot(outcome.u_shift_px, u_px))
    if (apart_px or edges.beside or is_unlike) and isinstance(outcome, GapMeasurement):
        outcome = replace(outcome, fields_apart_px=apart_px, beside=edges.beside, is_unlike=is_unlike)
    return edges, outcome


def _is_unlike(edges: EdgePoints, camera: CameraModel) -> bool:
    """Whether the edges show other things beside them than the frames from which the camera was learnt."""
    if camera.usual is None:
        return False
    return any(
        abs(shown - usual) > max(UNLIKE_SIGMAS * scatter, least * usual)
        for shown, (usual, scatter), least in zip(
            (edges.unexplained, edges.widened), camera.usual, LEAST_UNLIKE, strict=True
        )
    )


def contradicts(outcome: GapMeasurement | NoGap) -> bool:
    """Whether a frame shows other things beside its edges than its recording has shown before."""
    return outcome.is_unlike if isinstance(outcome, GapMeasurement) else outcome == THIRD_TONE


def _is_told_beside(camera: CameraModel) -> bool:
    """Whether the recording has told what stands beside the edges, so that a frame need not."""
    return camera.beside is not None and camera.beside.probability > 0.5


def _with_two_tones(
    attempt: _Attempt,
    grey: GreyImage,
    denoised: GreyImage,
    light_gap: bool,
    settings: Settings,
    coded: CodedPicture,
    scale: _Scale,
) -> _Attempt:
    """Return the attempt, or a new attempt with another threshold if a shadow or pad was put into the wrong class."""
    if not isinstance(attempt.outcome, GapMeasurement) or attempt.fingers is None or attempt.edges is None:
        return attempt
    upright = attempt.fingers.orientation.view(grey)
    strip = other_threshold(upright, attempt.edges)
    if strip is None or attempt.binary is None:
        return attempt
    threshold, breadth_px = strip
    split = split_at(denoised, attempt.binary, round(threshold))
    fingers = found(split, light_gap, (attempt.fingers.orientation.direction,), settings)
    if isinstance(fingers, CoarseFingers):
        again = _measured(grey, split, fingers, light_gap, settings, coded, scale)
        if isinstance(again.outcome, GapMeasurement) and again.edges is not None:
            is_sure = again.outcome.u_gap_px < LEAST_SURE_AGAIN_PX
            # Where a window holds both ends of the strip, a single step may be fitted to either.
            is_sure = is_sure and again.edges.reach_px < breadth_px - ALONE_PX
            if is_sure and other_threshold(upright, again.edges) is None:
                return again
        elif again.outcome.status in FINAL:
            return again
    return _Attempt(THIRD_TONE, attempt.binary, attempt.fingers, attempt.edges)


def _top_level(grey: GreyImage, settings: Settings) -> int:
    """Full scale of the light, which is different for a measured camera response."""
    known = settings.response.top_level
    bits = settings.bits if known is None or grey.dtype == np.uint8 else known.bit_length()
    found = top_level(grey, bits)
    if known is not None and known != found:
        msg = (
            f"The camera response {settings.response.name} was measured on levels up to {known}, but these pictures "
            f"have levels up to {found}: measure it on pictures of this depth."
        )
        raise DataError(msg)
    return found


@lru_cache(maxsize=4)
def _light(response: CameraResponse, top: int, levels: int, highest: int) -> NDArray[np.float64]:
    return response.table(top, levels, highest)


def _shifted(measured: GapMeasurement | NoGap, region: Region | None) -> GapMeasurement | NoGap:
    """Shift a result from the region's pixel coordinates to those of the full frame."""
    if region is None:
        return measured
    return measured.shifted(region.x_px, region.y_px)
