"""Stiffness-matrix model of the gripper: equations (5) to (15) of Hricko & Havlik (2015) in six dimensions, corrected.

The published equations are corrected for these reasons:

* Equation (6) of the paper transforms six components, but its equation (3) is a planar compliance with three
  components; in this module,
  all compliances are 6 by 6.
* Equation (10) of the paper uses 135.15 degrees and equation (13) 135 degrees for the same angle; in this module, the
  angles come
  from the drawing.
* Equation (12) of the paper uses T_12, which is not defined there; T_12 must transfer the compliance from O1 to O2, as
  T_O2
  does.
* Equation (14) of the paper has C_2A on both sides; on the right-hand side it must be C_12.
* Equation (15) of the paper, K = 2 C^-1, gives the stiffness along the drive only if the shuttle cannot move sideways
  or rotate. The other half of the gripper prevents sideways motion and rotation of the shuttle, so that the stiffness
  is 2 (C^-1)_yy, with C the compliance of one half and y the direction of the drive; for a free shuttle, it would be 2
  / C_yy.

The links are elastic too, as Timoshenko bars; `rigid_links` gives the published model with elastic hinges only, which
for the published gripper has a 0.9 % larger slope and about 10 % more force.
"""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from fingervision.domain.errors import UsageError
from fingervision.domain.gripper import Gripper
from fingervision.domain.response import Response
from fingervision.models.answer_figures import ModelFigures
from fingervision.models.elastic_mechanism import STANDARD_GRAVITY_MM_S2
from fingervision.models.grip import Part
from fingervision.models.gripper_model import covered_inputs_mm
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.lumped import LumpedGripper
from fingervision.models.physics import LINEAR, Physics
from fingervision.models.skeleton import Member, Skeleton, skeleton_of

Array = NDArray[np.float64]

# Rigid-body transforms of compliance: equations (5) to (8) of Hricko & Havlik (2015), in six dimensions.
#
# Equation (6), T = [[R, R P], [0, R]], is used as published: R rotates the axes, and P is the cross-product matrix of
# equation (8) for the vector from the point whose motion is wanted to the point whose motion is known. In the
# publication, equation (6) contains 6 by 6 matrices, but the compliance of equation (3) is planar, 3 by 3; in this
# module every compliance is 6 by 6.


def rotation_about_z(angle_rad: float) -> Array:
    """Equation (7): rotation matrix from axes rotated by the angle to the global axes."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def cross_matrix(arm_mm: Array) -> Array:
    """Equation (8): the matrix P with P v = p x v."""
    x, y, z = arm_mm
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def carried(arm_mm: Array) -> Array:
    """Matrix from the motion of a rigid body at one point to its motion at another point.

    Parameters
    ----------
    arm_mm : ndarray of float, shape (3,)
        Vector from the point where the motion is known to the point where it is wanted.

    Returns
    -------
    ndarray of float, shape (6, 6)
        Matrix of u_wanted = u_known + theta x arm; its transpose transfers loads in the opposite direction.
    """
    matrix = np.eye(6)
    matrix[:3, 3:] = -cross_matrix(arm_mm)
    return matrix


def turned(angle_rad: float) -> Array:
    """Matrix that transforms displacements and rotations from a member's axes to global axes, shape (6, 6)."""
    matrix = np.zeros((6, 6))
    matrix[:3, :3] = matrix[3:, 3:] = rotation_about_z(angle_rad)
    return matrix


# Compliance of a tree of members: the sum of the members' compliances over the load paths that contain them.


