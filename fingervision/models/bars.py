"""The right half of a gripper as a frame of bars and hinge segments, with masses lumped at the nodes.

A frame of bars is a hundred times faster than meshed bodies and is used where many drawings are compared. Its bars bend
up to the point where their axes meet, whereas the real body does not: this hardly affects slope and force, but the grip
and the first mode are up to a third and a fifth off.
"""

from collections.abc import Mapping
from functools import cached_property
from math import atan, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags, identity

from fingervision.domain.gripper import Gripper, PointMm
from fingervision.models.corotational_frame import CorotationalFrame
from fingervision.models.elastic_mechanism import ElasticMechanism, LargestStress
from fingervision.models.gripper_mechanism import half_mechanism
from fingervision.models.hinge_correction import HingeTheory, plane_strain_share
from fingervision.models.mechanism_bodies import BodyPose, bodies_of, rigid_motion
from fingervision.models.mechanism_equilibrium import DrivenMechanism, Gaps
from fingervision.models.notch import Notch, bar_compliance, notches_of
from fingervision.models.skeleton import Member, Skeleton, skeleton_of

# Nominal stress in the hinges of a frame: bending and tension of the section, from the loads at the frame's nodes.
#
# At the surface of a notch the stress is a few per cent higher than in a straight bar, by Neuber's factors for a deep
# notch (Kerbspannungslehre, 1937; Pilkey, Peterson's Stress Concentration Factors, charts 2.10 and 2.31). A wide plate
# restrains the hinge, and the resulting stress across the plate lowers the von Mises stress.

Array = NDArray[np.float64]

_SAMPLES = 9
"""Sections per segment at which the stress is computed: the maximum lies beside the neck if the moment varies along the
hinge."""
_HINGES = ("hinge 1", "hinge 2")
_PLANAR = np.ix_([0, 1, 5], [0, 1, 5])


def peak_hinge_stress(
    gripper: Gripper, skeleton: Skeleton, displacement: Array, theory: HingeTheory = HingeTheory.BEAM
) -> LargestStress:
    """Find the largest stress |N| / (b h) + 6 |M| / (b h^2) in the hinges, nominal or with notch factors.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    skeleton : Skeleton
        Tree of members, with the hinges divided into segments.
    displacement : ndarray of float, shape (3 * (members + 1),)
        Small displacements (mm) and rotations (rad) of the nodes at some input, starting with the clamp.
    theory : HingeTheory
        Beam theory gives the nominal stress of a straight bar; the corrected theory gives the von Mises stress on the
        notch.

    Returns
    -------
    LargestStress
        Stress at that input, on the side of the section where tension and bending stresses add.
    """
    moved = displacement.reshape(-1, 3)
    loads = np.zeros((len(skeleton.members), 3))
    for place, member in enumerate(skeleton.members):
        if member.name in _HINGES:
            axes, start, end = _axes(member)
            first, second = moved[member.parent + 1], moved[place + 1]
            # Displacement of the end if the member moved rigidly with its start.
            carried = first[:2] + first[2] * np.array([start[1] - end[1], end[0] - start[0]])
            strained = np.append(axes @ (second[:2] - carried), second[2] - first[2])
            tension_n, shear_n, moment_n_mm = np.linalg.solve(member.compliance[_PLANAR], strained)
            loads[place] = tension_n, moment_n_mm + shear_n * float(np.hypot(*(end - start))), moment_n_mm
    return peak_of_loads(gripper, skeleton, loads, theory)


def peak_of_loads(gripper: Gripper, skeleton: Skeleton, loads: Array, theory: HingeTheory) -> LargestStress:
    """Largest stress, from tension and end moments of every member (`loads`, shape (members, 3))."""
    lever = gripper.lever
    first, second = notches_of(gripper)
    hinges = {"hinge 1": (lever.hinge1_mm, first), "hinge 2": (lever.hinge2_mm, second)}
    peak = LargestStress(0.0, lever.hinge1_mm)
    way = np.linspace(0.0, 1.0, _SAMPLES)
    for member, (tension_n, at_start, at_end) in zip(skeleton.members, loads.tolist(), strict=True):
        if member.name not in hinges:
            continue
        centre, notch = hinges[member.name]
        axes, start, end = _axes(member)
        places = start + np.outer(way, end - start)
        height_mm = notch.height_mm((places - np.array(centre)) @ axes[0])
        moment_n_mm = at_start + (at_end - at_start) * way
        factors = notch_factors(notch) if theory is HingeTheory.CORRECTED else (1.0, 1.0)
        stress = factors[0] * abs(tension_n) / (notch.plate_mm * height_mm)
        stress += factors[1] * 6.0 * np.abs(moment_n_mm) / (notch.plate_mm * height_mm**2)
        if theory is HingeTheory.CORRECTED:
            # The stress is sigma along the surface and w nu sigma across the plate, with w the share of plane strain.
            across = plane_strain_share(notch) * gripper.material.poisson_ratio
            stress *= sqrt(1.0 - across + across**2)
        highest = int(np.argmax(stress))
        if stress[highest] > peak.mpa:
            side = np.sign(tension_n) * np.sign(moment_n_mm[highest]) or 1.0
            x, y = places[highest] - 0.5 * side * height_mm[highest] * axes[1]
            peak = LargestStress(float(stress[highest]), (float(x), float(y)))
    return peak


