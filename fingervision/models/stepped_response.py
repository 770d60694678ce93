"""Motion of the gripper in time, in the deformed shape or with contact, integrated step by step."""

from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags

from fingervision.domain.drive import DriveHistory
from fingervision.models.damping import Damping
from fingervision.models.driven_body import DrivenBody
from fingervision.models.generalized_alpha import integrate
from fingervision.models.modal_model import gripper_modes
from fingervision.models.physics import Physics

Array = NDArray[np.float64]

_PENALTY = 20.0
"""Ratio of each face point's contact stiffness to the finger's own stiffness: under a grip of 1 N the face penetrates
by a twentieth of the finger's own deflection (0.02 mm for the published sample)."""
_A_PERIOD = 60
"""Time steps per period of the lowest mode: the difference of the gap from the exact modal solution is then below 0.1 %
of the gap's travel."""
_RESOLVED_MODES = 3
"""Number of modes that the time step resolves. The third mode of the published sample has six times the frequency of
the first: ten steps per period."""
_OVERDAMPED = 1.0
"""Damping ratio of the first mode that the time step does not resolve; it is larger for higher modes."""
_RADIUS = 0.5
"""Spectral radius at infinite frequency: vibrations too fast for the step decay within a few steps; they are excited by
kinks of the drive history, not by the mechanism."""


def step_for(body: DrivenBody) -> float:
    """Time step (s): a sixtieth of the period of the lowest mode with fixed drive."""
    rad_s, _ = body.modes(drive_held=True, count=1)
    return float(2.0 * pi / rad_s[0] / _A_PERIOD)


def stepped_motion(
    body: DrivenBody, drive: DriveHistory, physics: Physics, damping: Damping, step_s: float
) -> tuple[Array, Array]:
    """Gap and force over one run, with the drive's motion prescribed.

    Parameters
    ----------
    body : DrivenBody
        The right half.
    drive : DriveHistory
        Inputs over time, linear between samples.
    physics : Physics
        Large rotation, contact (by a penalty), both or neither.
    damping : Damping
        Damping of the modes at rest; it acts on the motion relative to the static shape, as in `modal_response`.
    step_s : float
        Time step, as from `step_for`.

    Returns
    -------
    gap_mm, force_n : ndarray of float, shape (n,)
        Gap and force at the drive's samples. The drive's own inertia is not in the force, because the speed of the
        drive jumps between straight pieces of its history.
    """
    usual_s = float(np.median(np.diff(drive.time_s))) if drive.time_s.size > 1 else step_s
    # The steps divide the spacing of the samples, so that kinks of the drive history lie at the ends of steps.
    step_s = usual_s / np.ceil(usual_s / step_s)
    steps = max(1, int(np.ceil((drive.time_s[-1] - drive.time_s[0]) / step_s - 1e-9)))
    time_s = drive.time_s[0] + np.arange(steps + 1) * step_s
    history = np.interp(time_s, drive.time_s, drive.input_mm)
    linear = body.stiffness_n_mm
    penalty_n_mm = _PENALTY / body.face_displacement_mm[body.face].diagonal()

    def internal(moved: Array) -> tuple[csr_matrix, Array]:
        tangent, force = body.tangent(moved) if physics.large_rotation else (linear, linear @ moved)
        if physics.contact:
            pressed = np.zeros(body.unknowns)
            pressed[body.face] = penalty_n_mm * np.minimum(body.face_gap_mm(moved), 0.0)
            active = np.zeros(body.unknowns)
            active[body.face] = penalty_n_mm * (pressed[body.face] < 0.0)
            tangent = csr_matrix(tangent + diags(active))
            force = force + pressed
        return tangent, force

    start = history[0] * body.unit_displacement_mm
    drag = _drag(body, damping)
    motion = integrate(
        body.mass_t,
        drag,
        internal,
        (start, np.zeros_like(start)),
        (body.driven, history),
        body.free,
        step_s,
        high_frequency_radius=_RADIUS,
    )
    gap = np.array([2.0 * body.measured_mm(row) for row in motion.displacement])
    moving = np.zeros(body.unknowns, dtype=bool)
    moving[body.free] = True
    force = np.array([
        2.0 * float((internal(u)[1] + body.mass_t @ np.where(moving, a, 0.0))[body.driven].sum())
        for u, a in zip(motion.displacement, motion.acceleration, strict=True)
    ])  # fmt: skip
    return np.interp(drive.time_s, time_s, gap), np.interp(drive.time_s, time_s, force)


def _drag(body: DrivenBody, damping: Damping) -> csr_matrix:
    """Damping matrix for motion relative to the static shape.

    For the modes that the damping law describes and the time step resolves, the damping matrix is M Phi diag(2 zeta w)
    Phi' M, with the mass matrix M, the mode shapes Phi, the damping ratios zeta and the angular frequencies w. Modes
    that the damping law does not describe, or the time step does not resolve, have a damping proportional to their
    stiffness, so strong that these modes follow the drive without delay, as in `modal_model`.
    """
    model, ratios = gripper_modes(body, _RESOLVED_MODES).damped(damping)
    rad_s, shapes = body.modes(drive_held=True, count=_RESOLVED_MODES + 1)
    pushed = body.mass_t @ shapes[:, : model.rad_s.size]
    matrix = (pushed * (2.0 * ratios * model.rad_s)) @ pushed.T
    rest = body.stiffness_n_mm.toarray() - (pushed * model.rad_s**2) @ pushed.T
    matrix += 2.0 * _OVERDAMPED / rad_s[model.rad_s.size] * rest
    follows = matrix @ body.unit_displacement_mm
    matrix[:, body.driven] -= follows[:, None] / body.driven.size
    return csr_matrix(matrix)
