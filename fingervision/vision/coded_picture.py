"""What a codec has done to a picture, as its stream or the picture's own noise states it, and what it costs the gap.

Possible displacement of a whole edge by a video codec, estimated from the codec's quantiser step.

If an edge is parallel to the codec's blocks, all its rows share an error, which the scatter of the rows about a line
does not show. A block copied from an earlier picture is displaced as a whole, which is not visible in the picture
either. The quantiser step limits the error of a codec, which corrects every difference larger than a fraction of the
step. For an edge of contrast A the codec's transform coefficients change by about A per pixel of displacement, so that
the displacement is a fixed fraction of the ratio of step to contrast.

A block that the codec skips has no quantiser step of its own, but inherits the step of the preceding block (QP_Y,PRED
in ITU-T H.264 (2021), 7.4.5). The preceding block may be flat background with a step four times finer than the codec
allows an edge. The largest step along the outlines of both fingers is therefore used.
"""

from dataclasses import dataclass, replace
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Coding, Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.domain.loops import loop
from fingervision.domain.quantiser import BLOCK_PX, Quantiser
from fingervision.vision.edges import EdgePoints
from fingervision.vision.grey import GreyImage
from fingervision.vision.median import middle
from fingervision.vision.orientation import Orientation
from fingervision.vision.profile_lines import INNER, IS_ROW
from fingervision.vision.residuals import SHARED_POINTS
from fingervision.vision.settings import Settings
from fingervision.vision.shared_profile import even_shift_px, flanks, shared_shift_px
from fingervision.vision.uneven_noise import uneven_noise

Floats = NDArray[np.float64]

# Standard uncertainty of an edge's position, in units of the ratio of step to contrast. Measured in rendered recordings
# with upright and tilted fingers and 0.5 to 8 Mbit/s (`python -m tests.benchmarks.compressed_video`).
DISPLACED = 0.4
# Length of outline (pixels) that determines the position of a finger's edge: the fitted rows (`profile_lines.INNER`).
ALONG_PX = 72.0
# Distance from an outline within which blocks affect the edge: a multiple of the blur's standard deviation, plus
# pixels.
ACROSS_SIGMAS, ACROSS_PX = 3.0, 2.0
# Standard uncertainty of an edge's position for codecs whose quantiser step is unknown, in units of the common
# displacement of a flank's rows. Edges in a picture that is coded without other pictures are displaced less than edges
# in a picture that is predicted from others (the classes of HEVC, AV1 and MJPEG in `compressed_video`).
SHARED_SHIFTS = {Coding.LOSSLESS: 0.0, Coding.INTRAFRAME: 0.7, Coding.INTERFRAME: 2.0}
# Standard uncertainty of an edge's position, in the same units, for pictures without a codec, which may have been saved
# again, enlarged or interpolated from colours before; the common displacement of the rows may then be equal in all
# frames.
EVEN_SHIFTS = 2.0
# Ratio of an unknown quantiser step to the noise that it leaves (`uneven_noise`). In H.264 whose streams state the
# step, steps are 3 to 7 times the noise in the noisier blocks at 2 and 4 Mbit/s; at 8 Mbit/s they are smaller and leave
# the noise even.
STEP_TIMES = 5.0
# Full scale for which quantiser steps are stated: 8 bits.
EIGHT_BITS = 255.0

_stored_difference = loop("coded_picture_stored_difference")


def displaced_px(step: float, contrast: float, slope: float = 0.0) -> float:
    """Standard uncertainty of an edge's position along its normal (px) from a codec error that the whole edge shares.

    Parameters
    ----------
    step : float
        Quantiser step, in grey levels of an 8-bit scale.
    contrast : float
        Contrast of the edge, in grey levels of an 8-bit scale.
    slope : float
        Slope of the edge against the blocks of the codec: an edge that crosses several columns of blocks averages
        their errors, which are independent.
    """
    columns = 1.0 + abs(slope) * ALONG_PX / BLOCK_PX
    return DISPLACED * step / max(abs(contrast), 1.0) / sqrt(columns)


