"""Finite-element model of the gripper: its outline as a plane body (Hricko & Havlik (2015) used Comsol).

One half of the gripper is solved under the symmetry constraint: the lower face of the pillar is clamped, points on the
symmetry axis cannot move perpendicular to it, and the drive face moves by the input. The plate is in plane stress; its
hinges lie between plane stress and plane strain, depending on their width (`width_effect`). For the published gripper
in plane stress, a converged mesh gives 7.7212 mm of gap per millimetre of input, a stiffness of 2.0014 N/mm and a
stress of 19.07 MPa/mm; including the width of the hinges the stiffness is 2.06 N/mm, as with three-dimensional brick
elements. The link length of the published gripper is unknown and was chosen so that the slope equals the published
slope of the Comsol model; the agreement of the two slopes is therefore no validation.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import Gripper, PointMm
from fingervision.domain.response import Response
from fingervision.models.answer_figures import LoadedState, ModelFigures, PeakStress
from fingervision.models.covered_inputs import covered_inputs_mm
from fingervision.models.driven_body import Equilibrium
from fingervision.models.gripper_bodies import gripper_poses, poses_of_plate
from fingervision.models.gripper_mechanism import half_mechanism
from fingervision.models.gripper_outline import notch_centres_mm
from fingervision.models.half_plate import half_plate
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.out_of_plane import MODE_ERROR, SAG_ERROR, OutOfPlane, out_of_plane
from fingervision.models.physics import LINEAR, Physics
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.reference_mesh import mesh_of
from fingervision.models.static_answer import (
    contact_onset_mm,
    equilibria,
    gap_per_input,
    loaded_state,
    symmetric_response,
)
from fingervision.models.triangulate import PlaneMesh
from fingervision.models.width_effect import force_uncertainty, gripper_zones

KIND = "finite_element"
TRUST, WHY_TRUSTED = (
    3,
    "it models the outline itself, whereas the other model replaces the body by bars and notches joined at points",
)

_MODES = 3
_ON_NOTCH = 1e-6
_SLOPE_ERROR, _FORCE_ERROR, _MODE_ERROR = 0.001, 0.005, 0.01
"""Relative errors of the mesh, estimated from finer meshes and published values
(`tests/benchmarks/models_held_out.py`)."""


class FiniteElementGripper:
    """A meshed gripper with two identical halves.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    physics : Physics
        Which effects beyond small displacements are included.
    mesh : PlaneMesh or None
        Triangles of the right half; None loads the packaged mesh for the reference outline and makes a new mesh for
        others.
    width_effect : bool
        Whether the constraint of the hinges by the plate's width is included; if False, plane stress holds everywhere.

    Raises
    ------
    FingervisionError
        If the gripper cannot be meshed, or its body does not reach the clamp, the symmetry axis or the drive.
    """

    name = KIND

    def __init__(
        self, gripper: Gripper, physics: Physics = LINEAR, mesh: PlaneMesh | None = None, *, width_effect: bool = True
    ) -> None:
        self.gripper = gripper
        self.physics = physics
        self.mesh = mesh or mesh_of(gripper)
        zones = gripper_zones(gripper) if width_effect else ()
        self.plate = PlaneStressPlate(self.mesh, gripper.material, gripper.body.plate_mm, zones)
        self.half = half_plate(gripper, self.plate)

    @property
    def input_range_mm(self) -> tuple[float, float]:
        """Smallest and largest input for which the model is valid (mm)."""
        return covered_inputs_mm(self.gripper, self.half.first_touch_mm())

    @property
    def rest_gap_mm(self) -> float:
        """The gap at zero input (mm)."""
        return 2.0 * self.half.measured_rest_mm

    def respond(self, input_mm: NDArray[np.float64]) -> Response:
        """Compute the static response at each input."""
        return symmetric_response(self.half, self.physics, input_mm)

    def body_poses(self, input_mm: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Poses of the bodies at each input: x_mm, y_mm, angle_mrad, shape (n, 3) each."""
        poses = poses_of_plate(self.plate, self.gripper, large=self.physics.large_rotation)
        return gripper_poses(self.half, self.physics, poses, input_mm)

    def peak_stress(self) -> PeakStress:
        """Largest von Mises stress in the notches per 1 mm of input.

        Re-entrant corners, where the stress is singular, are excluded.
        """
        return PeakStress(*self._peak(self.plate.von_mises_mpa(self.half.unit_displacement_mm)))

    def equilibria(self, inputs_mm: Sequence[float]) -> list[Equilibrium]:
        """Equilibria at the given inputs, with the physics that the model includes."""
        return equilibria(self.half, self.physics, inputs_mm)

    def loaded(self, inputs_mm: Sequence[float]) -> list[LoadedState]:
        """Gap, forces and largest stress at the given inputs, in the deformed shape if the model includes it."""
        return [self.stressed(state) for state in self.equilibria(inputs_mm)]

    def stressed(self, state: Equilibrium) -> LoadedState:
        """Gap, forces and largest stress of one equilibrium."""
        stress = self.plate.von_mises_mpa(state.displacement_mm, large=self.physics.large_rotation)
        return loaded_state(self.half, state, *self._peak(stress))

    def _peak(self, stress: NDArray[np.float64]) -> tuple[float, PointMm]:
        x, y = self.plate.nodes_mm[:, self.plate.corner_triangles]
        radius_mm = self.gripper.hinge.radius_mm
        on_notch = np.zeros(stress.shape, dtype=bool)
        for centre_x, centre_y in notch_centres_mm(self.gripper):
            on_notch |= np.abs(np.hypot(x - centre_x, y - centre_y) - radius_mm) < _ON_NOTCH * radius_mm
        place = np.unravel_index(np.argmax(np.where(on_notch, stress, 0.0)), stress.shape)
        return float(stress[place]), (float(x[place]), float(y[place]))

    def modes_hz(self, *, drive_held: bool, count: int = _MODES) -> tuple[float, ...]:
        """First symmetric in-plane natural frequencies, without the actuator's mass."""
        rad_s, _ = self.half.modes(drive_held=drive_held, count=count)
        return tuple((rad_s / (2.0 * np.pi)).tolist())

    def swaying_modes_hz(self, *, count: int = 1) -> tuple[float, ...]:
        """First antisymmetric in-plane natural frequencies, with the drive free to move sideways (Hz)."""
        rad_s, _ = self.half.swaying_modes(count=count)
        return tuple((rad_s / (2.0 * np.pi)).tolist())

    @cached_property
    def across_plane(self) -> OutOfPlane:
        """First mode and sag out of the plane, with the drive fixed, computed in three dimensions (`deep_plate`)."""
        return out_of_plane(half_mechanism(self.gripper))

    def figures(self) -> ModelFigures:
        """Characteristic numbers (slope, stiffness, stress, frequencies) of the model for the comparison table."""
        return ModelFigures(
            gap_per_input(self.half),
            self.half.equilibrium(1.0).force_n,
            self.peak_stress(),
            self.modes_hz(drive_held=False),
            self.modes_hz(drive_held=True),
            contact_onset_mm(self.half, self.physics),
            self.swaying_modes_hz(),
            self.across_plane.modes_hz,
            self.across_plane.sag_mm["tip"],
            slope_error=_SLOPE_ERROR,
            force_error=_FORCE_ERROR + 2.0 * force_uncertainty(self.gripper.material),
            mode_error=_MODE_ERROR + force_uncertainty(self.gripper.material),
            out_of_plane_error=MODE_ERROR,
            sag_error=SAG_ERROR,
            grip_error=_FORCE_ERROR + 2.0 * force_uncertainty(self.gripper.material),
        )


def build(gripper: Gripper, physics: Physics, theory: HingeTheory) -> FiniteElementGripper:
    """Build the model; see `fingervision.models.kinds`."""
    del theory  # `theory` is not used: the compliance of the hinges follows from the outline
    return FiniteElementGripper(gripper, physics)
