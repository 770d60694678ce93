"""Where the fingers are in a frame, and whether their motion in the frames before leads there.

Between frames a finger moves evenly, or with an even acceleration: the straight line through its last two places, or
the parabola through its last three, leads to the next one. What neither foretells is a jump. A jump proves nothing by
itself, because stages make steps and springs vibrate; it is the occasion on which pictures are compared.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.direction import Direction
from fingervision.domain.gap import GapMeasurement

Floats = NDArray[np.float64]

# Coverage factor and least size (pixels) of a jump, in the position of an edge or a tip.
JUMP_U, LEAST_JUMP_PX = 3.0, 0.05


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """Where the fingers are in a frame.

    Parameters
    ----------
    at : float
        Number or time of the frame.
    direction : Direction
        Direction in which the tips point.
    px, u_px : ndarray, shape (4,)
        Left and right edge across the fingers, left and right tip along them, and their standard uncertainties.
    """

    at: float
    direction: Direction
    px: Floats
    u_px: Floats


def place(at: float, gap: GapMeasurement) -> Place:
    """Place of the fingers in a frame with a gap, at its number or time."""
    ends, vertical = (gap.left, gap.right), gap.direction.is_vertical
    px = [each.x_px if vertical else each.y_px for each in ends] + [each.tip_px for each in ends]
    u_px = [each.u_across_px for each in ends] + [each.u_tip_px for each in ends]
    return Place(at, gap.direction, np.array(px), np.array(u_px))


def beside_path(before: Sequence[Place], now: Place) -> tuple[Floats, Floats]:
    """Distance (pixels) of a place from the polynomial through others, and its standard uncertainty."""
    ats = [each.at for each in before]
    weights = np.array(
        [prod((now.at - other) / (own - other) for other in ats[:i] + ats[i + 1 :]) for i, own in enumerate(ats)]
    )
    px, u_px = np.array([each.px for each in before]), np.array([each.u_px for each in before])
    return now.px - weights @ px, np.sqrt(now.u_px**2 + weights**2 @ u_px**2)


def jumps(before: Sequence[Place], now: Place) -> bool:
    """Whether the motion in up to three frames before does not lead a finger to where it is.

    A parabola is followed through successive frames alone; it says nothing about a place far from its own.
    """
    if not before or now.direction is not before[-1].direction:
        return True
    paths = [before[-2:]]
    if len(before) > 2 and now.at - before[-3].at == 3:
        paths.append(before[-3:])
    return all(
        bool((np.abs(off_px) > JUMP_U * u_px + LEAST_JUMP_PX).any())
        for off_px, u_px in (beside_path(path, now) for path in paths)
    )
