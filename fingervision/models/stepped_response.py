"""The gripper's motion in time with large rotation or contact switched on: step by step."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags

from fingervision.domain.drive import DriveHistory
from fingervision.models.damping import RayleighDamping
from fingervision.models.driven_body import DrivenBody
from fingervision.models.generalized_alpha import integrate
from fingervision.models.physics import Physics

Array = NDArray[np.float64]

_CONTACT_N_MM = 50.0
"""Penalty stiffness of each face point: 20 times the finger's own, so that 1 N of grip sinks 0.02 mm in."""


def stepped_gap_mm(
    body: DrivenBody, drive: DriveHistory, physics: Physics, damping: RayleighDamping, step_s: float
) -> tuple[Array, Array]:
    """Gap over time, the drive's motion prescribed.

    Parameters
    ----------
    body : DrivenBody
        The right half.
    drive : DriveHistory
        Inputs over time; straight between samples.
    physics : Physics
        Large rotation, contact (by a penalty), both or neither.
    damping : RayleighDamping
        Proportional to mass and stiffness at rest.
    step_s : float
        Time step; a twentieth of the shortest period of interest.

    Returns
    -------
    time_s, gap_mm : ndarray of float, shape (m,)
        At equal steps from the first sample.
    """
    steps = max(1, int(np.ceil((drive.time_s[-1] - drive.time_s[0]) / step_s)))
    time_s = drive.time_s[0] + np.arange(steps + 1) * step_s
    history = np.interp(time_s, drive.time_s, drive.input_mm)
    linear = body.stiffness_n_mm

    def internal(moved: Array) -> tuple[csr_matrix, Array]:
        tangent, force = body.tangent(moved) if physics.large_rotation else (linear, linear @ moved)
        if physics.contact:
            pressed = np.zeros(body.unknowns)
            pressed[body.face] = np.minimum(body.face_gap_mm(moved), 0.0)
            tangent = csr_matrix(tangent + diags(_CONTACT_N_MM * (pressed < 0.0)))
            force = force + _CONTACT_N_MM * pressed
        return tangent, force

    start = history[0] * body.unit_displacement_mm
    drag = csr_matrix(damping.mass_factor_per_s * body.mass_t + damping.stiffness_factor_s * linear)
    motion = integrate(
        body.mass_t, drag, internal, (start, np.zeros_like(start)), (body.driven, history), body.free, step_s
    )
    return time_s, np.array([2.0 * body.measured_mm(row) for row in motion.displacement])
