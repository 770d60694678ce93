"""Interlaced pictures: even and odd rows were seen at two times, and a finger that moves shows it as a comb.

The flanks of each finger say how far apart the two fields see it: a row against the line between its neighbours of the
other field, over all rows. Every row is then moved half-way to the other field, so that both speak of the time in the
middle. Colour sensors leave such combs as well, smaller ones, which are none of motion and go the same way.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.vision.edge_profile import EdgeMark
from fingervision.vision.edges import EdgePoints
from fingervision.vision.median import middle
from fingervision.vision.profile_lines import ROWS

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Fields differ where their difference is so many times its uncertainty, and at least this (pixels).
SURE, LEAST_PX = 5.0, 0.05
# Rows that are compared: at least so many, each with a row of the other field within so many pixels to either side.
FEWEST_ROWS, NEAR_PX = 8, 4
# Robust standard deviation; rows farther than so many of them are dust. Their scatter is shared by neighbours in part.
SIGMAS_IN_MEDIAN, DUST, SHARED = 1.4826, 4.0, 1.2
# Where the tip is round, the two fields' mean lies beside the middle by up to half their variance over the radius.
TIP_RADIUS_PX = 15.0


def at_half_way(edges: EdgePoints) -> tuple[EdgePoints, float]:
    """The same edges half-way between the two fields, and how far these see the faster finger apart (pixels).

    The picture's rows must be rows of `edges`, which they are where the tips point up or down.
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


@compiled
def _apart(fixed: Ints, position: Floats, weight: Floats) -> float:
    """How much farther right the even rows see one finger's flanks than the odd rows do; 0 where they agree."""
    found, count = np.empty(ROWS), 0
    for b in range(1, ROWS - 1):
        a, c = b - 1, b + 1
        if weight[a] == 0.0 or weight[b] == 0.0 or weight[c] == 0.0:
            continue
        before, after = fixed[b] - fixed[a], fixed[c] - fixed[b]
        if before * after <= 0 or before % 2 == 0 or after % 2 == 0 or abs(before) > NEAR_PX or abs(after) > NEAR_PX:
            continue
        between = (position[a] * after + position[c] * before) / (before + after)
        found[count] = (position[b] - between) * (1.0 if fixed[b] % 2 == 0 else -1.0)
        count += 1
    if count < FEWEST_ROWS:
        return 0.0
    usual = middle(found[:count])
    spread = SIGMAS_IN_MEDIAN * middle(np.abs(found[:count] - usual)) + 1e-6
    total, used = 0.0, 0
    for i in range(count):
        if abs(found[i] - usual) < DUST * spread:
            total += found[i]
            used += 1
    mean = total / max(used, 1)
    # One row against the mean of two has 3/2 of its variance; the difference of two halves of n rows 4/n of it.
    u_mean = SHARED * spread * np.sqrt(4.0 / 1.5 / max(used, 1))
    return mean if abs(mean) > max(SURE * u_mean, LEAST_PX) else 0.0
