"""The half gripper as a tree of bars, hinges and stiff joints, from the clamp to the drive and to the tip.

Bars bend over the whole length of their axes, up to the point where the axes meet, except the finger inside the cross
bar. The drive block is elastic under the shuttle (`skeleton`); the connection from a bar's axis to a point on
its face is rigid. For nine grippers that were not used in developing these rules, the gap per input agrees with finite
elements within 0.41 %, the force within 1.5 % (`tests/benchmarks/models_held_out.py`).
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from math import cos, radians, sin

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Gripper, Material, PointMm
from fingervision.models.condensed_bodies import condensed, face_frame, section_frame
from fingervision.models.corotational_frame import carried, frame_axes
from fingervision.models.gripper_mechanism import right_of_axis
from fingervision.models.hinge_correction import (
    HingeTheory,
    bar_compliance,
    beam_compliance,
    hinge_ratio,
    masses_t,
    notches_of,
)
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_shapes import Polygon, bar, box
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.triangulate import triangulate

# Extra compliance where the shuttle bar joins the drive block, because the block itself deforms.
#
# The block is hardly larger than the bar is wide, so that the formula for a bar rooted in a half plane (O'Donnell,
# 1960, Journal of Applied Mechanics 27, 764) does not hold. The block is meshed with a stub of the bar, as long as
# Saint-Venant's principle requires, fixed at its drive face and on the symmetry axis; the bar's own compliance is
# subtracted from the compliance at the stub's end. For unit modulus, the compliance of a block depends on its geometry
# only, and is computed once per block.

Array = NDArray[np.float64]

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


def drive_block_compliance(gripper: Gripper) -> Array:
    """Compliance that the drive block adds at the point where the shuttle's axis enters it.

    Parameters
    ----------
    gripper : Gripper
        The drawing.

    Returns
    -------
    ndarray of float, shape (3, 3)
        Motion (x, y, rotation) of that point per unit load at it, in global axes.
    """
    turned = np.array([1.0, 1.0, 1.0 / gripper.links.shuttle_width_mm])
    unit = unit_compliance(block_shape(gripper))
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
    axes, back = frame_axes(*along), carried(-_STUB * along)
    own = axes @ bar_compliance(_STUB, 1.0, 1.0, material) @ axes.T
    root = back @ (whole - own) @ back.T
    values, vectors = np.linalg.eigh(0.5 * (root + root.T))
    return np.asarray(vectors @ np.diag(np.maximum(values, _LEAST * values.max())) @ vectors.T)


_RIGID = np.zeros((3, 3))
_PIECES_PER_BAR, _SEGMENTS = 4, 10
"""Pieces of a bar, and segments of a notch."""
_LEAST_BAR = 0.01
"""Least length of a bar between a notch and the axis of the cross bar, as a share of the distance between the two."""


@dataclass(frozen=True, slots=True, eq=False)
class Member:
    """One member of the tree: its start is joined to its parent's end, and its own end is loaded.

    Parameters
    ----------
    name : str
        Name of the member.
    parent : int
        Index of the parent in the tree; -1 for the clamp.
    start_mm, end_mm : (float, float)
        Ends of the member's axis.
    compliance : ndarray of float, shape (3, 3)
        Compliance (x, y, rotation) at the member's end, with x along its axis and y to the left of it; zero for a rigid
        member.
    mass_t : float
        Mass, distributed uniformly along the axis.
    width_mm : float
        Extent across the axis, used for the rotational inertia.
    """

    name: str
    parent: int
    start_mm: PointMm
    end_mm: PointMm
    compliance: Array
    mass_t: float
    width_mm: float


@dataclass(frozen=True, slots=True)
class Skeleton:
    """The tree of members, with parents before children.

    Parameters
    ----------
    members : tuple of Member
        All members in order.
    drive, corner, heel, measured : int
        Indices of the members whose ends are the drive point, the tip's corner, the tip's heel and the measuring point.
    """

    members: tuple[Member, ...]
    drive: int
    corner: int
    heel: int
    measured: int


class _Tree:
    def __init__(self, gripper: Gripper) -> None:
        self.gripper = gripper
        self.members: list[Member] = []

    def rigid(
        self, parent: int, start: PointMm, end: PointMm, name: str, area_mm2: float = 0.0, width: float = 0.0
    ) -> int:
        body, material = self.gripper.body, self.gripper.material
        mass = material.density_t_mm3 * body.plate_mm * area_mm2
        self.members.append(Member(name, parent, start, end, _RIGID, mass, width))
        return len(self.members) - 1

    def bar(self, parent: int, start: PointMm, end: PointMm, name: str, width_mm: float) -> int:
        body, material = self.gripper.body, self.gripper.material
        points = np.linspace(start, end, _PIECES_PER_BAR + 1)
        length = float(np.hypot(*(points[1] - points[0])))
        mass = material.density_t_mm3 * body.plate_mm * width_mm * length
        compliance = bar_compliance(length, width_mm, body.plate_mm, material)
        for a, b in zip(points[:-1].tolist(), points[1:].tolist(), strict=True):
            self.members.append(Member(name, parent, tuple(a), tuple(b), compliance, mass, width_mm))
            parent = len(self.members) - 1
        return parent

    def hinge(self, parent: int, start: PointMm, end: PointMm, name: str, theory: HingeTheory) -> int:
        """Divide a notch into segments, shorter near the neck."""
        material, notch = self.gripper.material, notches_of(self.gripper)[0 if name == "hinge 1" else 1]
        edges = notch.stations_mm(_SEGMENTS)
        masses = masses_t(notch, material, edges)
        root = np.sqrt(hinge_ratio(notch, material, theory))
        along = (edges - edges[0]) / (edges[-1] - edges[0])
        points = np.array(start) + np.outer(along, np.subtract(end, start))
        for place, span in enumerate(pairwise(edges.tolist())):
            # Each segment has the exact integral of its compliance, so that thin necks are right with any number of
            # segments.
            part = root[:, None] * beam_compliance(notch, material, span) * root
            height = float(notch.height_mm(np.array([0.5 * (span[0] + span[1])]))[0])
            a, b = points[place].tolist(), points[place + 1].tolist()
            self.members.append(Member(name, parent, tuple(a), tuple(b), part, float(masses[place]), height))
            parent = len(self.members) - 1
        return parent


def skeleton_of(gripper: Gripper, theory: HingeTheory) -> Skeleton:
    """Reduce a drawing to its tree of members.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    theory : HingeTheory
        Theory of the hinges' compliance.

    Raises
    ------
    DataError, ModelError
        If the members do not form a connected chain.
    """
    links, lever = gripper.links, gripper.lever
    first, second = notches_of(gripper)
    tree = _Tree(gripper)
    reaches = first.reach_mm, second.reach_mm
    lower1, upper1 = _hinge_ends(lever.hinge1_mm, lever.hinge1_axis_deg, reaches[0])
    lower2, upper2 = _hinge_ends(lever.hinge2_mm, lever.hinge2_axis_deg, reaches[1])
    cross_y = links.cross_bar_mm[1]
    beam_low = cross_y - links.cross_bar_width_mm / 2.0
    pillar_x = lever.hinge1_mm[0]
    pillar_width = links.pillar_and_root_mm[1] - links.pillar_and_root_mm[0]
    if not lower1[1] > links.pillar_and_root_mm[2] or not cross_y > max(upper1[1], upper2[1]):
        raise DataError(
            f"A model of bars and hinges needs both hinges between the clamp and the cross bar, whose axis is at "
            f"y = {cross_y:g} mm, but the hinges reach from y = {lower1[1]:g} to "
            f"{max(upper1[1], upper2[1]):g} mm; take --kind finite_element."
        )
    # A notch may reach into the cross bar: the root then begins where the notch ends.
    beam_low = max(beam_low, upper1[1] + _LEAST_BAR * (cross_y - upper1[1]))

    at = tree.bar(-1, (pillar_x, links.pillar_and_root_mm[2]), lower1, "pillar", pillar_width)
    at = tree.hinge(at, lower1, upper1, "hinge 1", theory)
    at = tree.bar(at, upper1, (pillar_x, beam_low), "root", pillar_width)
    foot = _at_height(links.finger_mm, cross_y)
    at = tree.bar(at, (pillar_x, beam_low), (pillar_x, cross_y), "root's joint", pillar_width)
    shuttle = (*links.shuttle_from_mm, *links.shuttle_to_mm)
    meeting = _at_height(shuttle, cross_y)
    joint = tree.bar(at, (pillar_x, cross_y), meeting, "cross bar", links.cross_bar_width_mm)
    at = joint
    at = tree.bar(at, meeting, upper2, "stub", links.shuttle_width_mm)
    at = tree.hinge(at, upper2, lower2, "hinge 2", theory)
    box_mm = links.drive_block_mm
    entry = _at_x(shuttle, box_mm[1])
    if not lower2[0] > entry[0]:
        raise DataError(
            f"Hinge 2 must end outside the drive block, at x > {entry[0]:g} mm, but ends at x = {lower2[0]:g} mm; "
            "make the block narrower or lever.l4_mm longer."
        )
    at = tree.bar(at, lower2, entry, "shuttle", links.shuttle_width_mm)
    drive = tree.rigid(at, entry, lever.drive_mm, "drive block", (box_mm[1] - box_mm[0]) * (box_mm[3] - box_mm[2]),
                       box_mm[3] - box_mm[2])  # fmt: skip
    if theory is HingeTheory.CORRECTED:
        tree.members[drive] = _yielding(tree.members[drive], drive_block_compliance(gripper))
    at = tree.bar(joint, meeting, foot, "cross bar's end", links.cross_bar_width_mm)
    tip = links.tip_polygon_mm
    tip_low = min(y for _, y in tip)
    below = _at_height(links.finger_mm, tip_low)
    # Within the cross bar, the finger is part of the cross bar and does not bend.
    leaves = _at_height(links.finger_mm, min(cross_y + links.cross_bar_width_mm / 2.0, tip_low))
    within_mm2 = links.finger_width_mm * float(np.hypot(*np.subtract(leaves, foot)))
    at = tree.rigid(at, foot, leaves, "finger's foot", within_mm2, links.finger_width_mm)
    at = tree.bar(at, leaves, below, "finger", links.finger_width_mm)
    tip_area = _area_mm2(tip)
    tip_height = gripper.tip_corner_mm[1] - tip_low
    top = [x for x, y in tip if y == max(y for _, y in tip)]
    head = (sum(top) / len(top), gripper.tip_corner_mm[1])
    at = tree.bar(at, below, head, "tip", tip_area / tip_height)
    corner = tree.rigid(at, head, gripper.tip_corner_mm, "tip's corner")
    heel = tree.rigid(at, head, gripper.tip_heel_mm, "tip's heel")
    measured = tree.rigid(at, head, gripper.measuring_point_mm, "measuring point")
    return Skeleton(tuple(tree.members), drive, corner, heel, measured)


def _yielding(member: Member, at_start: Array) -> Member:
    """Add an elastic joint, with a given compliance (x, y, rotation) in global axes, at the start of a rigid member."""
    way = np.subtract(member.end_mm, member.start_mm)
    axes, moved = frame_axes(*(way / np.hypot(*way))), carried(way)
    return replace(member, compliance=axes.T @ moved @ at_start @ moved.T @ axes)


def _hinge_ends(centre: PointMm, axis_deg: float, reach: float) -> tuple[PointMm, PointMm]:
    c, s = cos(radians(axis_deg)), sin(radians(axis_deg))
    return (centre[0] - reach * c, centre[1] - reach * s), (centre[0] + reach * c, centre[1] + reach * s)


def _at_height(bar: tuple[float, float, float, float], y_mm: float) -> PointMm:
    return bar[0] + (bar[2] - bar[0]) * (y_mm - bar[1]) / (bar[3] - bar[1]), y_mm


def _at_x(bar: tuple[float, float, float, float], x_mm: float) -> PointMm:
    return x_mm, bar[1] + (bar[3] - bar[1]) * (x_mm - bar[0]) / (bar[2] - bar[0])


def _area_mm2(corners: tuple[PointMm, ...]) -> float:
    x, y = np.array(corners).T
    return float(abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2.0)
