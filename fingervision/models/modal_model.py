"""A driven elastic body reduced to its static shape and its natural modes: the basis of all dynamic responses.

The motion u(t) of the drive is prescribed. The body follows u by its static shape s; each mode r of the body with fixed
drive is excited by the inertia of the static shape (Craig and Bampton, 1968, AIAA Journal 6, 1313, with one interface
unknown):

    q_r'' + 2 zeta_r w_r q_r' + w_r^2 q_r = -L_r u''
    force at the drive = k u + m u'' + sum_r L_r q_r''

with L_r = phi_r' M s, k = s' K s and m = s' M s, where mode r has the coordinate q_r, the shape phi_r, the angular
frequency w_r and the damping ratio zeta_r, and the body has the mass matrix M and the stiffness matrix K. Damping acts
on the motion relative to the static shape. If the drive is free to move and pushed by a force f, the modes with free
drive vibrate instead; with d_r the motion of the drive in mode r:

    q_r'' + 2 zeta_r w_r q_r' + w_r^2 q_r = d_r f
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import FingervisionError
from fingervision.models.damping import Damping, ModalDamping

Array = NDArray[np.float64]

GAP = "gap_mm"


@dataclass(frozen=True, slots=True, eq=False)
class Observable:
    """An output of a mechanism: a gap, or a component of a probe's displacement.

    Parameters
    ----------
    rest_mm : float
        Value at zero input.
    per_input : float
        Change of the static value per 1 mm of input.
    by_mode : ndarray of float, shape (modes,)
        Change per unit of each mode's coordinate.
    """

    rest_mm: float
    per_input: float
    by_mode: Array


@dataclass(frozen=True, slots=True, eq=False)
class ModalModel:
    """A mechanism reduced to its static shape and its modes with the drive held.

    Parameters
    ----------
    stiffness_n_mm, mass_t : float
        Stiffness k and mass m of the static shape for 1 mm of input.
    rad_s, participation : ndarray of float, shape (modes,)
        Angular frequencies of the modes with the drive held, in rising order, and the participation factors L of the
        modes, normalised to unit modal mass.
    observed : mapping of str to Observable
        Computed outputs by the name of their column.
    face_per_input : float
        Static motion of the driven face per 1 mm of input: 1 for a stage, less for a soft actuator.
    force_share : float
        Share of the vibration's inertia that acts on the drive: 1 for a stage and for an actuator with a stiffness, 0
        for one that prescribes the force.
    rest_force_n : float
        Force at the drive at zero input: its preload.
    """

    stiffness_n_mm: float
    mass_t: float
    rad_s: Array
    participation: Array
    observed: Mapping[str, Observable]
    face_per_input: float = 1.0
    force_share: float = 1.0
    rest_force_n: float = 0.0

    @property
    def modes_hz(self) -> Array:
        """Natural frequencies with the drive held."""
        return self.rad_s / (2.0 * pi)

    def with_modes(self, count: int) -> "ModalModel":
        """Keep the first modes only; the contribution of the remaining modes then follows the drive without delay."""
        observed = {name: replace(seen, by_mode=seen.by_mode[:count]) for name, seen in self.observed.items()}
        return replace(self, rad_s=self.rad_s[:count], participation=self.participation[:count], observed=observed)

    def damped(self, damping: Damping) -> tuple["ModalModel", Array]:
        """Keep the modes for which a damping law is valid, with their damping ratios; see `described`."""
        ratios = described(damping, self.rad_s)
        return self.with_modes(ratios.size), ratios


@dataclass(frozen=True, slots=True, eq=False)
class FreeModes:
    """Vibration modes with the drive free to move along its direction.

    Parameters
    ----------
    rad_s, drive : ndarray of float, shape (modes,)
        Angular frequencies in rising order, and the drive's motion in each mode, normalised to unit modal mass.
    by_mode : mapping of str to ndarray of float, shape (modes,)
        Change of each observed length per unit of each mode's coordinate.
    """

    rad_s: Array
    drive: Array
    by_mode: Mapping[str, Array]


def described(damping: Damping, rad_s: Array) -> Array:
    """Damping ratios of the lowest modes, as far as a damping law is valid for them.

    A damping law may give ratios that are impossible for solids, as equation (4) of Hricko & Havlik (2015) does at a
    few times its reference frequency. A damping law is used only for the modes below the frequency at which its ratios
    become impossible.

    Raises
    ------
    FingervisionError
        If the law is not valid for the lowest mode.
    """
    for count in range(rad_s.size, 1, -1):
        try:
            return damping.ratios(rad_s[:count])
        except FingervisionError:
            continue
    return damping.ratios(rad_s[:1])


# Motion of a driven mechanism in time, for small displacements: modes superposed on the static response.

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
    damping : ModalDamping, RayleighDamping or PaperDamping
        Damping law; None is a modal damping ratio of 0.025.
    """
    model, ratios = model.damped(damping or ModalDamping())
    inputs = drive.input_mm
    coordinate, acceleration = np.zeros((2, inputs.size, ratios.size))
    for rows in run_rows(drive):
        coordinate[rows], acceleration[rows] = _run(model, ratios, drive.time_s[rows], inputs[rows])
    static = {name: seen.rest_mm + seen.per_input * inputs for name, seen in model.observed.items()}
    observed = {name: static[name] + coordinate @ seen.by_mode for name, seen in model.observed.items()}
    inertia = model.force_share * (acceleration @ model.participation)
    force = model.rest_force_n + model.stiffness_n_mm * inputs + inertia
    return Motion(drive, observed, static, force, inertia, ratios, model.modes_hz)


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


