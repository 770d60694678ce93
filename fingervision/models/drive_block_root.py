"""How the drive block yields under the shuttle bar that it carries: what the bar's own compliance leaves out.

The block is hardly larger than the bar is wide, so that no formula of a root on a half plane (O'Donnell, J. Appl. Mech.
27 (1960) 764) holds. It is meshed with a stub of the bar, as long as Saint-Venant's principle asks, held at its drive
face and on the symmetry axis; of the compliance at the stub's end the bar's own is taken off. That is geometry alone,
and is computed once per block.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import Gripper, Material, PointMm
from fingervision.models.body_frames import face_frame, section_frame
from fingervision.models.condensed_bodies import condensed
from fingervision.models.gripper_mechanism import right_of_axis
from fingervision.models.hinge_compliance import bar_compliance
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_shapes import Polygon, bar, box
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.triangulate import triangulate

Array = NDArray[np.float64]

_PLANAR = np.ix_([0, 1, 5], [0, 1, 5])
_STUB = 1.5
"""Widths of the bar: a self-balanced load has decayed to 0.2 % there (Timoshenko and Goodier, article 26)."""
_ACROSS, _BODY = 2.0, 0.12
"""Triangles across and edge length over the size: within 2 % of a mesh twice as fine, which is
0.01 % of the gap per input of the paper's sample."""
_NEAR = 1e-7
_LEAST = 1e-3
"""Of the largest eigenvalue: no direction is stiffer than that, which keeps the frame well conditioned."""


def drive_block_compliance(gripper: Gripper, entry_mm: PointMm) -> Array:
    """Compliance that the drive block adds at the place where the shuttle's axis enters it.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    entry_mm : (float, float)
        Where bars and block are taken to meet.

    Returns
    -------
    ndarray of float, shape (3, 3)
        Motion x, y, rotation by load there, in the ground's axes.
    """
    links, lever, material = gripper.links, gripper.lever, gripper.material
    unit = _unit_compliance(
        links.drive_block_mm, links.shuttle_from_mm, links.shuttle_to_mm, links.shuttle_width_mm, entry_mm,
        lever.drive_face_y_mm, lever.drive_face_half_width_mm, material.poisson_ratio,
    )  # fmt: skip
    return unit / (material.youngs_modulus_mpa * gripper.body.plate_mm)


@lru_cache(maxsize=256)
def _unit_compliance(
    block_mm: tuple[float, float, float, float],
    start_mm: PointMm,
    end_mm: PointMm,
    width_mm: float,
    entry_mm: PointMm,
    face_y_mm: float,
    face_half_mm: float,
    poisson: float,
) -> Array:
    """The same by unit modulus and plate thickness."""
    material = Material("unit", 1.0, poisson, 1.0, 1.0)
    entry = np.array(entry_mm)
    along = np.subtract(end_mm, start_mm) / np.hypot(*np.subtract(end_mm, start_mm))
    stub_mm = _STUB * width_mm
    section = entry + stub_mm * along
    shapes = (box(*block_mm), bar(*start_mm, float(section[0]), float(section[1]), width_mm))
    region = PlanarRegion(
        tuple((True, Polygon(right_of_axis(shape.corners_mm))) for shape in shapes), ((face_half_mm, face_y_mm),)
    )
    size = region.size_mm
    plate = PlaneStressPlate(triangulate(region, _ACROSS, _BODY * size), material, 1.0)
    x, y = plate.nodes_mm
    outline = np.unique(plate.outline_edges)
    on_face = outline[(np.abs(y[outline] - face_y_mm) < _NEAR * size) & (x[outline] <= face_half_mm + _NEAR * size)]
    on_axis = outline[np.abs(x[outline]) < _NEAR * size]
    taken: set[int] = set()
    frames = [
        face_frame(plate, on_face, ("y",), taken)[0],
        face_frame(plate, on_axis, ("x",), taken)[0],
        section_frame(plate, section, along, 1.1 * width_mm, _NEAR * size),
    ]
    K = condensed(plate, np.arange(plate.unknowns), frames, range(3)).stiffness_n_mm
    # Held: y and the turn of the drive face, x and the turn of the axis; the faces slide.
    moving = np.array([0, 4, 6, 7, 8])
    whole = np.linalg.inv(K[np.ix_(moving, moving)])[2:, 2:]
    c, s = along
    axes = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    own = axes @ bar_compliance(stub_mm, width_mm, 1.0, material)[_PLANAR] @ axes.T
    back = np.array([[1.0, 0.0, stub_mm * s], [0.0, 1.0, -stub_mm * c], [0.0, 0.0, 1.0]])
    root = back @ (whole - own) @ back.T
    values, vectors = np.linalg.eigh(0.5 * (root + root.T))
    return np.asarray(vectors @ np.diag(np.maximum(values, _LEAST * values.max())) @ vectors.T)
