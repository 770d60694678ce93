"""Two fingers of different shape: one with straight sides and corners (a chamfer), the other with fillets.

Usually both fingers are measured by the same method, so that their systematic errors are equal. A chamfer is no fillet,
though: the shape with fillets would be wrong by pixels, and what it leaves looks like roughness.
"""

from collections.abc import Sequence

import numpy as np

from fingervision.vision.finger_end import FingerEnd
from fingervision.vision.measuring_point import MeasuringPoint
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.polygonal_outline import polygonal_measuring_point
from fingervision.vision.roughness import SUSPECT, roughness

Chains = tuple[MeasuringPoint | None, MeasuringPoint | None]

NO_CHAINS: Chains = (None, None)
# Share of a finger's points that its fillets may leave aside as dust; with more, its outline has another shape as well.
MOST_ASIDE = 0.1


def polygonal(points: tuple[OutlinePoints, OutlinePoints], below_tip_px: float, shared: float) -> Chains:
    """Measuring point of each finger from straight sides with corners; None for a finger of another shape.

    Parameters
    ----------
    points : (OutlinePoints, OutlinePoints)
        Sub-pixel outlines of both fingers.
    below_tip_px : float
        Distance of the measuring point below the tip.
    shared : float
        Number of neighbouring points that share an error.
    """
    left, right = (polygonal_measuring_point(p, below_tip_px, shared) for p in points)
    return left, right


def explains_roughness(
    chains: Chains, points: tuple[OutlinePoints, OutlinePoints], ends: tuple[FingerEnd, FingerEnd], deviation_px: float
) -> bool:
    """Whether corners explain what looks like roughness: both fingers have some, or the one that has none is smooth.

    Corners that determine the edge of a finger less well than a single point of a rough edge would do explain nothing.

    Parameters
    ----------
    chains : (MeasuringPoint or None, MeasuringPoint or None)
        Result of `polygonal`.
    points, ends : (OutlinePoints, OutlinePoints), (FingerEnd, FingerEnd)
        Outlines of both fingers, and the shapes with fillets that were fitted to them.
    deviation_px : float
        Standard deviation of the edges about these shapes, if it is roughness.
    """
    others = [k for k in range(2) if chains[k] is None]
    if len(others) == 1:
        (k,) = others
        own = chains[1 - k]
        if own is None or own.covariance[1, 1] > deviation_px**2:
            return False
        return ends[k].misfit < SUSPECT and roughness((points[k],), (ends[k],)) is None
    return not others


def chain_of_one(
    chains: Chains, ends: tuple[FingerEnd, FingerEnd], holds: Sequence[bool], cuts_px: Sequence[float]
) -> Chains:
    """The measuring point from straight sides of the only finger that has corners; no point if fillets serve as well.

    Fillets must describe the other finger down to its noise, because the fingers of one gripper are usually alike.

    Parameters
    ----------
    chains, ends : (MeasuringPoint or None, MeasuringPoint or None), (FingerEnd, FingerEnd)
        Result of `polygonal`, and the shapes with fillets of both fingers.
    holds : sequence of bool
        Whether the shape with fillets describes each finger.
    cuts_px : sequence of float
        Distance of the corner's rejected points from this shape (pixels); 0 if only a few were rejected.
    """
    is_filleted = [
        does_hold and end.misfit < SUSPECT and np.mean(end.robust <= 0.0) < MOST_ASIDE
        for does_hold, end in zip(holds, ends, strict=True)
    ]
    left, right = (chains[k] if chains[1 - k] is None and is_filleted[1 - k] else None for k in range(2))
    return left if not holds[0] or cuts_px[0] else None, right if not holds[1] or cuts_px[1] else None
