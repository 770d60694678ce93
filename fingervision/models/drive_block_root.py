"""Extra compliance where the shuttle bar joins the drive block, because the block itself deforms.

The block is hardly larger than the bar is wide, so that the formula for a bar rooted in a half plane (O'Donnell, 1960,
Journal of Applied Mechanics 27, 764) does not hold. The block is meshed with a stub of the bar, as long as
Saint-Venant's principle requires, fixed at its drive face and on the symmetry axis; the bar's own compliance is
subtracted from the compliance at the stub's end. For unit modulus, the compliance of a block depends on its geometry
only, and is computed once per block.
"""

from dataclasses import dataclass
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
"""Length of the stub in widths of the bar: a self-balanced load has decayed to 0.2 % there (Timoshenko and Goodier,
article 26)."""
_ACROSS, _BODY = 2.0, 0.12
"""Triangles across the thinnest part, and edge length over the block's size: the compliance is then within 2 % of that
of a mesh twice as fine, which changes the gap per input of the published sample by 0.01 %."""
_DIGITS = 12
"""Digits to which the dimensions of a block are rounded, so that drawings that differ by rounding share one block."""
_NEAR = 1e-7
_LEAST = 1e-3
"""Least eigenvalue of the compliance as a share of the largest: it bounds the stiffness in every direction, which keeps
the frame's equations well conditioned."""


@dataclass(frozen=True, slots=True)
class BlockShape:
    """Dimensions of block and shuttle, divided by the shuttle's width; the origin is the centre of the drive face.

    Parameters
    ----------
    half_width, low, high : float
        Half width of the block, and the positions of its lower and upper side.
    start, end : (float, float)
        Ends of the shuttle's axis.
    face_half : float
        Half width of the drive face.
    poisson : float
        Poisson's ratio of the material.
    """

    half_width: float
    low: float
    high: float
    start: PointMm
    end: PointMm
    face_half: float
    poisson: float

    @property
    def numbers(self) -> tuple[float, ...]:
        """All dimensions of the block as one row of numbers."""
        return (self.half_width, self.low, self.high, *self.start, *self.end, self.face_half, self.poisson)

    @property
    def entry(self) -> PointMm:
        """Point where the shuttle's axis enters the block."""
        (xa, ya), (xb, yb) = self.start, self.end
        return self.half_width, ya + (yb - ya) * (self.half_width - xa) / (xb - xa)


def block_shape(gripper: Gripper) -> BlockShape:
    """Dimensions of block and shuttle from a drawing."""
    links, lever = gripper.links, gripper.lever
    width_mm, face_y_mm = links.shuttle_width_mm, lever.drive_face_y_mm
    _, half_mm, low_mm, high_mm = links.drive_block_mm

    def placed(x: float, y: float) -> PointMm:
        return round(x / width_mm, _DIGITS), round((y - face_y_mm) / width_mm, _DIGITS)

    start = placed(*links.shuttle_from_mm)
    x, y = np.subtract(placed(*links.shuttle_to_mm), start)
    length = float(np.hypot(x, y))
    # The stub has a fixed length, so that only the direction of the shuttle matters, not its length.
    end = round(start[0] + x / length, _DIGITS), round(start[1] + y / length, _DIGITS)
    return BlockShape(placed(half_mm, 0.0)[0], placed(0.0, low_mm)[1], placed(0.0, high_mm)[1], start, end,
                      placed(lever.drive_face_half_width_mm, 0.0)[0], gripper.material.poisson_ratio)  # fmt: skip


def drive_block_compliance(gripper: Gripper, unit: Array | None = None) -> Array:
    """Compliance that the drive block adds at the point where the shuttle's axis enters it.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    unit : ndarray of float, shape (3, 3), or None
        Result of `unit_compliance` for this block, if already computed.

    Returns
    -------
    ndarray of float, shape (3, 3)
        Motion (x, y, rotation) of that point per unit load at it, in global axes.
    """
    turned = np.array([1.0, 1.0, 1.0 / gripper.links.shuttle_width_mm])
    unit = unit_compliance(block_shape(gripper)) if unit is None else unit
    return np.outer(turned, turned) * unit / (gripper.material.youngs_modulus_mpa * gripper.body.plate_mm)


@lru_cache(maxsize=256)
def unit_compliance(shape: BlockShape) -> Array:
    """Compliance that the block adds, for unit modulus, plate thickness and shuttle width; shape (3, 3)."""
    material = Material("unit", 1.0, shape.poisson, 1.0, 1.0)
    entry = np.array(shape.entry)
    along = np.subtract(shape.end, shape.start) / np.hypot(*np.subtract(shape.end, shape.start))
    section = entry + _STUB * along
    shapes = (
        box(0.0, shape.half_width, shape.low, shape.high),
        bar(*shape.start, float(section[0]), float(section[1]), 1.0),
    )
    region = PlanarRegion(
        tuple((True, Polygon(right_of_axis(part.corners_mm))) for part in shapes), ((shape.face_half, 0.0),)
    )
    size = region.size_mm
    plate = PlaneStressPlate(triangulate(region, _ACROSS, _BODY * size), material, 1.0)
    x, y = plate.nodes_mm
    outline = np.unique(plate.outline_edges)
    on_face = outline[(np.abs(y[outline]) < _NEAR * size) & (x[outline] <= shape.face_half + _NEAR * size)]
    on_axis = outline[np.abs(x[outline]) < _NEAR * size]
    taken: set[int] = set()
    frames = [
        face_frame(plate, on_face, ("y",), taken)[0],
        face_frame(plate, on_axis, ("x",), taken)[0],
        section_frame(plate, section, along, 1.1, _NEAR * size),
    ]
    K = condensed(plate, np.arange(plate.unknowns), frames, range(3)).stiffness_n_mm
    # Fixed are y and rotation of the drive face, and x and rotation of the symmetry axis; both faces slide along
    # themselves.
    moving = np.array([0, 4, 6, 7, 8])
    whole = np.linalg.inv(K[np.ix_(moving, moving)])[2:, 2:]
    c, s = along
    axes = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    own = axes @ bar_compliance(_STUB, 1.0, 1.0, material)[_PLANAR] @ axes.T
    back = np.array([[1.0, 0.0, _STUB * s], [0.0, 1.0, -_STUB * c], [0.0, 0.0, 1.0]])
    root = back @ (whole - own) @ back.T
    values, vectors = np.linalg.eigh(0.5 * (root + root.T))
    return np.asarray(vectors @ np.diag(np.maximum(values, _LEAST * values.max())) @ vectors.T)