class ComplianceChain:
    """A tree of elastic members, clamped at its root and free elsewhere.

    Parameters
    ----------
    skeleton : Skeleton
        The members.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton

    @cached_property
    def _global(self) -> list[Array]:
        """Compliance of every member at its end, in global axes, by equation (5) of Hricko and Havlik (2015)."""
        turned_all = []
        for member in self.skeleton.members:
            angle = np.arctan2(member.end_mm[1] - member.start_mm[1], member.end_mm[0] - member.start_mm[0])
            axes = turned(float(angle))
            turned_all.append(axes @ member.compliance @ axes.T)
        return turned_all

    def path(self, member: int) -> list[int]:
        """List the members on the path from the clamp to the end of a given member."""
        path = []
        while member >= 0:
            path.append(member)
            member = self.skeleton.members[member].parent
        return path[::-1]

    @cached_property
    def _whole(self) -> Array:
        """Motion of each member's end under loads at each member's end, in 6 by 6 blocks; shape (6 n, 6 n)."""
        members = self.skeleton.members
        paths = [set(self.path(place)) for place in range(len(members))]
        total = np.zeros((6 * len(members), 6 * len(members)))
        for place, compliance in enumerate(self._global):
            if compliance.any():
                carry = np.zeros((len(members), 6, 6))
                for end in range(len(members)):
                    if place in paths[end]:
                        carry[end] = carried(_arm(members[place], members[end]))
                stacked = carry.reshape(-1, 6)
                total += stacked @ compliance @ stacked.T
        return total

    def flexibility(self, moved: int, loaded: int) -> Array:
        """Motion of one member's end under a load at another member's end: equation (12) of Hricko and Havlik (2015).

        Returns
        -------
        ndarray of float, shape (6, 6)
            The transpose is the flexibility with the two members exchanged (reciprocity theorem of Maxwell and Betti).
        """
        return self._whole[6 * moved : 6 * moved + 6, 6 * loaded : 6 * loaded + 6]


def _arm(known: Member, wanted: Member) -> Array:
    return np.array([wanted.end_mm[0] - known.end_mm[0], wanted.end_mm[1] - known.end_mm[1], 0.0])


KIND = "stiffness_matrix"
TRUST, SMALL_DISPLACEMENTS_ALONE = 1, True

_X, _Y, _Z, _ABOUT_X, _ABOUT_Y, _ABOUT_Z = range(6)
_ALL = (_X, _Y, _Z, _ABOUT_X, _ABOUT_Y, _ABOUT_Z)
_SLOPE_ERROR, _FORCE_ERROR = 0.01, 0.03
"""Relative errors of slope and force of a model of bars joined at points, as in `lumped`."""
_OUT_OF_PLANE_ERROR, _SAG_ERROR = 0.4, 0.5
"""Relative errors out of the plane of a model of bars joined at points, by comparison with CalculiX
(`tests/benchmarks/models_three_dimensions.py`): frequencies are from 34 % too low for a hinge 20 times as wide as thick
to 17 % too high for a stiff variant."""


class StiffnessMatrixGripper:
    """Stiffness-matrix model of a gripper with two halves in parallel, for small displacements in and out of the plane.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    theory : HingeTheory
        Theory of the hinges' compliance.
    rigid_links : bool
        Whether only the hinges are elastic.
    """

    name = KIND

    def __init__(
        self, gripper: Gripper, theory: HingeTheory = HingeTheory.CORRECTED, *, rigid_links: bool = False
    ) -> None:
        self.gripper, self.theory = gripper, theory
        self.skeleton = skeleton_of(gripper, theory, 0, rigid_links=rigid_links)
        self._chain = ComplianceChain(self.skeleton)

    @property
    def input_range_mm(self) -> tuple[float, float]:
        """Smallest and largest input for which the model is valid (mm)."""
        return covered_inputs_mm(self.gripper, self.first_touch_mm)

    @property
    def rest_gap_mm(self) -> float:
        """The gap at zero input (mm)."""
        return 2.0 * self.gripper.measuring_point_mm[0]

    @cached_property
    def drive_compliance(self) -> Array:
        """Compliance C_2A of one half at the drive point O_A: equation (14) of Hricko & Havlik (2015), (6, 6)."""
        return self._chain.flexibility(self.skeleton.drive, self.skeleton.drive)

    @cached_property
    def drive_stiffness(self) -> Array:
        """Stiffness K_2A of both halves at the drive point: equation (15) of Hricko & Havlik (2015), shape (6, 6).

        Every direction is fixed. Entries that change sign under reflection cancel between the halves.
        """
        mirror = np.diag([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
        half = np.linalg.inv(self.drive_compliance)
        return np.asarray(half + mirror @ half @ mirror)

    @cached_property
    def _load_by_input(self) -> Array:
        """Load on one half's drive point per 1 mm of input, with sideways motion and rotation fixed."""
        return np.asarray(np.linalg.inv(self.drive_compliance)[:, _Y])

    @cached_property
    def gap_per_input(self) -> float:
        """Ratio of gap to input (mm per mm)."""
        flexibility = self._chain.flexibility(self.skeleton.measured, self.skeleton.drive)
        return 2.0 * float((flexibility @ self._load_by_input)[_X])

    @property
    def input_stiffness_n_mm(self) -> float:
        """Force at the drive per input, of both halves (N/mm)."""
        return float(self.drive_stiffness[_Y, _Y])

    def _held_flexibility(self, moved: int, loaded: int, held: tuple[int, ...]) -> Array:
        """Flexibility with some directions of the drive point held fixed."""
        drive, chain, rows = self.skeleton.drive, self._chain, list(held)
        reaction = np.linalg.solve(self.drive_compliance[np.ix_(rows, rows)], chain.flexibility(drive, loaded)[rows])
        return chain.flexibility(moved, loaded) - chain.flexibility(moved, drive)[:, rows] @ reaction

    @cached_property
    def finger_stiffness_n_mm(self) -> float:
        """Stiffness of one finger at the tip's corner across the gap, with the drive fixed (N/mm)."""
        corner = self.skeleton.corner
        return 1.0 / float(self._held_flexibility(corner, corner, _ALL)[_X, _X])

    def grip_force_n(self, input_mm: float, part: Part) -> float:
        """Force of each finger on a part between the tips' corners (N); 0 if the part is not touched."""
        corner_mm = 2.0 * self.gripper.tip_corner_mm[0] + 2.0 * self._corner_per_input * input_mm
        yielding_mm_n = 1.0 / self.finger_stiffness_n_mm + 0.5 / part.stiffness_n_mm
        return max(0.0, 0.5 * (part.width_mm - corner_mm) / yielding_mm_n)

    def gravity_sag_mm(self, *, drive_held: bool = True) -> tuple[float, float]:
        """Out-of-plane sag of the measuring point in a horizontal plate, and the tip's rotation about the finger (y).

        Parameters
        ----------
        drive_held : bool
            Whether the actuator supports the drive point against motion out of the plane.

        Returns
        -------
        sag_mm, twist_rad : float
            Sag and rotation under one standard gravity.
        """
        held = _ALL if drive_held else tuple(direction for direction in _ALL if direction != _Z)
        sag = np.zeros(6)
        for place, member in enumerate(self.skeleton.members):
            weight_n = member.mass_t * STANDARD_GRAVITY_MM_S2
            if weight_n > 0.0:
                load = np.zeros(6)
                load[_Z] = weight_n
                # The weight acts at the middle of the member, half a length before the member's end.
                load[_ABOUT_X] = -0.5 * (member.end_mm[1] - member.start_mm[1]) * weight_n
                load[_ABOUT_Y] = 0.5 * (member.end_mm[0] - member.start_mm[0]) * weight_n
                sag += self._held_flexibility(self.skeleton.measured, place, held) @ load
        return float(sag[_Z]), float(sag[_ABOUT_Y])

    def out_of_plane_modes_hz(self, *, count: int = 1) -> tuple[float, ...]:
        """First natural frequencies out of the plane, with the drive fixed (Hz).

        The eigenvalues of the flexibility matrix times the mass matrix, both for the members' centres, are 1 / omega^2.
        Bars joined at points are too stiff out of the plane: 72 Hz for the published gripper, compared with 62 Hz for
        three-dimensional brick elements.
        """
        heavy = [place for place, member in enumerate(self.skeleton.members) if member.mass_t > 0.0]
        flexibility = np.block([[self._held_flexibility(i, j, _ALL)[_Z:_ABOUT_Z, _Z:_ABOUT_Z] for j in heavy]
                                for i in heavy])  # fmt: skip
        mass = block_diag(*(_lifted_mass(self.skeleton.members[place], self.gripper.body.plate_mm) for place in heavy))
        # M^(1/2) F M^(1/2) is symmetric and has the eigenvalues of F M.
        root = np.linalg.cholesky(mass)
        inverse = np.linalg.eigvalsh(root.T @ flexibility @ root)[::-1][:count]
        return tuple((1.0 / (2.0 * np.pi * np.sqrt(inverse))).tolist())

    def respond(self, input_mm: Array) -> Response:
        """Compute the static response at each input."""
        inputs = np.asarray(input_mm, dtype=float)
        right = 0.5 * (self.rest_gap_mm + self.gap_per_input * inputs)
        return Response(left_mm=-right, right_mm=right, force_n=self.input_stiffness_n_mm * inputs)

    def body_poses(self, input_mm: Array) -> dict[str, Array]:
        """Poses of the bodies at each input: x_mm, y_mm, angle_mrad, shape (n, 3) each.

        The stiffness matrix is condensed from the members; for poses the members themselves are used.
        """
        return LumpedGripper(self.gripper, theory=self.theory, bars_alone=True, segments=0).body_poses(input_mm)

    @cached_property
    def _corner_per_input(self) -> float:
        """Motion of one tip's corner perpendicular to the symmetry plane per 1 mm of input."""
        flexibility = self._chain.flexibility(self.skeleton.corner, self.skeleton.drive)
        return float((flexibility @ self._load_by_input)[_X])

    @cached_property
    def first_touch_mm(self) -> float | None:
        """Input at which the tip's corner meets the symmetry plane (mm); None if the corner does not move."""
        slope = self._corner_per_input
        return -self.gripper.tip_corner_mm[0] / slope if slope > 0.0 else None

    def figures(self) -> ModelFigures:
        """Characteristic numbers of the model for the comparison table."""
        return ModelFigures(
            self.gap_per_input,
            self.input_stiffness_n_mm,
            contact_input_mm=self.first_touch_mm,
            out_of_plane_modes_hz=self.out_of_plane_modes_hz(),
            sag_out_of_plane_mm=self.gravity_sag_mm()[0],
            slope_error=_SLOPE_ERROR,
            force_error=_FORCE_ERROR,
            out_of_plane_error=_OUT_OF_PLANE_ERROR,
            sag_error=_SAG_ERROR,
        )


def _lifted_mass(member: Member, plate_mm: float) -> Array:
    """Mass matrix of a member at its end, for motion along z and rotation about x and y.

    The mass matrix of a bar is rotated to global axes and transferred to the member's end.
    """
    axis = np.subtract(member.end_mm, member.start_mm)
    length = float(np.hypot(*axis))
    along = axis / length
    turn = np.array([along, [-along[1], along[0]]])
    about_axis, about_side = (member.width_mm**2 + plate_mm**2) / 12.0, (length**2 + plate_mm**2) / 12.0
    # The middle lies half an axis length before the end; its displacement along z is z + y about_x - x about_y.
    middle = np.array([1.0, -0.5 * axis[1], 0.5 * axis[0]])
    mass = np.outer(middle, middle)
    mass[1:, 1:] += turn.T @ np.diag([about_axis, about_side]) @ turn
    return np.asarray(member.mass_t * mass)


def build(gripper: Gripper, physics: Physics, theory: HingeTheory) -> StiffnessMatrixGripper:
    """Build the model; see `fingervision.models.kinds`."""
    if physics != LINEAR:
        raise UsageError("The stiffness matrix handles small displacements only; take --kind lumped or finite_element.")
    return StiffnessMatrixGripper(gripper, theory)