def notch_factors(notch: Notch) -> tuple[float, float]:
    """Neuber's stress concentration factors, in tension and bending, of a bar with deep notches on both sides."""
    ratio = 0.5 * notch.curvature_ratio  # half the neck's height over the radius of curvature
    root, angle = sqrt(ratio), atan(sqrt(ratio))
    tension = 2.0 * (ratio + 1.0) * root / ((ratio + 1.0) * angle + root)
    return tension, 4.0 * ratio * root / (3.0 * (root + (ratio - 1.0) * angle))


def _axes(member: Member) -> tuple[Array, Array, Array]:
    start, end = np.array(member.start_mm), np.array(member.end_mm)
    along = (end - start) / np.hypot(*(end - start))
    return np.array([along, [-along[1], along[0]]]), start, end


_STIFF_JOINT = 1e-3
"""Compliance of a rigid joint relative to that of a square bar of the joint's length: small, yet well conditioned."""
SEGMENTS = 10
"""Segments per notch."""


class BarFrame(ElasticMechanism):
    """A gripper as a frame of bars.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    theory : HingeTheory
        Theory of the hinges' compliance.
    segments : int
        Segments per notch; 0 for one segment with the compliance of the whole notch.
    block : ndarray of float, shape (3, 3), or None
        Result of `skeleton.unit_compliance` for the drive block, if already computed.
    sways : bool
        Whether both halves and the drive move the same way sideways.
    """

    kind = "bars"

    def __init__(
        self,
        gripper: Gripper,
        theory: HingeTheory,
        segments: int = SEGMENTS,
        *,
        block: Array | None = None,
        sways: bool = False,
    ) -> None:
        super().__init__(half_mechanism(gripper))
        self.gripper, self.theory, self._sways = gripper, theory, sways
        self.skeleton = skeleton_of(gripper, theory, segments, block=block)
        members = self.skeleton.members
        nodes = np.array([members[0].start_mm, *(member.end_mm for member in members)])
        ends = np.array([(member.parent + 1, place + 1) for place, member in enumerate(members)])
        compliance = np.array([self._end_compliance(nodes[b] - nodes[a], place)
                               for place, (a, b) in enumerate(ends.tolist())])  # fmt: skip
        self.frame = CorotationalFrame(nodes, ends, compliance / self.mechanism.halves)

    def _end_compliance(self, axis_mm: Array, place: int) -> Array:
        compliance = self.skeleton.members[place].compliance[_PLANAR]
        if compliance.any():
            return compliance
        length, gripper = float(np.hypot(*axis_mm)), self.gripper
        return _STIFF_JOINT * bar_compliance(length, length, gripper.body.plate_mm, gripper.material)[_PLANAR]

    @cached_property
    def driven(self) -> DrivenMechanism:
        """The frame with its supports: the clamp is fixed, the drive point moves along the axis and cannot turn."""
        size, drive = self.frame.unknowns, 3 * (self.skeleton.drive + 1)
        held = [0, 1, 2, drive + 1, *(() if self._sways else (drive, drive + 2))]
        by_drive = np.zeros((size, 1))
        by_drive[drive + 1] = 1.0
        free = np.setdiff1d(np.arange(size), held)
        return DrivenMechanism(
            self.mechanism.name, self.frame.internal_force_n, lambda moved: self.frame.internal_force_n(moved)[1],
            csr_matrix(identity(size, format="csc")[:, free]), by_drive, np.ones(1), self._mass_t, (self._gaps,),
        )  # fmt: skip

    @property
    def _face(self) -> list[int]:
        return [3 * (self.skeleton.corner + 1), 3 * (self.skeleton.heel + 1)]

    def _gaps(self, moved: Array) -> Gaps:
        slope = csr_matrix((np.ones(2), (np.arange(2), self._face)), shape=(2, moved.size))
        gap = self.contact_points_mm[0][0] + moved[self._face]
        return gap, slope, lambda _: csr_matrix((moved.size, moved.size))

    @property
    def contact_points_mm(self) -> tuple[Array, ...]:
        """Corner and heel of the tip, shape (2, 2)."""
        return (np.array([self.gripper.tip_corner_mm, self.gripper.tip_heel_mm]).T,)

    def _mass_t(self) -> csr_matrix:
        """Mass matrix: half of each member's mass at each end, corrected to a uniform bar's rotational inertia.

        The mass matrix is equation (2) of Hricko & Havlik (2015), with mass m and moment of inertia I_z for each node:
        I_z of a bar about its centre is m (l^2 + w^2) / 12 for length l and width w.
        """
        nodes = self.frame.nodes_mm
        columns = np.zeros((len(nodes), 3))
        for member, (a, b) in zip(self.skeleton.members, self.frame.ends.tolist(), strict=True):
            turn = (float(np.sum((nodes[b] - nodes[a]) ** 2)) + member.width_mm**2) / 12.0
            for node in (a, b):
                columns[node] += 0.5 * member.mass_t * np.array([1.0, 1.0, turn])
        return csr_matrix(self.mechanism.halves * diags(columns.ravel()))

    def vibrating(self, count: int) -> DrivenMechanism:
        """Return the same system as `driven`, which has all masses."""
        del count
        return self.driven

    @cached_property
    def swaying(self) -> "BarFrame":
        """The half whose other half moves the same way sideways, its drive not guided."""
        return BarFrame(self.gripper, self.theory, sways=True)

    def motion_mm(self, moved: Array, point: PointMm, *, large: bool) -> Array:
        """Displacement of the measuring point, the only point of the frame at which a probe lies."""
        del point, large
        at = 3 * (self.skeleton.measured + 1)
        return np.asarray(moved[at : at + 2])

    def pulled(self, direction: PointMm, system: DrivenMechanism) -> Array:
        """Displacements of a rigid translation."""
        moved = np.zeros(system.unknowns)
        moved[0::3], moved[1::3] = direction
        return moved

    def peak_stress(self, moved: Array, *, large: bool = False) -> LargestStress:
        """Largest stress in the hinges."""
        if not large:
            return peak_hinge_stress(self.gripper, self.skeleton, moved, self.theory)
        loads = self.frame.end_loads(moved) * np.array([1.0, -1.0, 1.0]) / self.mechanism.halves
        return peak_of_loads(self.gripper, self.skeleton, loads, self.theory)

    def mode_lines(self) -> tuple[Array, NDArray[np.int64]]:
        """Axes of the bars."""
        return self.frame.nodes_mm[self.frame.ends], 3 * self.frame.ends[:, :, None] + np.arange(2)

    def drawn_poses(self, moved: Array, *, large: bool) -> Mapping[str, BodyPose]:
        """Poses of the right half's bodies from the motions of the nodes of the bars.

        A bar is represented by two rows of points at its sixths across its width, which give the bar's area and second
        moment.
        """
        members = self.skeleton.members
        owners = [_owner(member.name) for member in members]
        centroids = {body.name: body.centroid_mm for body in bodies_of(self.mechanism) if not body.is_fixed}
        places = np.array([members[0].start_mm, *(member.end_mm for member in members)])
        motion = moved.reshape(-1, 3)
        found = {}
        for name, centroid in centroids.items():
            rest, there, weights = [], [], []
            for place, (member, owner) in enumerate(zip(members, owners, strict=True)):
                if owner != name or member.mass_t == 0.0:
                    continue
                a, b = member.parent + 1, place + 1
                # Simpson's rule along the bar; the displacement of its middle follows the cubic of a bent beam.
                chord = places[b] - places[a]
                bend = (motion[a, 2] - motion[b, 2]) / 8.0 * np.array([-chord[1], chord[0]])
                middle = 0.5 * (motion[a] + motion[b])
                middle[:2] += 0.0 if large else bend
                for share, at, by in ((1.0, places[a], motion[a]), (4.0, 0.5 * (places[a] + places[b]), middle),
                                      (1.0, places[b], motion[b])):  # fmt: skip
                    across = np.array([-chord[1], chord[0]]) / np.hypot(*chord) * member.width_mm / np.sqrt(12.0)
                    for side in (-1.0, 1.0):
                        arm = side * across
                        rest.append(at + arm)
                        there.append(by[:2] + _turned(arm, float(by[2]), large=large))
                        weights.append(share * member.mass_t)
            found[name] = rigid_motion(np.array(rest).T, np.array(there).T, np.array(weights), centroid, large=large)
        return found


def _owner(member: str) -> str:
    """Name of the body to which a bar of the half belongs; None for a bar of a hinge."""
    if member.startswith("hinge"):
        return ""
    if member in ("shuttle", "drive block"):
        return "drive"
    return "right_pillar" if member == "pillar" else "right_finger"


def _turned(arm: Array, angle: float, *, large: bool) -> Array:
    """Displacement of the far end of an arm that rotates about its other end."""
    if not large:
        return angle * np.array([-arm[1], arm[0]])
    c, s = np.cos(angle) - 1.0, np.sin(angle)
    return np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])
