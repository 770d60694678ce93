"""The gripper's motion in time to a drive history, small displacements: modes on top of the static answer."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from fingervision.domain.drive import DriveHistory
from fingervision.models.damping import Damping, ModalDamping
from fingervision.models.driven_body import DrivenBody

Array = NDArray[np.float64]

_MODES = 3
_ALIKE_S = 1e-9


def modal_gap_mm(body: DrivenBody, drive: DriveHistory, damping: Damping | None = None, modes: int = _MODES) -> Array:
    """Gap over time, the drive's motion prescribed and straight between its samples.

    The drive moves the body by its static shape; each mode of the held body is shaken by that shape's inertia. Every
    step is the exact solution of the mode's equation, so that sparse samples lose nothing; the first sample is at rest.

    Parameters
    ----------
    body : DrivenBody
        The right half.
    drive : DriveHistory
        Inputs over time.
    damping : Damping or None
        Modal damping of 0.025 where None.
    modes : int
        How many modes of the held body.

    Returns
    -------
    ndarray of float, shape (n,)
        Gap in mm.
    """
    rad_s, shapes = body.modes(drive_held=True, count=modes)
    ratios = (damping or ModalDamping()).ratios(rad_s)
    static = body.unit_displacement_mm
    shaken = shapes.T @ (body.mass_t @ static)
    seen = body.weights @ shapes[body.measured]
    inputs, steps_s = drive.input_mm, np.diff(drive.time_s)
    speed = np.diff(inputs) / steps_s
    # A mode's coordinate obeys q'' + 2 zeta w q' + w^2 q = -shaken * input''; where the speed jumps, q' jumps with it.
    state = np.zeros((2, modes))
    coordinate = np.zeros((inputs.size, modes))
    before = 0.0
    powers: dict[int, Array] = {}
    for place, step_s in enumerate(steps_s.tolist()):
        key = round(step_s / _ALIKE_S)
        if key not in powers:
            powers[key] = _decay(rad_s, ratios, step_s)
        state[1] -= shaken * (speed[place] - before)
        before = speed[place]
        state = np.einsum("ijm,jm->im", powers[key], state)
        coordinate[place + 1] = state[0]
    slope = body.measured_mm(static) - body.measured_rest_mm
    return np.asarray(2.0 * (body.measured_rest_mm + slope * inputs + coordinate @ seen))


def _decay(rad_s: Array, ratios: Array, step_s: float) -> Array:
    """Transition matrices of free damped vibration, shape (2, 2, modes)."""
    return np.stack(
        [expm(step_s * np.array([[0.0, 1.0], [-(w**2), -2.0 * z * w]])) for w, z in zip(rad_s, ratios, strict=True)],
        axis=-1,
    )
