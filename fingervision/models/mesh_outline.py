"""Mesh of the gripper's right half: curved quadratic triangles, fine at the notches."""

from dataclasses import dataclass

from fingervision.domain.gripper import Gripper
from fingervision.models.gripper_outline import check_outline, half_region, notch_centres_mm
from fingervision.models.triangulate import PlaneMesh, triangulate

__all__ = ["ElementSize", "PlaneMesh", "mesh_outline", "notch_centres_mm"]

_ACROSS = 0.8
"""Ratio of (triangles across a neck) to (thickness over edge length): triangles along the notch are half as long again
as across it."""
_LEAST_ACROSS = 2.0


@dataclass(frozen=True, slots=True)
class ElementSize:
    """Edge lengths of the triangles.

    Parameters
    ----------
    notch_mm : float
        Edge length at the necks of the notches; it grows with the height of the material.
    body_mm : float
        Edge length far from the notches.
    """

    notch_mm: float
    body_mm: float


def mesh_outline(gripper: Gripper, size: ElementSize) -> PlaneMesh:
    """Mesh the right half of a gripper.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    size : ElementSize
        Edge lengths.

    Returns
    -------
    PlaneMesh
        One connected body.

    Raises
    ------
    DataError, ModelError
        If the notches cut the body in two, or a hinge is not valid.
    """
    check_outline(gripper)
    across = max(_LEAST_ACROSS, _ACROSS * gripper.hinge.thickness_mm / size.notch_mm)
    return triangulate(half_region(gripper), across, size.body_mm)