def outline_step(edges: EdgePoints, orientation: Orientation, quantiser: Quantiser) -> float:
    """Largest quantiser step of the blocks along both fingers' outlines, in grey levels of an 8-bit scale.

    Parameters
    ----------
    edges : EdgePoints
        Steps that were fitted to every line, in the fingers' axes.
    orientation : Orientation
        Transformation from the fingers' axes to the picture.
    quantiser : Quantiser
        Quantiser of the picture.
    """
    lines = edges.lines
    reach = ACROSS_SIGMAS * float(edges.blur_px.max()) + ACROSS_PX
    beside = (edges.position[..., None] + np.array([-reach, reach]))[lines.weight > 0]
    fixed = np.broadcast_to(lines.fixed[..., None], (*lines.fixed.shape, 2))[lines.weight > 0]
    is_row = np.broadcast_to(IS_ROW, lines.fixed.shape)[lines.weight > 0][:, None]
    x, y = orientation.points_to_pixels(np.where(is_row, beside, fixed), np.where(is_row, fixed, beside))
    return quantiser.at(x, y) if x.size else float(quantiser.step.max())


def step_from_noise(edges: EdgePoints, noise: float, light: Floats, top_level: int) -> float:
    """Quantiser step, in grey levels of an 8-bit scale, of a codec of which only the noise that it left is known.

    Parameters
    ----------
    edges : EdgePoints
        Steps that were fitted to every line. The codec's own errors are noise at the edges, and count if they exceed
        the noise elsewhere.
    noise : float
        Standard deviation of the noise in flat parts (stored levels; `uneven_noise`).
    light : ndarray of float, shape (levels,)
        Light for every stored level (look-up table).
    top_level : int
        Highest level of the scale.
    """
    at_edges = [0.0]
    for k, level in enumerate(edges.inside):
        is_seen = edges.lines.weight[k, :INNER] > 0
        if np.any(is_seen):
            contrast = middle(edges.contrast[k, :INNER][is_seen])
            stored = _stored_contrast(level, contrast, light, top_level)
            at_edges.append(edges.noise * abs(stored / contrast) if contrast else 0.0)
    return STEP_TIMES * max(noise * EIGHT_BITS / top_level, *at_edges)


def flanks_displaced_px(edges: EdgePoints, step: float, light: Floats, top_level: int) -> tuple[float, float]:
    """Standard uncertainty (px) of the position of both inner flanks, from codec errors that all of their rows share.

    Parameters
    ----------
    edges : EdgePoints
        Steps that were fitted to every line.
    step : float
        Quantiser step along the outlines (`outline_step`).
    light : ndarray of float, shape (levels,)
        Light for every stored level (look-up table).
    top_level : int
        Highest level of the scale.
    """
    displaced = []
    for k, level in enumerate(edges.inside):
        is_seen = edges.lines.weight[k, :INNER] > 0
        if not np.any(is_seen):
            displaced.append(0.0)
            continue
        contrast = middle(edges.contrast[k, :INNER][is_seen])
        displaced.append(displaced_px(step, _stored_contrast(level, contrast, light, top_level)))
    return displaced[0], displaced[1]


def with_coding_error(
    found: GapMeasurement, step: float, inside: tuple[float, float], light: Floats, top_level: int
) -> GapMeasurement:
    """Return the measurement with its uncertainty increased by possible codec errors of the two edges.

    Parameters
    ----------
    found : GapMeasurement
        Measurement in the picture's pixels.
    step : float
        Quantiser step along the outlines (`outline_step`).
    inside : (float, float)
        Light of the left and of the right finger beside its edge.
    light : ndarray of float, shape (levels,)
        Light for every stored level (look-up table).
    top_level : int
        Highest level of the scale.
    """
    left, right = (
        displaced_px(step, _stored_contrast(level, edge.contrast, light, top_level), edge.slope) * _by_slope(edge.slope)
        for edge, level in zip((found.left, found.right), inside, strict=True)
    )
    return _less_sure(found, left, right)


def _stored_contrast(level: float, contrast: float, light: Floats, top_level: int) -> float:
    """Contrast of an edge in stored levels on an 8-bit scale, from the light inside and the change of light."""
    return float(_stored_difference(light, top_level, level, level + contrast)) * EIGHT_BITS / top_level


def _by_slope(slope: float) -> float:
    """Displacement of the measuring point across the finger per displacement of an outline along its normal.

    A tilted edge moves farther across the finger than along its normal. The tip is displaced by its own codec
    error as well, and shifts the measuring height along the edge.
    """
    return hypot(hypot(1.0, slope), slope)


def with_shared_shift(found: GapMeasurement, shared_px: float, coding: Coding) -> GapMeasurement:
    """Return the measurement with its uncertainty increased, for a codec whose quantiser step is not known.

    Parameters
    ----------
    found : GapMeasurement
        The measurement.
    shared_px : float
        Common displacement of a flank's rows (`shared_profile.shared_shift_px`).
    coding : Coding
        Coding of the picture.
    """
    return _less_sure(found, SHARED_SHIFTS[coding] * shared_px, SHARED_SHIFTS[coding] * shared_px)


