"""A strip of a third tone along the fingers' sides: a drop shadow with a hard edge, or a pad.

A threshold assigns a strip of a third tone either to the fingers or to the background, so that the measured outline may
be that of the shadow, or that of the finger behind its pad. A shadow lies on the same side of both fingers; pads face
each other. A strip that is assigned to the fingers on one inner side only is therefore a shadow. If strips are
assigned to the background on both inner sides and on no outer side, they are a pair of pads. In both cases the
threshold was wrong.
"""

from math import ceil

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gap import NoGap
from fingervision.domain.loops import loop
from fingervision.domain.status import Status
from fingervision.vision.edges import EdgePoints
from fingervision.vision.grey import GreyImage
from fingervision.vision.median import median
from fingervision.vision.profile_lines import INNER, ROWS

Floats = NDArray[np.float64]

# Extent of a side's profile inwards and outwards (pixels), and largest number of rows whose median it is; it ends where
# fewer than the last number of rows lie in the picture and in this finger's half of the gap.
REACH_PX, MOST_ROWS, FEWEST_ROWS = 40, 24, 6
# Least step at the end of a strip, as a share of the edge's contrast, within this number of pixels; strips are searched
# from a pixel beyond this multiple of the blur's standard deviation on, where 3 % of the edge are left.
LEAST_STEP, STEP_PX, BLURRED_SIGMAS = 0.12, 6, 1.5
# Fingers have a uniform tone if the ratio of the edge fits' residuals to the noise of the picture's flat parts is below
# the first value. Beside such fingers, steps down to the second value (share of the contrast) are accepted, if the
# levels at the ends of the shadow's two strips differ by less than the third value (share of the contrast; 0.06 where
# the end lies within the blur of an edge found in the middle of the strip), because a shadow has a uniform tone, too.
ONE_TONE, LEAST_SHADE, ALIKE = 1.3, 0.05, 0.08

THIRD_TONE = NoGap(
    Status.NO_FINGERS,
    "A strip of a third tone (a shadow or a pad) lies along the fingers: light the fingers from behind or from all "
    "sides, so that fingers and background each have a uniform tone.",
)

_strips = loop("third_tone_strips")


def other_threshold(upright: GreyImage, edges: EdgePoints) -> tuple[float, float] | None:
    """Threshold that puts a strip of a third tone into the right class, and the strip's breadth (pixels).

    The result is None if no strip is in the wrong class.

    Parameters
    ----------
    upright : ndarray, shape (rows, columns)
        Grey levels of the picture, turned so that the tips point up.
    edges : EdgePoints
        Edges at which the fingers were measured.
    """
    near, lines = 1 + ceil(BLURRED_SIGMAS * float(edges.blur_px[:, 1].max())), edges.lines
    seen = (upright, lines.fixed, edges.position, lines.weight, lines.outward)
    room = _room(edges)
    is_plain = edges.noise < ONE_TONE * edges.noise_flat
    least = LEAST_SHADE if is_plain else LEAST_STEP
    inner = [_strips(*seen, k, 0, INNER, near, room, least) for k in range(2)]
    is_in, is_out = ([strip[way] > 0 for strip in inner] for way in (0, 2))
    if is_in[0] == is_in[1] and not all(is_out):
        return None
    outer = [_strips(*seen, k, INNER, ROWS, near, REACH_PX, least) for k in range(2)]
    if is_in[0] != is_in[1]:
        k = 0 if is_in[0] else 1
        # The same shadow falls outside the other finger, if that side is in view.
        is_in_view = (lines.weight[1 - k, INNER:ROWS] > 0).any()
        contrast = median(np.abs(edges.contrast[k, :INNER][lines.weight[k, :INNER] > 0]))
        alike = ALIKE * contrast if is_plain else np.inf
        is_alike = outer[k][0] == 0 < outer[1 - k][0] and abs(outer[1 - k][0] - inner[k][0]) < alike
        if is_alike or not is_in_view:
            return float(inner[k][0]), float(inner[k][1])
    breadth_px = float(min(inner[0][3], inner[1][3]))
    # A strip within the window of the fitted steps may be a side wall.
    is_apart = breadth_px > edges.reach_px + 0.5 * STEP_PX
    if is_apart and all(is_out) and not any(strip[2] > 0 for strip in outer):
        return 0.5 * float(inner[0][2] + inner[1][2]), breadth_px
    return None


def _room(edges: EdgePoints) -> int:
    """Half of the distance between the fingers' inner edges (pixels)."""
    inner = [edges.position[j, :INNER][edges.lines.weight[j, :INNER] > 0] for j in range(2)]
    if min(inner[0].size, inner[1].size) == 0:
        return 0
    return int(min(0.5 * abs(median(inner[1]) - median(inner[0])), REACH_PX))
