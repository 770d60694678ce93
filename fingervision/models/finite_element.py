"""The gripper by finite elements (the paper's Comsol model): plane stress of the real outline.

One half is solved under the symmetry constraint: the lower face of the pillar is clamped, the symmetry axis cannot
move across itself, the drive face moves by the input. The reference gripper at the mesh limit: 7.7212 mm of gap per
millimetre of input, 2.0014 N/mm, 19.07 MPa/mm. Its link length was chosen so that this slope is the one that the paper
printed for Comsol; the two agreeing is therefore no validation.
"""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.sparse.linalg import eigsh

from fingervision.domain.gripper import Gripper, PointMm
from fingervision.domain.response import Response
from fingervision.models.answer_figures import ModelFigures, PeakStress
from fingervision.models.half_body import Equilibrium, HalfBody
from fingervision.models.large_rotation import large_equilibrium, large_path
from fingervision.models.mesh_outline import PlaneMesh, notch_centres_mm
from fingervision.models.physics import LINEAR, Physics
from fingervision.models.reference_mesh import mesh_of
from fingervision.models.signorini import contact_forces_n

Array = NDArray[np.float64]

KIND = "finite_element"

_MODES = 3


class FiniteElementGripper:
    """A meshed gripper, both halves alike.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    physics : Physics
        What goes beyond small displacements.
    mesh : PlaneMesh or None
        Triangles of the right half; None takes the packaged mesh of the reference outline, or meshes with gmsh.

    Raises
    ------
    FingervisionError
        Where the gripper must be meshed and cannot be, or its body does not reach the clamp, the axis or the drive.
    """

    name = KIND

    def __init__(self, gripper: Gripper, physics: Physics = LINEAR, mesh: PlaneMesh | None = None) -> None:
        self.gripper = gripper
        self.physics = physics
        self.half = HalfBody(gripper, mesh or mesh_of(gripper))

    @property
    def rest_gap_mm(self) -> float:
        """The gap at input zero."""
        return 2.0 * self.gripper.measuring_point_mm[0]

    def equilibrium(self, input_mm: float) -> Equilibrium:
        """Small displacements at one input, with contact where it is switched on."""
        half = self.half
        moved = input_mm * half.unit_displacement_mm
        contact = np.zeros(half.face.size)
        if self.physics.contact:
            free_gap = half.face_gap_mm(moved)
            if free_gap.min() < 0.0:
                by_force, compliance = half.face_compliance
                contact = contact_forces_n(compliance, free_gap)
                moved = moved + by_force @ contact
        force_n = 2.0 * float((half.plate.stiffness_n_mm @ moved)[half.driven].sum())
        return Equilibrium(input_mm, moved, force_n, contact)

    def large_equilibrium(self, input_mm: float, start: Equilibrium | None = None) -> Equilibrium:
        """Equilibrium in the deformed shape at one input, from a neighbouring one."""
        return large_equilibrium(self.half, input_mm, start or self.half.resting(), contact=self.physics.contact)

    def respond(self, input_mm: Array) -> Response:
        """Static answer at each input; in large rotation interpolated between equilibria along the path.

        Contact is solved at every input by itself where displacements are small.
        """
        inputs = np.asarray(input_mm, dtype=float)
        if self.physics.large_rotation:
            right, force = self._large_curves(inputs)
        elif self.physics.contact:
            states = {value: self.equilibrium(value) for value in np.unique(inputs).tolist()}
            right = np.array(
                [self.half.measuring_point_x_mm(states[value].displacement_mm) for value in inputs.tolist()]
            )
            force = np.array([states[value].force_n for value in inputs.tolist()])
        else:
            unit = self.half.unit_displacement_mm
            rest_mm = self.gripper.measuring_point_mm[0]
            right = rest_mm + inputs * (self.half.measuring_point_x_mm(unit) - rest_mm)
            force = inputs * self.figures_linear[1]
        return Response(left_mm=-right, right_mm=right, force_n=force)

    def _large_curves(self, inputs: Array) -> tuple[Array, Array]:
        contact = self.physics.contact
        states = large_path(self.half, min(float(inputs.min(initial=0.0)), -1e-3), contact=contact)[::-1]
        states += large_path(self.half, max(float(inputs.max(initial=0.0)), 1e-3), contact=contact)[1:]
        at = np.array([state.input_mm for state in states])
        right = np.array([self.half.measuring_point_x_mm(state.displacement_mm) for state in states])
        force = np.array([state.force_n for state in states])
        free = np.array([not state.contact_n.any() for state in states])
        curves = []
        for curve in (right, force):
            smooth = CubicSpline(at[free], curve[free])(inputs)
            # Contact bends the curve sharply: there the pieces are straight, from where the tip first touches.
            touched = np.interp(inputs, at, curve)
            curves.append(np.where(inputs < at[free][0], touched, smooth))
        return curves[0], curves[1]

    @cached_property
    def figures_linear(self) -> tuple[float, float]:
        """Gap per input, and force at the drive per input of both halves in N/mm."""
        unit = self.half.unit_displacement_mm
        rest_mm = self.gripper.measuring_point_mm[0]
        force_n = 2.0 * float((self.half.plate.stiffness_n_mm @ unit)[self.half.driven].sum())
        return 2.0 * (self.half.measuring_point_x_mm(unit) - rest_mm), force_n

    def contact_input_mm(self) -> float:
        """Input at which the first point of the inner face meets the symmetry plane, small displacements."""
        slope = self.half.unit_displacement_mm[self.half.plate.x_dofs[self.half.face]]
        return float(np.max(-self.half.plate.nodes_mm[0, self.half.face] / slope))

    def peak_stress(self) -> PeakStress:
        """Largest von Mises stress on the notches; re-entrant corners are singular and left out."""
        stress = self.half.plate.von_mises_mpa(self.half.unit_displacement_mm)
        x, y = self.half.plate.nodes_mm[:, self.half.plate.corner_triangles]
        on_notch = np.zeros(stress.shape, dtype=bool)
        for centre_x, centre_y in notch_centres_mm(self.gripper):
            radius = np.hypot(x - centre_x, y - centre_y)
            on_notch |= np.abs(radius - self.gripper.hinge.radius_mm) < 1e-6 * self.gripper.hinge.radius_mm
        place = np.unravel_index(np.argmax(np.where(on_notch, stress, 0.0)), stress.shape)
        at: PointMm = (float(x[place]), float(y[place]))
        return PeakStress(float(stress[place]), at)

    def modes_hz(self, *, drive_held: bool, count: int = _MODES) -> Array:
        """First symmetric in-plane natural frequencies, without the actuator's mass.

        Parameters
        ----------
        drive_held : bool
            Whether the drive face is held along its axis.
        count : int
            How many.
        """
        free = self.half.free if drive_held else np.union1d(self.half.free, self.half.driven)
        stiffness = self.half.plate.stiffness_n_mm[free][:, free].tocsc()
        mass = self.half.plate.mass_t[free][:, free].tocsc()
        start = np.ones(free.size)
        squared = eigsh(stiffness, count, mass, sigma=0.0, return_eigenvectors=False, v0=start)
        return np.sort(np.sqrt(squared)) / (2.0 * np.pi)

    def figures(self) -> ModelFigures:
        """The model's row of the comparison."""
        gap_per_input, stiffness = self.figures_linear
        return ModelFigures(
            gap_per_input,
            stiffness,
            self.peak_stress(),
            tuple(self.modes_hz(drive_held=False).tolist()),
            tuple(self.modes_hz(drive_held=True).tolist()),
            self.contact_input_mm(),
        )