def _less_sure(found: GapMeasurement, left_px: float, right_px: float) -> GapMeasurement:
    left, right = (
        replace(edge, u_across_px=hypot(edge.u_across_px, u))
        for edge, u in ((found.left, left_px), (found.right, right_px))
    )
    u_coding = hypot(left_px, right_px)
    return replace(found, left=left, right=right, u_gap_px=hypot(found.u_gap_px, u_coding), u_coding_px=u_coding)


@dataclass(frozen=True, slots=True, eq=False)
class CodedPicture:
    """Effects of a codec on the measured region of a picture.

    Parameters
    ----------
    coding : Coding
        Coding of the picture, as its source states it.
    quantiser : Quantiser or None
        Quantiser steps, if the stream states them.
    noise_left : float
        Noise that an unknown earlier codec has left (stored levels); 0 if no trace of a codec was found.
    """

    coding: Coding
    quantiser: Quantiser | None = None
    noise_left: float = 0.0

    @property
    def shared_points(self) -> float:
        """Number of neighbouring points whose noise has a share of the codec; 1 if the quantiser states that share."""
        return SHARED_POINTS[self.coding if self.quantiser is None else Coding.LOSSLESS]

    def with_traces(self, grey: GreyImage) -> "CodedPicture":
        """Return the same, with the noise that an earlier codec has left, if the source states no codec."""
        if self.coding is not Coding.LOSSLESS or self.quantiser is not None:
            return self
        return replace(self, noise_left=uneven_noise(grey))

    def flanks_displaced_px(
        self, upright: GreyImage, edges: EdgePoints, orientation: Orientation, light: Floats, top_level: int
    ) -> tuple[float, float]:
        """Standard uncertainty (px) of both inner flanks' positions from codec errors that all of their rows share."""
        step = self._step(edges, orientation, light, top_level)
        if step is not None:
            return flanks_displaced_px(edges, step, light, top_level)
        if self.coding is Coding.LOSSLESS:
            return 0.0, 0.0
        alike_px = SHARED_SHIFTS[self.coding] * shared_shift_px(flanks(upright, edges, light))
        return alike_px, alike_px

    def less_sure(
        self,
        found: GapMeasurement,
        upright: GreyImage,
        edges: EdgePoints,
        orientation: Orientation,
        light: Floats,
        top_level: int,
    ) -> GapMeasurement:
        """Return the measurement with its uncertainty increased by possible errors of the codec.

        Parameters
        ----------
        found : GapMeasurement
            The measurement in the picture's pixels.
        upright : ndarray, shape (rows, columns)
            Grey levels of the picture, turned so that the tips point up.
        edges : EdgePoints
            Steps that were fitted to every line.
        orientation : Orientation
            Transformation from the fingers' axes to the picture.
        light : ndarray of float, shape (levels,)
            Light for every stored level (look-up table).
        top_level : int
            Highest level of the scale.
        """
        step = self._step(edges, orientation, light, top_level)
        if step is not None:
            found = with_coding_error(found, step, edges.inside, light, top_level)
        if self.quantiser is not None:
            return found
        if self.coding is not Coding.LOSSLESS:
            return with_shared_shift(found, shared_shift_px(flanks(upright, edges, light)), self.coding)
        if edges.beside:  # a structure beside an edge has its own contribution
            return found
        u_alike = sqrt(2.0) * EVEN_SHIFTS * even_shift_px(flanks(upright, edges, light))
        return replace(found, u_shift_px=hypot(found.u_shift_px, u_alike))

    def _step(self, edges: EdgePoints, orientation: Orientation, light: Floats, top_level: int) -> float | None:
        """Quantiser step along the outlines (8-bit grey levels), stated or estimated; None if neither is known."""
        if self.quantiser is not None:
            return outline_step(edges, orientation, self.quantiser)
        return step_from_noise(edges, self.noise_left, light, top_level) if self.noise_left else None


def coded_picture(frame: Frame, settings: Settings) -> CodedPicture:
    """Effects of a codec on the measured region of a frame, as its source states them."""
    quantiser, region = frame.quantiser, settings.region
    if quantiser is not None and region is not None:
        quantiser = quantiser.seen_from(region.x_px, region.y_px)
    return CodedPicture(frame.coding, quantiser)
