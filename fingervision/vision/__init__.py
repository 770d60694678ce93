"""Image processing steps, one per file, in the order of Hricko & Havlik (2015); only ``pipeline`` knows the order.

The fits that can be used for any picture, not only for fingers, are exported here; they need NumPy, SciPy and OpenCV
only.
"""

from fingervision.vision.circle_fit import Circle, NoCircleFitError, fit_circle
from fingervision.vision.patch_reference import PatchReference, patch_reference
from fingervision.vision.patch_registration import Registered, register
from fingervision.vision.straight_edge_fit import (
    Band,
    EdgeStart,
    NoEdgeFitError,
    StraightEdges,
    fit_straight_edges,
)
from fingervision.vision.symmetry_fit import NoSymmetryError, Symmetric, fit_symmetry

__all__ = [
    "Band",
    "Circle",
    "EdgeStart",
    "NoCircleFitError",
    "NoEdgeFitError",
    "NoSymmetryError",
    "PatchReference",
    "Registered",
    "StraightEdges",
    "Symmetric",
    "fit_circle",
    "fit_straight_edges",
    "fit_symmetry",
    "patch_reference",
    "register",
]
