"""Stiffness-matrix model of a gripper: its half as a frame of bars and hinge segments, with masses at the nodes.

The frame's stiffness is that of equations (5) to (15) of Hricko & Havlik (2015), corrected for these reasons:

* Equation (10) of the paper uses 135.15 degrees and equation (13) 135 degrees for the same angle; here, the angles come
  from the drawing.
* Equation (12) of the paper uses T_12, which is not defined there; T_12 must transfer the compliance from O1 to O2, as
  T_O2 does. Equation (14) has C_2A on both sides; on the right-hand side it must be C_12. Here, stiffnesses are added
  at the nodes that members share, which needs neither.
* Equation (15) of the paper, K = 2 C^-1, gives the stiffness along the drive only if the shuttle cannot move sideways
  or rotate. The other half of the gripper prevents sideways motion and rotation of the shuttle, so that the stiffness
  is 2 (C^-1)_yy, with C the compliance of one half and y the direction of the drive; for a free shuttle, it would be 2
  / C_yy.

The links are elastic too, as Timoshenko bars; with elastic hinges only, as published, the gripper of the paper has a
0.9 % larger slope and about 10 % more force.

A frame of bars is a hundred times faster than meshed bodies and is used where many drawings are compared. Its bars bend
up to the point where their axes meet, whereas the real body does not: this hardly affects slope and force, but the grip
and the first mode are up to a third and a fifth off.
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags, identity

from fingervision.domain.errors import UsageError
from fingervision.domain.gripper import Gripper, PointMm
from fingervision.models.answer_figures import LINEAR, Physics
from fingervision.models.corotational_frame import CorotationalFrame, turned_axes
from fingervision.models.elastic_mechanism import ElasticMechanism, LargestStress
from fingervision.models.flexure_span import FlexureSpan
from fingervision.models.flexure_stress import nominal_stress
from fingervision.models.gripper_mechanism import half_mechanism
from fingervision.models.gripper_model import DrawnGripper, ModelErrors
from fingervision.models.hinge_correction import HingeTheory, bar_compliance, notches_of
from fingervision.models.mechanism_bodies import BodyPose, rigid_motion
from fingervision.models.mechanism_equilibrium import DrivenMechanism, Gaps
from fingervision.models.skeleton import skeleton_of

Array = NDArray[np.float64]

ERRORS_OF_BARS = ModelErrors(0.01, 0.03, 0.2, 0.35)
"""Relative model errors of bars, and of beam theory: bars bend up to the point where their axes meet, unlike the real
body. Slope and force are hardly affected, but the grip and the first mode are 31 % and 18 % off where the cross bar is
5 mm wide between bars of 9 mm."""
_HINGES = ("hinge 1", "hinge 2")
_TINY = 1e-7
"""Largest displacement from which small loads are scaled up: their axes do not rotate."""
_STIFF_JOINT = 1e-3
"""Compliance of a rigid joint relative to that of a square bar of the joint's length: small, yet well conditioned."""


class BarFrame(ElasticMechanism):
    """A gripper as a frame of bars.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    theory : HingeTheory
        Theory of the hinges' compliance.
    sways : bool
        Whether both halves and the drive move the same way sideways.
    """

    kind = "bars"
    _errors = ERRORS_OF_BARS.force, ERRORS_OF_BARS.force

    def __init__(
        self,
        gripper: Gripper,
        theory: HingeTheory,
        *,
        sways: bool = False,
    ) -> None:
        super().__init__(half_mechanism(gripper))
        self.gripper, self.theory, self._sways = gripper, theory, sways
        self.skeleton = skeleton_of(gripper, theory)
        members = self.skeleton.members
        nodes = np.array([members[0].start_mm, *(member.end_mm for member in members)])
        ends = np.array([(member.parent + 1, place + 1) for place, member in enumerate(members)])
        compliance = np.array([self._end_compliance(nodes[b] - nodes[a], place)
                               for place, (a, b) in enumerate(ends.tolist())])  # fmt: skip
        self.frame = CorotationalFrame(nodes, ends, compliance / self.mechanism.halves)

    def _end_compliance(self, axis_mm: Array, place: int) -> Array:
        compliance = self.skeleton.members[place].compliance
        if compliance.any():
            return compliance
        length, gripper = float(np.hypot(*axis_mm)), self.gripper
        return _STIFF_JOINT * bar_compliance(length, length, gripper.body.plate_mm, gripper.material)

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
        """Largest nominal stress in the hinges."""
        share = 1.0 if large else _TINY / max(float(np.abs(moved).max()), _TINY)
        loads = self.frame.end_loads(share * moved) / (share * self.mechanism.halves)
        found = []
        for name, flexure, notch in zip(_HINGES, self.mechanism.flexures, notches_of(self.gripper), strict=True):
            own = [place for place, member in enumerate(self.skeleton.members) if member.name == name]
            ends = np.array([self.skeleton.members[own[0]].start_mm, self.skeleton.members[own[-1]].end_mm])
            backwards = float(np.diff(ends, axis=0)[0] @ np.subtract(flexure.point_mm(1.0, 0.0), flexure.at_mm)) < 0.0
            rows = loads[own][::-1, [0, 2, 1]] if backwards else loads[own]
            free_mm = (-notch.reach_mm, notch.reach_mm)
            span = FlexureSpan(flexure, free_mm, free_mm, (notch.web_mm, notch.web_mm))
            stations = notch.stations_mm(len(own))
            found.append(nominal_stress(span, rows, self.mechanism, self.theory, stations_mm=stations))
        return max(found, key=lambda peak: peak.mpa)

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
        centroids = {body.name: body.centroid_mm for body in self.bodies if not body.is_fixed}
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
    return np.asarray((turned_axes(angle) - np.eye(2)) @ arm)


KIND = "stiffness_matrix"
TRUST, SMALL_DISPLACEMENTS_ALONE = 1, True


class StiffnessMatrixGripper(DrawnGripper):
    """Stiffness-matrix model of a gripper with two identical halves.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    physics : Physics
        Which effects beyond small displacements are included.
    theory : HingeTheory
        Theory of the hinges' compliance.
    """

    name = KIND

    def __init__(
        self, gripper: Gripper, physics: Physics = LINEAR, theory: HingeTheory = HingeTheory.CORRECTED
    ) -> None:
        super().__init__(gripper, physics, BarFrame(gripper, theory), ERRORS_OF_BARS)


def build(gripper: Gripper, physics: Physics, theory: HingeTheory) -> StiffnessMatrixGripper:
    """Build the model; see `fingervision.models.kinds`."""
    if physics != LINEAR:
        raise UsageError("The stiffness matrix handles small displacements only; take --kind lumped or finite_element.")
    return StiffnessMatrixGripper(gripper, physics, theory)
