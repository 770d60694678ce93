"""Motion of a driven mechanism in time, for small displacements: modes superposed on the static response."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from fingervision.domain.drive import DriveHistory
from fingervision.models.damping import Damping, ModalDamping
from fingervision.models.modal_model import ModalModel

Array = NDArray[np.float64]

_ALIKE_S = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Motion of a mechanism over a drive history.

    Parameters
    ----------
    drive : DriveHistory
        The drive history.
    observed_mm : mapping of str to ndarray of float, shape (n,)
        Each observed length over time.
    static_mm : mapping of str to ndarray of float, shape (n,)
        Static value of each observed length at each input.
    force_n : ndarray of float, shape (n,)
        Force at the drive, at each sample the mean of the values in the two straight pieces of the history that meet
        there. The mass that is in no mode adds an impulse where the drive's speed jumps between pieces; this impulse
        belongs to no sample and is left out.
    inertia_n : ndarray of float, shape (n,)
        Contribution of the vibration to the force.
    damping_ratios : ndarray of float, shape (modes,)
        Damping ratios of the modes kept.
    modes_hz : ndarray of float, shape (modes,)
        Natural frequencies of the modes kept.
    """

    drive: DriveHistory
    observed_mm: Mapping[str, Array]
    static_mm: Mapping[str, Array]
    force_n: Array
    inertia_n: Array
    damping_ratios: Array
    modes_hz: Array

    def vibration_mm(self, name: str) -> float:
        """Largest difference of an observed length from its static value (mm)."""
        return float(np.abs(self.observed_mm[name] - self.static_mm[name]).max(initial=0.0))


def modal_motion(model: ModalModel, drive: DriveHistory, damping: Damping | None = None) -> Motion:
    """Compute the motion over a drive history that is linear between samples; runs start at rest, at their first input.

    For every time step the modes' equations are solved exactly, so that the result does not depend on the spacing of
    samples.

    Parameters
    ----------
    model : ModalModel
        The reduced mechanism.
    drive : DriveHistory
        Inputs over time.
    damping : ModalDamping, LossFactor, RayleighDamping or PaperDamping
        Damping law; None is a modal damping ratio of 0.025.
    """
    model, ratios = model.damped(damping or ModalDamping())
    inputs = drive.input_mm
    coordinate, acceleration = np.zeros((2, inputs.size, ratios.size))
    for rows in run_rows(drive):
        coordinate[rows], acceleration[rows] = _run(model, ratios, drive.time_s[rows], inputs[rows])
    static = {name: seen.rest_mm + seen.per_input * inputs for name, seen in model.observed.items()}
    observed = {name: static[name] + coordinate @ seen.by_mode for name, seen in model.observed.items()}
    inertia = acceleration @ model.participation
    return Motion(drive, observed, static, model.stiffness_n_mm * inputs + inertia, inertia, ratios, model.modes_hz)


def run_rows(drive: DriveHistory) -> list[slice]:
    """Row numbers of each run, in order; a single slice if the drive history is not divided into runs."""
    if drive.run is None:
        return [slice(0, drive.time_s.size)]
    names = np.array(drive.run)
    starts = [0, *(np.flatnonzero(names[1:] != names[:-1]) + 1).tolist(), names.size]
    return [slice(a, b) for a, b in pairwise(starts)]


def _run(model: ModalModel, ratios: Array, time_s: Array, inputs: Array) -> tuple[Array, Array]:
    """Modal coordinates and accelerations, shape (n, modes)."""
    rad_s, participation = model.rad_s, model.participation
    steps_s = np.diff(time_s)
    jumps = np.diff(np.diff(inputs) / steps_s, prepend=0.0)
    # Between the samples the modes vibrate freely; where the drive's speed jumps, the speeds of the modes jump too.
    state = np.zeros((2, rad_s.size))
    states = np.zeros((inputs.size, 2, rad_s.size))
    powers: dict[int, Array] = {}
    for place, step_s in enumerate(steps_s.tolist()):
        key = round(step_s / _ALIKE_S)
        if key not in powers:
            powers[key] = _decay(rad_s, ratios, step_s)
        state[1] -= participation * jumps[place]
        state = np.einsum("ijm,jm->im", powers[key], state)
        states[place + 1] = state
    after = np.append(jumps, 0.0)[: inputs.size]
    coordinate, speed = states[:, 0], states[:, 1] - 0.5 * np.outer(after, participation)
    return coordinate, -2.0 * ratios * rad_s * speed - rad_s**2 * coordinate


def _decay(rad_s: Array, ratios: Array, step_s: float) -> Array:
    """Transition matrices of free damped vibration, shape (2, 2, modes)."""
    return np.stack(
        [expm(step_s * np.array([[0.0, 1.0], [-(w**2), -2.0 * z * w]])) for w, z in zip(rad_s, ratios, strict=True)],
        axis=-1,
    )
