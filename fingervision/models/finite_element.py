"""The gripper by finite elements (the paper's Comsol model): plane stress of the real outline.

One half is solved under the symmetry constraint: the lower face of the pillar is clamped, the symmetry axis cannot
move across itself, the drive face moves by the input. The reference gripper at the mesh limit: 7.7212 mm of gap per
millimetre of input, 2.0014 N/mm, 19.07 MPa/mm. Its link length was chosen so that this slope is the one that the paper
printed for Comsol; the two agreeing is therefore no validation.
"""

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import Gripper
from fingervision.domain.response import Response
from fingervision.models.answer_figures import ModelFigures, PeakStress
from fingervision.models.covered_inputs import covered_inputs_mm
from fingervision.models.half_plate import half_plate
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.mesh_outline import PlaneMesh, notch_centres_mm
from fingervision.models.physics import LINEAR, Physics
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.reference_mesh import mesh_of
from fingervision.models.static_answer import gap_per_input, symmetric_response

KIND = "finite_element"

_MODES = 3
_ON_NOTCH = 1e-6


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
        self.plate = PlaneStressPlate(mesh or mesh_of(gripper), gripper.material, gripper.body.plate_mm)
        self.half = half_plate(gripper, self.plate)

    @property
    def input_range_mm(self) -> tuple[float, float]:
        """Smallest and largest input that the model is meant for."""
        return covered_inputs_mm(self.gripper, self.half.first_touch_mm())

    @property
    def rest_gap_mm(self) -> float:
        """The gap at input zero."""
        return 2.0 * self.half.measured_rest_mm

    def respond(self, input_mm: NDArray[np.float64]) -> Response:
        """Answer statically at each input."""
        return symmetric_response(self.half, self.physics, input_mm)

    def peak_stress(self) -> PeakStress:
        """Largest von Mises stress on the notches by 1 mm of input; re-entrant corners are singular and left out."""
        stress = self.plate.von_mises_mpa(self.half.unit_displacement_mm)
        x, y = self.plate.nodes_mm[:, self.plate.corner_triangles]
        radius_mm = self.gripper.hinge.radius_mm
        on_notch = np.zeros(stress.shape, dtype=bool)
        for centre_x, centre_y in notch_centres_mm(self.gripper):
            on_notch |= np.abs(np.hypot(x - centre_x, y - centre_y) - radius_mm) < _ON_NOTCH * radius_mm
        place = np.unravel_index(np.argmax(np.where(on_notch, stress, 0.0)), stress.shape)
        return PeakStress(float(stress[place]), (float(x[place]), float(y[place])))

    def modes_hz(self, *, drive_held: bool, count: int = _MODES) -> tuple[float, ...]:
        """First symmetric in-plane natural frequencies, without the actuator's mass."""
        rad_s, _ = self.half.modes(drive_held=drive_held, count=count)
        return tuple((rad_s / (2.0 * np.pi)).tolist())

    def swaying_modes_hz(self, *, count: int = 1) -> tuple[float, ...]:
        """First antisymmetric in-plane natural frequencies, the drive free to go sideways."""
        rad_s, _ = self.half.swaying_modes(count=count)
        return tuple((rad_s / (2.0 * np.pi)).tolist())

    def figures(self) -> ModelFigures:
        """Compute the model's row of the comparison."""
        return ModelFigures(
            gap_per_input(self.half),
            self.half.equilibrium(1.0).force_n,
            self.peak_stress(),
            self.modes_hz(drive_held=False),
            self.modes_hz(drive_held=True),
            self.half.first_touch_mm(),
            self.swaying_modes_hz(),
        )


def build(gripper: Gripper, physics: Physics, theory: HingeTheory) -> FiniteElementGripper:
    """Build the model; see `fingervision.models.kinds`."""
    del theory  # the outline itself says how its hinges yield
    return FiniteElementGripper(gripper, physics)