# Response of a mechanism to a vibrating drive: amplitude and phase over frequency, for small displacements.

ComplexArray = NDArray[np.complex128]

_ACROSS_A_PEAK = 12
"""Frequencies within the half-power width of every resonance: the height of the peak is then resolved within 0.4 %."""
_WIDTHS = 6.0
_LEAST_ROWS = 400


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyResponse:
    """Steady-state responses to a sinusoidal drive.

    Parameters
    ----------
    frequency_hz : ndarray of float, shape (n,)
        Frequency of the drive.
    per_input : mapping of str to ndarray of complex, shape (n,)
        Complex amplitude of each probed length per 1 mm of drive amplitude (the stage follows exactly): peaks at the
        modes with the drive held.
    per_force_mm_n : mapping of str to ndarray of complex, shape (n,)
        Complex amplitude of each probed length per 1 N at a drive that is free to move: peaks at the modes with the
        drive free.
    drive_per_force_mm_n : ndarray of complex, shape (n,)
        Complex amplitude of the drive per 1 N.
    modes_hz, free_modes_hz, damping_ratios : ndarray of float
        Natural frequencies of the modes kept, with the drive held and free, and the damping ratios of the former.
    """

    frequency_hz: Array
    per_input: Mapping[str, ComplexArray]
    per_force_mm_n: Mapping[str, ComplexArray]
    drive_per_force_mm_n: ComplexArray
    modes_hz: Array
    free_modes_hz: Array
    damping_ratios: Array


def frequency_response(
    model: ModalModel, free: FreeModes, frequency_hz: Array, damping: Damping | None = None
) -> FrequencyResponse:
    """Compute the response to a sinusoidal drive at some frequencies.

    Modes beyond those given contribute their static response, so that the responses per input and per force are exact
    at 0 Hz.

    Parameters
    ----------
    model : ModalModel
        The mechanism with its drive held; its modes should reach to twice the highest frequency.
    free : FreeModes
        The mechanism with its drive free.
    frequency_hz : ndarray of float, shape (n,)
        Frequencies of the drive.
    damping : ModalDamping, RayleighDamping or PaperDamping
        Damping law; None is a modal damping ratio of 0.025.
    """
    law = damping or ModalDamping()
    model, ratios = model.damped(law)
    free_ratios = described(law, free.rad_s)
    kept = slice(0, free_ratios.size)
    w = 2.0 * pi * np.asarray(frequency_hz, dtype=np.float64)[:, None]
    shaken = _complex(w**2 * _pliance(w, model.rad_s, ratios) * model.participation)
    per_input = {name: _complex(seen.per_input + shaken @ seen.by_mode) for name, seen in model.observed.items()}
    rad_s, drive = free.rad_s[kept], free.drive[kept]
    pushed = _pliance(w, rad_s, free_ratios) * drive
    at_rest = drive / rad_s**2

    def receptance(static: float, by_mode: Array) -> ComplexArray:
        return _complex(static + pushed @ by_mode - at_rest @ by_mode)

    k = model.stiffness_n_mm
    return FrequencyResponse(
        frequency_hz=w[:, 0] / (2.0 * pi),
        per_input=per_input,
        per_force_mm_n={n: receptance(s.per_input / k, free.by_mode[n][kept]) for n, s in model.observed.items()},
        drive_per_force_mm_n=receptance(model.face_per_input / k, drive),
        modes_hz=model.modes_hz,
        free_modes_hz=rad_s / (2.0 * pi),
        damping_ratios=ratios,
    )


def _pliance(w: Array, rad_s: Array, ratios: Array) -> ComplexArray:
    return _complex(1.0 / (rad_s**2 - w**2 + 2j * ratios * rad_s * w))


def _complex(values: Any) -> ComplexArray:
    return np.asarray(values, dtype=np.complex128)


def resolved_frequencies_hz(
    model: ModalModel, free: FreeModes, damping: Damping, first_hz: float, last_hz: float
) -> Array:
    """Frequencies spaced so closely that every resonance, with the drive fixed or free, is resolved."""
    kept, ratios = model.damped(damping)
    free_ratios = described(damping, free.rad_s)
    places = [np.linspace(first_hz, last_hz, _LEAST_ROWS)]
    free_hz = free.rad_s[: free_ratios.size] / (2.0 * pi)
    for centre, ratio in [*zip(kept.modes_hz, ratios, strict=True), *zip(free_hz, free_ratios, strict=True)]:
        half = ratio * centre
        around = np.linspace(-_WIDTHS * half, _WIDTHS * half, int(_WIDTHS * _ACROSS_A_PEAK) + 1)
        places.append(centre + around)
    found = np.unique(np.concatenate(places))
    return np.asarray(found[(found >= first_hz) & (found <= last_hz)])
