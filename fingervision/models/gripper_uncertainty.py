"""Uncertainty of a gripper's characteristic numbers from the stated uncertainties of its dimensions."""

from collections.abc import Mapping, Sequence
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError, ModelError
from fingervision.domain.gripper import Gripper
from fingervision.domain.parameter import Estimate
from fingervision.models.changed_drawings import in_ratio
from fingervision.models.gripper_figures import gripper_figures
from fingervision.models.gripper_outline import check_outline
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.lumped import LumpedGripper
from fingervision.models.physics import LINEAR, Physics
from fingervision.models.redrawn import redrawn
from fingervision.models.stiffness_matrix import StiffnessMatrixGripper
from fingervision.models.uncertainty import FigureUncertainty, propagate

_ANY_SIGN = ("_deg", "l1_mm", "l2_mm", "l3_mm", "l4_mm", "face_y_mm", "_per_k")
_MOST_POISSON = 0.5


def gripper_uncertainty(
    gripper: Gripper,
    inputs: Sequence[float] | NDArray[np.float64],
    theory: HingeTheory = HingeTheory.CORRECTED,
    physics: Physics = LINEAR,
) -> dict[str, FigureUncertainty]:
    """Propagate the stated uncertainties of a drawing to every number of `gripper_figures`.

    The numbers of drawings with changed dimensions come from the lumped model, and out-of-plane numbers from the
    stiffness matrix. Both models are used for small displacements, with contact if the physics includes contact. A bar
    model computes the ratio of each changed number to that of the given drawing (`changed_drawings`). Finite elements
    for every changed drawing would take minutes, whereas an uncertainty needs only two digits. The uncertainty from the
    lumped model is stated for all kinds of model.

    Parameters
    ----------
    gripper : Gripper
        Drawing with its `uncertainties`.
    inputs : sequence of float
        Inputs whose smallest and largest value are the ends of the range.
    theory : HingeTheory
        Theory of the hinges' compliance.
    physics : Physics
        Which effects beyond small displacements are included.
    """
    check_uncertainties(gripper)
    numbers = _numbers(gripper)

    touching = Physics(contact=physics.contact)

    def by_bars(changes: Mapping[str, float]) -> dict[str, float | None]:
        drawn = _changed(gripper, changes)
        return gripper_figures(drawn, LumpedGripper(drawn, touching, theory, bars_alone=True), inputs)

    def out_of_plane(changes: Mapping[str, float]) -> dict[str, float | None]:
        flat = StiffnessMatrixGripper(_changed(gripper, changes), theory)
        return {
            "first_out_of_plane_mode_hz": flat.out_of_plane_modes_hz()[0],
            "sag_out_of_plane_mm": flat.gravity_sag_mm()[0],
        }

    in_plane = in_ratio(by_bars, gripper_figures(gripper, LumpedGripper(gripper, touching, theory), inputs))
    return propagate(in_plane, numbers) | propagate(out_of_plane, numbers)


def check_uncertainties(gripper: Gripper) -> None:
    """Refuse stated uncertainties for which no changed drawing exists.

    Raises
    ------
    DataError, ModelError
        If a change of a dimension by one standard uncertainty in either direction gives no valid gripper.
    """
    for name, estimate in _numbers(gripper).items():
        for by in (-(estimate.u or 0.0), estimate.u or 0.0):
            try:
                drawn = _changed(gripper, {name: by})
                check_outline(drawn, "the changed drawing")
            except FingervisionError as error:
                raise ModelError(
                    f"The uncertainty of {name} is too large: with {name} = {estimate.value + by:g}, one standard "
                    f"uncertainty from its stated value, the drawing is invalid ({str(error).rstrip('.')}). State a "
                    "smaller uncertainty."
                ) from error


def _numbers(gripper: Gripper) -> dict[str, Estimate]:
    return {name: Estimate(attrgetter(name)(gripper), u) for name, u in gripper.uncertainties.items() if u > 0.0}


def _changed(gripper: Gripper, changes: Mapping[str, float]) -> Gripper:
    """Return the gripper with changed dimensions; refuse dimensions that are not possible for a gripper."""
    for name, by in changes.items():
        value = attrgetter(name)(gripper) + by
        if not name.endswith(_ANY_SIGN) and value <= 0.0:
            raise ModelError(f"{name} must be positive, but its uncertainty includes {value:g}: state a smaller u.")
        if name == "material.poisson_ratio" and value >= _MOST_POISSON:
            raise ModelError(f"{name} must be below 0.5, but its uncertainty includes {value:g}: state a smaller u.")
    for name, by in changes.items():
        gripper = redrawn(gripper, name, by)
    return gripper
