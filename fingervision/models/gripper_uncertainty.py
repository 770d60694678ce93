"""Uncertainty of a gripper's figures from the stated uncertainties of its dimensions."""

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
    """Propagate the stated uncertainties of a drawing to every figure of `gripper_figures`.

    The figures of changed drawings come from the lumped model (out of the plane from the stiffness matrix), with small
    displacements, with contact where the physics includes it; a bar model gives their ratio to the drawing's own
    (`changed_drawings`). Finite elements for every changed drawing would take minutes, and an uncertainty needs two
    digits only. The same uncertainty is stated for the figures of the other kinds of model.

    Parameters
    ----------
    gripper : Gripper
        With its `uncertainties`.
    inputs : sequence of float
        Whose smallest and largest are the ends.
    theory : HingeTheory
        Of the hinges.
    physics : Physics
        Of the figures.
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
        Where one standard uncertainty either way leaves no gripper.
    """
    for name, estimate in _numbers(gripper).items():
        for by in (-(estimate.u or 0.0), estimate.u or 0.0):
            try:
                drawn = _changed(gripper, {name: by})
                check_outline(drawn, "the drawing so changed")
            except FingervisionError as error:
                raise ModelError(
                    f"The uncertainty of {name} must leave a drawing that works, but at {estimate.value + by:g} (one "
                    f"standard uncertainty away) it does not: {error}"
                ) from error


def _numbers(gripper: Gripper) -> dict[str, Estimate]:
    return {name: Estimate(attrgetter(name)(gripper), u) for name, u in gripper.uncertainties.items() if u > 0.0}


def _changed(gripper: Gripper, changes: Mapping[str, float]) -> Gripper:
    """Return a gripper with changed dimensions; refuse dimensions that no gripper can have."""
    for name, by in changes.items():
        value = attrgetter(name)(gripper) + by
        if not name.endswith(_ANY_SIGN) and value <= 0.0:
            raise ModelError(f"{name} must be positive, but would be {value:g}.")
        if name == "material.poisson_ratio" and value >= _MOST_POISSON:
            raise ModelError(f"{name} must be below 0.5, but would be {value:g}.")
    for name, by in changes.items():
        gripper = redrawn(gripper, name, by)
    return gripper
