"""Packaged mesh of the reference outline: it saves half a second of meshing for the published gripper."""

from dataclasses import dataclass, replace
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import Gripper, Hinge, Lever, Links
from fingervision.models.gripper_mechanism import check_outline, half_region, notch_centres_mm
from fingervision.models.triangulate import PlaneMesh, triangulate

# Mesh of the gripper's right half: curved quadratic triangles, fine at the notches.

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


REFERENCE_HINGE = Hinge(thickness_mm=1.0, radius_mm=4.0, web_mm=9.0)
REFERENCE_LEVER = Lever(
    l1_mm=0.0,
    l2_mm=17.82,
    l3_mm=19.43,
    l4_mm=17.68,
    hinge1_mm=(35.5, 30.0),
    hinge1_axis_deg=90.0,
    hinge2_mm=(17.68, 30.0),
    hinge2_axis_deg=47.7,
    drive_mm=(0.0, 10.57),
    drive_face_y_mm=2.57,
    drive_face_half_width_mm=7.0,
)
REFERENCE_LINKS = Links(
    pillar_and_root_mm=(31.0, 40.0, 0.0, 45.0),
    shuttle_from_mm=(0.0, 10.57),
    shuttle_to_mm=(27.10, 40.35),
    shuttle_width_mm=9.0,
    drive_block_mm=(0.0, 7.0, 2.57, 18.57),
    cross_bar_mm=(40.0, 41.0, 22.10, 41.0),
    cross_bar_width_mm=8.0,
    finger_mm=(25.10, 39.0, 9.5, 88.0),
    finger_width_mm=9.0,
    tip_polygon_mm=((2.0, 100.0), (2.0, 92.0), (6.0, 80.0), (15.0, 84.0), (9.0, 100.0)),
)

# Edge lengths relative to the hinge's thickness and to the body's height. The mesh of the reference gripper (1 mm and
# 100 mm) then has 18 000 unknowns. Its slope is within 0.005 %, and its force within 0.02 %, of the limit of fine
# meshes.
_NOTCH_PER_THICKNESS = 0.2
_BODY_PER_HEIGHT = 0.02


def working_size(gripper: Gripper) -> ElementSize:
    """Edge lengths scaled to the drawing, fine enough that the reference force is within 0.02 % of its limit."""
    return ElementSize(
        _NOTCH_PER_THICKNESS * gripper.hinge.thickness_mm,
        _BODY_PER_HEIGHT * gripper.body.height_mm,
    )


def is_reference(gripper: Gripper) -> bool:
    """Whether a drawing has the outline of the published gripper; material and plate thickness may differ."""
    outline = (replace(gripper.hinge, web_mm=REFERENCE_HINGE.web_mm), gripper.lever, gripper.links)
    return outline == (REFERENCE_HINGE, REFERENCE_LEVER, REFERENCE_LINKS)


def mesh_of(gripper: Gripper) -> PlaneMesh:
    """Return the packaged mesh if the outline is that of the reference, else a new mesh.

    Raises
    ------
    DataError, ModelError
        If the outline is not that of a valid gripper.
    """
    if not is_reference(gripper):
        return mesh_outline(gripper, working_size(gripper))
    path = resources.files("fingervision.models").joinpath("reference_mesh.npz")
    with path.open("rb") as file, np.load(file) as stored:
        return PlaneMesh(stored["nodes_mm"], stored["triangles"].astype(np.int64))


def write_reference_mesh(gripper: Gripper, path: str) -> None:
    """Regenerate the packaged mesh from the reference gripper."""
    mesh = mesh_outline(gripper, working_size(gripper))
    np.savez_compressed(path, nodes_mm=mesh.nodes_mm, triangles=mesh.triangles.astype(np.int32))


# Table 1 of Hricko & Havlik (2015): the two published models and the only measurement of the real gripper.
#
# Source: American Journal of Mechanical Engineering 3(6), 2015, 201-206, table 1, with the digits as printed. No
# parameter of a model is fitted to the table.

Array = NDArray[np.float64]

INPUT_MM: Array = np.array(
    [-0.57, -0.51, -0.42, -0.30, -0.18, -0.09, 0.0, 0.15, 0.30, 0.45, 0.60, 0.75, 0.90, 1.05, 1.20, 1.50, 1.59]
)
SIMMECHANICS_MM: Array = np.array([
    0.075000, 0.487700, 1.107000, 1.993000, 2.760000, 3.938000, 4.000000, 5.340000, 6.690000, 7.105000, 8.141000,
    9.177000, 10.210000, 11.250000, 12.290000, 14.360000, 14.990000,
])  # fmt: skip
COMSOL_MM: Array = np.array([
    -0.023242, 0.062176, 0.757087, 1.683635, 2.610182, 3.305093, 4.000004, 5.158188, 6.316373, 7.474558, 8.632742,
    9.790927, 10.949112, 12.107296, 13.265481, 15.581850, 16.276761,
])  # fmt: skip
EXPERIMENT_MM: Array = np.array([
    0.441180, 0.470590, 1.088000, 2.352900, 3.117600, 3.792500, 4.000000, 5.852900, 6.764600, 7.940000, 8.823500,
    10.441200, 11.558800, 12.500000, 13.705900, 15.823500, 17.050000,
])  # fmt: skip
