"""One image step a file, in the paper's order; ``pipeline`` alone knows the order.

The fits that serve any picture are public here; they need NumPy, SciPy and OpenCV only.
"""

from fingervision.vision.patch_registration import PatchReference, Registered, patch_reference, register
from fingervision.vision.straight_edge_fit import (
    Band,
    EdgeStart,
    NoEdgeFitError,
    StraightEdges,
    fit_straight_edges,
)

__all__ = [
    "Band",
    "EdgeStart",
    "NoEdgeFitError",
    "PatchReference",
    "Registered",
    "StraightEdges",
    "fit_straight_edges",
    "patch_reference",
    "register",
]
