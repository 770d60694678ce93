"""Response of a mechanism to a vibrating drive: amplitude and phase over frequency, for small displacements."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.models.damping import Damping, ModalDamping
from fingervision.models.modal_model import FreeModes, ModalModel, described

Array = NDArray[np.float64]
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
    modes_hz, free_modes_hz, damping_ratios, free_damping_ratios : ndarray of float
        Natural frequencies of the modes kept, with the drive held and free, and the damping ratios of these modes.
    """

    frequency_hz: Array
    per_input: Mapping[str, ComplexArray]
    per_force_mm_n: Mapping[str, ComplexArray]
    drive_per_force_mm_n: ComplexArray
    modes_hz: Array
    free_modes_hz: Array
    damping_ratios: Array
    free_damping_ratios: Array


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
    damping : ModalDamping, LossFactor, RayleighDamping or PaperDamping
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
        drive_per_force_mm_n=receptance(1.0 / k, drive),
        modes_hz=model.modes_hz,
        free_modes_hz=rad_s / (2.0 * pi),
        damping_ratios=ratios,
        free_damping_ratios=free_ratios,
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
