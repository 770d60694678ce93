"""Interlaced pictures: even and odd rows are exposed at two times, so that a moving finger's edge looks like a comb.

The displacement between the two fields (even and odd rows) is measured on the flanks: the edge in each row is compared
with the line through its neighbours in the other field, over all rows. The edges in every row are then moved half-way
towards the edges of the other field, so that both fields represent the mean time. Colour sensors cause similar, smaller
combs, which are not due to motion and are removed in the same way.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.edge_profile import EdgeMark
from fingervision.vision.edges import EdgePoints
from fingervision.vision.profile_lines import ROWS

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Least significant displacement between the fields, as a multiple of its uncertainty, and absolutely (pixels).
SURE, LEAST_PX = 5.0, 0.05
# Least number of compared rows, and largest distance of the rows of the other field on either side (pixels).
FEWEST_ROWS, NEAR_PX = 8, 4
# Factor from median deviation to standard deviation, number of standard deviations beyond which a row is dust, and
# factor for the correlation of neighbouring rows.
SIGMAS_IN_MEDIAN, DUST, SHARED = 1.4826, 4.0, 1.2
# Radius of a round tip: the mean of both fields deviates from the mean time's outline by up to half the variance of the
# displacement divided by this radius.
TIP_RADIUS_PX = 15.0

_apart = loop("interlace_apart")


def at_half_way(edges: EdgePoints) -> tuple[EdgePoints, float]:
    """Return the edges half-way between the two fields, and the faster finger's displacement between them (px).

    The picture's rows must be rows of `edges`, which holds if the tips point up or down.
    """
    lines = edges.lines
    apart = np.array([_apart(lines.fixed[k], edges.position[k], lines.weight[k]) for k in range(2)])
    if not apart.any():
        return edges, 0.0
    position = edges.position.copy()
    is_even = lines.fixed[:, :ROWS] % 2 == 0
    position[:, :ROWS] -= np.where(is_even, 0.5, -0.5) * apart[:, None]
    left, right = (
        EdgeMark(max(abs(mark.shift_px), 0.125 * by**2 / TIP_RADIUS_PX), mark.beyond)
        for mark, by in zip(edges.marks, apart.tolist(), strict=True)
    )
    return replace(edges, position=position, marks=(left, right)), float(np.abs(apart).max())
