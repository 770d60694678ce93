"""The half gripper as a tree of bars, hinges and stiff joints, from the clamp to the drive and to the tip.

Bars bend over the whole length of their axes, up to the point where the axes meet, except the finger inside the cross
bar. The drive block is elastic under the shuttle (`drive_block_root`); the connection from a bar's axis to a point on
its face is rigid. For nine grippers that were not used in developing these rules, the gap per input agrees with finite
elements within 0.41 %, the force within 1.5 % (`tests/benchmarks/models_held_out.py`).
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from math import cos, radians, sin

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Gripper, PointMm
from fingervision.models.drive_block_root import drive_block_compliance
from fingervision.models.hinge_compliance import bar_compliance, beam_compliance
from fingervision.models.hinge_correction import HingeTheory, hinge_compliance, hinge_ratio
from fingervision.models.notch import masses_t, notches_of

Array = NDArray[np.float64]

_RIGID = np.zeros((6, 6))
_PLANAR = np.ix_([0, 1, 5], [0, 1, 5])
_PIECES_PER_BAR = 4
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
    compliance : ndarray of float, shape (6, 6)
        Compliance at the member's end, with x along its axis, y to the left of it and z towards the viewer; zero for a
        rigid member.
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

    def hinge(self, parent: int, start: PointMm, end: PointMm, name: str, theory: HingeTheory, segments: int) -> int:
        """Divide a notch into segments."""
        material, notch = self.gripper.material, notches_of(self.gripper)[0 if name == "hinge 1" else 1]
        edges = notch.stations_mm(max(segments, 1))
        masses = masses_t(notch, material, edges)
        if segments == 0:
            whole = hinge_compliance(notch, material, theory)
            self.members.append(Member(name, parent, start, end, whole, float(masses[0]), notch.thickness_mm))
            return len(self.members) - 1
        ratio = hinge_ratio(notch, material, theory)
        root = np.sqrt(ratio[[0, 5, 4, 3, 4, 5]])
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


def skeleton_of(
    gripper: Gripper,
    theory: HingeTheory,
    segments: int,
    *,
    rigid_links: bool = False,
    block: Array | None = None,
) -> Skeleton:
    """Reduce a drawing to its tree of members.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    theory : HingeTheory
        Theory of the hinges' compliance.
    segments : int
        Segments per hinge, shorter near the neck, each with its own integral; 0 for one segment with the compliance of
        the whole hinge.
    rigid_links : bool
        Whether only the hinges are elastic, as in the equations of Hricko & Havlik (2015).
    block : ndarray of float, shape (3, 3), or None
        Result of `drive_block_root.unit_compliance`, if already computed.

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

    def link(parent: int, start: PointMm, end: PointMm, name: str, width_mm: float) -> int:
        if rigid_links:
            area_mm2 = width_mm * float(np.hypot(end[0] - start[0], end[1] - start[1]))
            return tree.rigid(parent, start, end, name, area_mm2, width_mm)
        return tree.bar(parent, start, end, name, width_mm)

    at = link(-1, (pillar_x, links.pillar_and_root_mm[2]), lower1, "pillar", pillar_width)
    at = tree.hinge(at, lower1, upper1, "hinge 1", theory, segments)
    at = link(at, upper1, (pillar_x, beam_low), "root", pillar_width)
    foot = _at_height(links.finger_mm, cross_y)
    at = link(at, (pillar_x, beam_low), (pillar_x, cross_y), "root's joint", pillar_width)
    shuttle = (*links.shuttle_from_mm, *links.shuttle_to_mm)
    meeting = _at_height(shuttle, cross_y)
    joint = link(at, (pillar_x, cross_y), meeting, "cross bar", links.cross_bar_width_mm)
    at = joint
    at = link(at, meeting, upper2, "stub", links.shuttle_width_mm)
    at = tree.hinge(at, upper2, lower2, "hinge 2", theory, segments)
    box_mm = links.drive_block_mm
    entry = _at_x(shuttle, box_mm[1])
    if not lower2[0] > entry[0]:
        raise DataError(
            f"Hinge 2 must end outside the drive block, at x > {entry[0]:g} mm, but ends at x = {lower2[0]:g} mm; "
            "make the block narrower or lever.l4_mm longer."
        )
    at = link(at, lower2, entry, "shuttle", links.shuttle_width_mm)
    drive = tree.rigid(at, entry, lever.drive_mm, "drive block", (box_mm[1] - box_mm[0]) * (box_mm[3] - box_mm[2]),
                       box_mm[3] - box_mm[2])  # fmt: skip
    if not rigid_links and theory is HingeTheory.CORRECTED:
        tree.members[drive] = _yielding(tree.members[drive], drive_block_compliance(gripper, block))
        tree.members[drive] = _bending_out_of_plane(tree.members[drive], gripper)
    at = link(joint, meeting, foot, "cross bar's end", links.cross_bar_width_mm)
    tip = links.tip_polygon_mm
    tip_low = min(y for _, y in tip)
    below = _at_height(links.finger_mm, tip_low)
    # Within the cross bar, the finger is part of the cross bar and does not bend.
    leaves = _at_height(links.finger_mm, min(cross_y + links.cross_bar_width_mm / 2.0, tip_low))
    within_mm2 = links.finger_width_mm * float(np.hypot(*np.subtract(leaves, foot)))
    at = tree.rigid(at, foot, leaves, "finger's foot", within_mm2, links.finger_width_mm)
    if not rigid_links:
        tree.members[at] = _bending_out_of_plane(tree.members[at], gripper)
    at = link(at, leaves, below, "finger", links.finger_width_mm)
    tip_area = _area_mm2(tip)
    tip_height = gripper.tip_corner_mm[1] - tip_low
    top = [x for x, y in tip if y == max(y for _, y in tip)]
    head = (sum(top) / len(top), gripper.tip_corner_mm[1])
    at = link(at, below, head, "tip", tip_area / tip_height)
    corner = tree.rigid(at, head, gripper.tip_corner_mm, "tip's corner")
    heel = tree.rigid(at, head, gripper.tip_heel_mm, "tip's heel")
    measured = tree.rigid(at, head, gripper.measuring_point_mm, "measuring point")
    return Skeleton(tuple(tree.members), drive, corner, heel, measured)


def _bending_out_of_plane(member: Member, gripper: Gripper) -> Member:
    """Give a member the out-of-plane bending and torsion of a bar of its own width."""
    length = float(np.hypot(*np.subtract(member.end_mm, member.start_mm)))
    bar = bar_compliance(length, member.width_mm, gripper.body.plate_mm, gripper.material)
    bar[_PLANAR] = member.compliance[_PLANAR]
    return replace(member, compliance=bar)


def _yielding(member: Member, at_start: Array) -> Member:
    """Add an elastic joint, with a given compliance (x, y, rotation) in global axes, at the start of a rigid member."""
    way = np.subtract(member.end_mm, member.start_mm)
    c, s = way / np.hypot(*way)
    carried = np.array([[1.0, 0.0, -way[1]], [0.0, 1.0, way[0]], [0.0, 0.0, 1.0]])
    axes = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    compliance = np.zeros((6, 6))
    compliance[_PLANAR] = axes @ carried @ at_start @ carried.T @ axes.T
    return replace(member, compliance=compliance)


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
