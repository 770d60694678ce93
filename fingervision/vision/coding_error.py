"""Possible displacement of a whole edge by a video codec, estimated from the codec's quantiser step.

If an edge is parallel to the codec's blocks, all its rows share an error, which the scatter of the rows about a line
does not show. A block copied from an earlier picture is displaced as a whole, which is not visible in the picture
either. The quantiser step bounds this error: a coder corrects every difference larger than a fraction of the step. For
an edge of contrast A the codec's transform coefficients change by about A per pixel of displacement, so that the
displacement is a fixed fraction of `step / A`.
"""

from dataclasses import replace
from math import hypot

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Coding
from fingervision.domain.gap import GapMeasurement
from fingervision.domain.loops import loop
from fingervision.domain.quantiser import Quantiser
from fingervision.vision.edges import EdgePoints
from fingervision.vision.median import middle
from fingervision.vision.orientation import Orientation
from fingervision.vision.profile_lines import INNER

Floats = NDArray[np.float64]

# Standard uncertainty of one edge's place in units of step over contrast. Measured on drawn recordings, upright and
# leaning, 0.5 to 8 Mbit/s (`python -m tests.benchmarks.compressed_video`).
DISPLACED = 0.42
# The blocks this far across (standard deviations of the blur, and pixels more) and along the finger from the measuring
# point carry the edge.
ACROSS_SIGMAS, ACROSS_PX, ALONG_PX = 3.0, 2.0, 40.0
# Where the stream does not state its quantiser: the same in units of what the rows of a flank share. A picture that is
# coded by itself is displaced by less than one that is copied from its neighbours.
SHARED_SHIFTS = {Coding.LOSSLESS: 0.0, Coding.INTRAFRAME: 0.5, Coding.INTERFRAME: 1.5}
# The same for a picture that claims to be as the sensor saw it (saved again, enlarged, interpolated from colours): its
# rows are looked at as well, and what they share is in every frame alike, as far as anybody knows.
EVEN_SHIFTS = 2.0
# Quantisers are stated for 8 bits.
EIGHT_BITS = 255.0

_stored_difference = loop("coding_error_stored_difference")


def displaced_px(step: float, contrast: float) -> float:
    """Standard uncertainty of an edge's position (px) from a codec error that the whole edge shares.

    Parameters
    ----------
    step : float
        Quantiser step, in grey levels of an 8-bit scale.
    contrast : float
        Contrast of the edge, in grey levels of an 8-bit scale.
    """
    return DISPLACED * step / max(abs(contrast), 1.0)


def flanks_displaced_px(
    edges: EdgePoints, orientation: Orientation, quantiser: Quantiser, light: Floats, top_level: int
) -> tuple[float, float]:
    """Standard uncertainty (px) of the position of both inner flanks, from codec errors that all of their rows share.

    Parameters
    ----------
    edges : EdgePoints
        Steps that were fitted to every line, in the fingers' axes.
    orientation : Orientation
        Transformation from the fingers' axes to the picture.
    quantiser : Quantiser
        Quantiser of the picture.
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
        across, contrast = (middle(a[k, :INNER][is_seen]) for a in (edges.position, edges.contrast))
        rows = edges.lines.fixed[k, :INNER][is_seen]
        x, y = orientation.to_pixels(across, 0.5 * float(rows.min() + rows.max()))
        half_px = ACROSS_SIGMAS * float(edges.blur_px[k, 0]) + ACROSS_PX, 0.5 * float(np.ptp(rows))
        beside, along = half_px if orientation.direction.is_vertical else half_px[::-1]
        step = quantiser.near(x, y, beside, along)
        displaced.append(displaced_px(step, _stored_contrast(level, contrast, light, top_level)))
    return displaced[0], displaced[1]


def with_coding_error(
    found: GapMeasurement, quantiser: Quantiser, inside: tuple[float, float], light: Floats, top_level: int
) -> GapMeasurement:
    """Return the measurement with its uncertainty increased by possible codec errors of the two edges.

    Parameters
    ----------
    found : GapMeasurement
        Measurement in the picture's pixels.
    quantiser : Quantiser
        Quantiser of the picture.
    inside : (float, float)
        Light of the left and of the right finger beside its edge.
    light : ndarray of float, shape (levels,)
        Light for every stored level (look-up table).
    top_level : int
        Highest level of the scale.
    """
    displaced = []
    for edge, level in zip((found.left, found.right), inside, strict=True):
        across, along = ACROSS_SIGMAS * edge.blur_px + ACROSS_PX, ALONG_PX
        if not found.direction.is_vertical:
            across, along = along, across
        step = quantiser.near(edge.x_px, edge.y_px, across, along)
        displaced.append(
            displaced_px(step, _stored_contrast(level, edge.contrast, light, top_level)) * _by_slope(edge.slope)
        )
    return _less_sure(found, displaced[0], displaced[1])


def _stored_contrast(level: float, contrast: float, light: Floats, top_level: int) -> float:
    """Contrast of an edge in stored levels on an 8-bit scale, from the light inside and the change of light."""
    return float(_stored_difference(light, top_level, level, level + contrast)) * EIGHT_BITS / top_level


def _by_slope(slope: float) -> float:
    """Displacement of the measuring point across the finger per displacement of an outline along its normal.

    A leaning edge moves farther across the finger than along its own normal. The tip is displaced by its own codec
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
