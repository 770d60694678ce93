"""Characteristic numbers of a gripper in operation: leverage, parasitic motion, effects of weight and temperature."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.gripper import Gripper
from fingervision.models.driven_body import DrivenBody
from fingervision.models.grip import mechanical_advantage
from fingervision.models.steady_loads import gap_and_force_by_strain, gap_by_weight_mm, midline_by_weight_mm

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class OperatingFigures:
    """Characteristic numbers of one gripper in operation, for small displacements.

    Parameters
    ----------
    mechanical_advantage : float or None
        Increase of each finger's gripping force per drive force, N/N, once the fingers touch.
    tip_along_per_input : float
        Parasitic motion of the measuring point along the fingers per 1 mm of input, mm/mm.
    tip_turn_deg_per_mm : float
        Parasitic rotation of the tip's inner face per 1 mm of input; a positive value rotates the right finger's tip
        outwards, so that the gap opens more at the top.
    gap_by_weight_mm, midline_by_weight_mm : float
        Change under one standard gravity of the gap (plate upright) and of the midline (plate on its side).
    gap_per_kelvin_mm, force_per_kelvin_n : float or None
        Change of the gap and of the force at the held drive per kelvin; None if the material states no thermal
        expansion.
    """

    mechanical_advantage: float | None
    tip_along_per_input: float
    tip_turn_deg_per_mm: float
    gap_by_weight_mm: float
    midline_by_weight_mm: float
    gap_per_kelvin_mm: float | None
    force_per_kelvin_n: float | None


def operating_figures(gripper: Gripper, body: DrivenBody) -> OperatingFigures:
    """Compute the characteristic numbers of a gripper in operation.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    body : DrivenBody
        Right half of the gripper from any kind of model, such as `LumpedGripper(gripper).half`.
    """
    moved = body.unit_displacement_mm
    along = np.zeros(body.unknowns, dtype=np.int64)
    along[body.nodes[:, 0]] = body.nodes[:, 1]
    height = np.zeros(body.unknowns)
    height[body.nodes[:, 0]] = body.nodes_mm[:, 1]
    y_mm, across = height[body.face], moved[body.face]
    lean = float(np.polyfit(y_mm - y_mm.mean(), across, 1)[0])
    expansion = gripper.material.thermal_expansion_per_k
    gap, force = (
        (None, None)
        if expansion is None
        else (expansion * x for x in gap_and_force_by_strain(body, gripper.lever.drive_face_y_mm))
    )
    return OperatingFigures(
        mechanical_advantage=mechanical_advantage(body),
        tip_along_per_input=float(body.weights @ moved[along[body.measured]]),
        tip_turn_deg_per_mm=float(np.degrees(lean)),
        gap_by_weight_mm=gap_by_weight_mm(body),
        midline_by_weight_mm=midline_by_weight_mm(body),
        gap_per_kelvin_mm=gap,
        force_per_kelvin_n=force,
    )
