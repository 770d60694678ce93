"""Small displacements of an elastic body under its own weight, and under a uniform change of temperature."""

import numpy as np
from numpy.typing import NDArray

from fingervision.models.driven_body import DrivenBody, factorised

Array = NDArray[np.float64]

STANDARD_GRAVITY_MM_S2 = 9806.65


def weight_displacement_mm(body: DrivenBody, direction: tuple[float, float], *, swaying: bool = False) -> Array:
    """Displacements under one standard gravity acting in the plane, with the drive fixed.

    Parameters
    ----------
    body : DrivenBody
        The right half.
    direction : (float, float)
        Unit vector of the direction in which gravity acts.
    swaying : bool
        Whether both halves and the drive move sideways in the same direction; if False, the halves move as mirror
        images.
    """
    pulled = np.zeros(body.unknowns)
    pulled[body.nodes[:, 0]], pulled[body.nodes[:, 1]] = direction
    moved = np.zeros_like(pulled)
    load_n = STANDARD_GRAVITY_MM_S2 * (body.mass_t @ pulled)
    if swaying:
        inside = body.swaying
        moved[inside] = factorised(body.stiffness_n_mm[inside][:, inside]).solve(load_n[inside])
    else:
        moved[body.free] = body.solve_free(load_n[body.free])
    return moved


def thermal_displacement_mm(body: DrivenBody, strain: float, held_mm: Array) -> tuple[Array, Array]:
    """Displacements and nodal forces under a uniform thermal strain.

    A free body expands without stress, each node by `strain` times its position x. The displacements u therefore
    satisfy K (u - strain x) = 0 at every unknown that is not fixed, with K the stiffness matrix.

    Parameters
    ----------
    body : DrivenBody
        The right half.
    strain : float
        Thermal expansion coefficient times change of temperature.
    held_mm : ndarray of float, shape (unknowns,)
        Displacements of the unknowns that are not free; zero for supports that do not expand.

    Returns
    -------
    displacement_mm, force_n : ndarray of float, shape (unknowns,)
        Displacements, and forces of the supports on the body.
    """
    grown = np.zeros(body.unknowns)
    grown[body.nodes[:, 0]], grown[body.nodes[:, 1]] = strain * body.nodes_mm.T
    moved = np.array(held_mm, dtype=np.float64)
    moved[body.free] = 0.0
    load_n = body.stiffness_n_mm @ (grown - moved)
    moved[body.free] = body.solve_free(load_n[body.free])
    return moved, np.asarray(body.stiffness_n_mm @ (moved - grown))


def gap_by_weight_mm(body: DrivenBody) -> float:
    """Change of the gap by gravity when the plate stands upright with the fingers up, with the drive fixed (mm)."""
    return 2.0 * (body.measured_mm(weight_displacement_mm(body, (0.0, -1.0))) - body.measured_rest_mm)


def midline_by_weight_mm(body: DrivenBody) -> float:
    """Shift of the midline when the plate stands on its side (mm): both halves sway in the same direction.

    The drive is fixed along its axis and free across it, because the actuator does not guide it sideways.
    """
    return body.measured_mm(weight_displacement_mm(body, (1.0, 0.0), swaying=True)) - body.measured_rest_mm


def gap_and_force_by_strain(body: DrivenBody, drive_face_y_mm: float) -> tuple[float, float]:
    """Change of the gap (mm), and of the force at the fixed drive (N), for a thermal strain of one.

    Clamp and actuator stay in place, and the gripper expands between them. The actuator holds the drive's face; in a
    model that is driven at a point above the face, this point moves by the thermal expansion of the block in between.
    In a frame of bars, the bars end where their axes meet, which causes an error of a few millimetres times the strain:
    use finite elements for this result.
    """
    held = np.zeros(body.unknowns)
    height = np.zeros(body.unknowns)
    height[body.nodes[:, 1]] = body.nodes_mm[:, 1]
    held[body.driven] = height[body.driven] - drive_face_y_mm
    moved, force = thermal_displacement_mm(body, 1.0, held)
    return 2.0 * (body.measured_mm(moved) - body.measured_rest_mm), 2.0 * float(force[body.driven].sum())
