"""One half of the gripper as a meshed plate: its supports, guide, drive and measuring point.

The lower face of the pillar is clamped, points on the symmetry axis cannot move sideways, and the drive face moves by
the input.
"""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Gripper
from fingervision.models.driven_body import DrivenBody
from fingervision.models.plane_stress import PlaneStressPlate

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_ON_MM = 1e-7


def half_plate(gripper: Gripper, plate: PlaneStressPlate) -> DrivenBody:
    """Apply supports and drive to the meshed right half.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    plate : PlaneStressPlate
        The meshed right half.

    Raises
    ------
    DataError
        If the mesh has no node on the clamp, the symmetry axis, the drive face or the tip's inner face.
    """
    links, lever = gripper.links, gripper.lever
    x, y = plate.nodes_mm
    clamped = np.abs(y - links.pillar_and_root_mm[2]) < _ON_MM
    clamped &= (x >= links.pillar_and_root_mm[0] - _ON_MM) & (x <= links.pillar_and_root_mm[1] + _ON_MM)
    axis = np.abs(x) < _ON_MM
    driven = (np.abs(y - lever.drive_face_y_mm) < _ON_MM) & (x <= lever.drive_face_half_width_mm + _ON_MM)
    for name, nodes in (("lower face of the pillar", clamped), ("symmetry axis", axis), ("drive face", driven)):
        if not nodes.any():
            raise DataError(f"The body must reach the {name}, but has no material there; check the links.")
    held = np.concatenate([plate.x_dofs[clamped | axis], plate.y_dofs[clamped]])
    held_swaying = np.concatenate([plate.x_dofs[clamped], plate.y_dofs[clamped | axis]])
    moved = plate.y_dofs[driven]
    edges = _inner_face(gripper, plate)
    face = np.unique(edges)
    nodes, weights = _measuring_point(gripper, plate, edges)
    return DrivenBody(
        stiffness_n_mm=plate.stiffness_n_mm,
        assemble_mass=lambda: plate.mass_t,
        tangent=plate.internal_force_n,
        driven=moved,
        free=np.setdiff1d(np.arange(plate.unknowns), np.concatenate([held, moved])),
        swaying=np.setdiff1d(np.arange(plate.unknowns), held_swaying),
        face=plate.x_dofs[face],
        face_rest_mm=x[face],
        measured=plate.x_dofs[nodes],
        weights=weights,
        measured_rest_mm=gripper.measuring_point_mm[0],
        nodes=np.column_stack([plate.x_dofs, plate.y_dofs]),
        nodes_mm=plate.nodes_mm.T,
        nodal_force=plate.nodal_force_n,
    )


def _inner_face(gripper: Gripper, plate: PlaneStressPlate) -> Indices:
    """Edges of the tip's inner face, each by the indices of its two end nodes and its middle node, shape (3, k)."""
    x, y = plate.nodes_mm
    edges = plate.outline_edges
    upright = np.all(np.abs(x[edges] - gripper.tip_corner_mm[0]) < _ON_MM, axis=0)
    on_face = upright & np.all(y[edges] >= gripper.tip_heel_mm[1] - _ON_MM, axis=0)
    if not on_face.any():
        raise DataError(
            "The tip's inner face must be an upright edge of the outline, but other links cover it; check the links."
        )
    return edges[:, on_face]


def _measuring_point(gripper: Gripper, plate: PlaneStressPlate, edges: Indices) -> tuple[Indices, Array]:
    """Nodes of the edge that contains the measuring point, and quadratic weights that interpolate the motion there."""
    y = plate.nodes_mm[1]
    y_mm = gripper.measuring_point_mm[1]
    ends = np.sort(y[edges[:2]], axis=0)
    nodes = edges[:, int(np.argmax((ends[0] <= y_mm + _ON_MM) & (ends[1] >= y_mm - _ON_MM)))]
    a, b, _ = y[nodes]
    s = (y_mm - a) / (b - a)
    return nodes, np.array([(1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s)])
