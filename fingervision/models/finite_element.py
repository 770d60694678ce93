"""Finite-element model of the gripper: its outline as a plane body (Hricko & Havlik (2015) used Comsol).

The plate is in plane stress; its hinges lie between plane stress and plane strain, depending on their width
(`width_effect`). For the published gripper in plane stress, a converged mesh gives 7.7212 mm of gap per millimetre of
input, a stiffness of 2.0014 N/mm and a stress of 19.07 MPa/mm; including the width of the hinges the stiffness is 2.06
N/mm, as with three-dimensional brick elements. The link length of the published gripper is unknown and was chosen so
that the slope equals the published slope of the Comsol model; the agreement of the two slopes is therefore no
validation.
"""

from dataclasses import replace
from functools import cached_property

from fingervision.domain.gripper import Gripper
from fingervision.models.answer_figures import ModelFigures
from fingervision.models.gripper_mechanism import half_mechanism
from fingervision.models.gripper_model import DrawnGripper, ModelErrors
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.mechanism_plate import MechanismPlate
from fingervision.models.out_of_plane import MODE_ERROR, SAG_ERROR, OutOfPlane, out_of_plane
from fingervision.models.physics import LINEAR, Physics
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.reference_mesh import mesh_of
from fingervision.models.triangulate import PlaneMesh
from fingervision.models.width_effect import force_uncertainty

KIND = "finite_element"
TRUST, WHY_TRUSTED = (
    3,
    "it models the outline itself, whereas the other model replaces the body by bars and notches joined at points",
)

_SLOPE_ERROR, _FORCE_ERROR, _MODE_ERROR = 0.001, 0.005, 0.01
"""Relative errors of the mesh, estimated from finer meshes and published values
(`tests/benchmarks/models_held_out.py`)."""


class FiniteElementGripper(DrawnGripper):
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
        self.plane = MechanismPlate(half_mechanism(gripper), mesh=mesh or mesh_of(gripper), width_effect=width_effect)
        width = force_uncertainty(gripper.material)
        force = _FORCE_ERROR + 2.0 * width
        super().__init__(gripper, physics, self.plane, ModelErrors(_SLOPE_ERROR, force, _MODE_ERROR + width, force))

    @property
    def mesh(self) -> PlaneMesh:
        """Triangles of the right half."""
        return self.plane.mesh

    @property
    def plate(self) -> PlaneStressPlate:
        """The meshed right half, as thick as both halves."""
        return self.plane.plate

    @cached_property
    def across_plane(self) -> OutOfPlane:
        """First mode and sag out of the plane, with the drive fixed, computed in three dimensions (`deep_plate`)."""
        return out_of_plane(self.plane.mechanism)

    def figures(self) -> ModelFigures:
        """Characteristic numbers of the model for the comparison table."""
        return replace(
            super().figures(),
            out_of_plane_modes_hz=self.across_plane.modes_hz,
            sag_out_of_plane_mm=self.across_plane.sag_mm["right tip"],
            out_of_plane_error=MODE_ERROR,
            sag_error=SAG_ERROR,
        )


def build(gripper: Gripper, physics: Physics, theory: HingeTheory) -> FiniteElementGripper:
    """Build the model; see `fingervision.models.kinds`."""
    del theory  # `theory` is not used: the compliance of the hinges follows from the outline
    return FiniteElementGripper(gripper, physics)
