"""Effects of the mechanism, integrated in time with formulas that differ from the catalogue's."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
CREEP_TIMES_S = np.array([1.5, 3.0, 7.0, 20.0, 45.0])


def arc(opening_mm: Array, reach_mm: float, cross: float) -> Array:
    """Large rotation by a series to fifth order, with the cross term of a circular arc to fourth order."""
    x = opening_mm / reach_mm
    return opening_mm * (1 - x**2 / 6 + x**4 / 130) + cross * reach_mm * (x**2 / 2 - x**4 / 26)


@njit(cache=True)
def _creep(o: Array, dt: float, tau: Array, share: Array) -> Array:
    slow = np.full(tau.size, o[0])
    out = np.empty_like(o)
    for i in range(o.size):
        missing = 0.0
        for k in range(tau.size):
            slow[k] += (o[i] - slow[k]) * (1.0 - np.exp(-dt / tau[k]))
            missing += share[k] * (o[i] - slow[k])
        out[i] = o[i] - missing
    return out


def creep(opening_mm: Array, dt_s: float, shares: Array) -> Array:
    """A linear viscoelastic solid with five relaxation times (1.5 to 45 s) that differ from the catalogue's."""
    return np.asarray(_creep(opening_mm, dt_s, CREEP_TIMES_S, shares))


@njit(cache=True)
def _swing(o: Array, dt: float, omega: float, zeta: float, hardening: float) -> Array:
    x, v = o[0], 0.0
    out = np.empty_like(o)
    out[0] = x
    parts = max(1, int(np.ceil(omega * dt / 0.15)))
    h = dt / parts
    for i in range(1, o.size):
        for p in range(parts):
            drive = o[i - 1] + (o[i] - o[i - 1]) * (p + 0.5) / parts
            # Leapfrog integration, with implicit damping in the second half step of the velocity.
            d = x - drive
            v += 0.5 * h * (-(omega**2) * d * (1 + hardening * d * d) - 2 * zeta * omega * v)
            x += h * v
            d = x - drive
            v = (v - 0.5 * h * omega**2 * d * (1 + hardening * d * d)) / (1 + h * zeta * omega)
        out[i] = x
    return out


def resonance(opening_mm: Array, dt_s: float, frequency_hz: float, damping_ratio: float) -> Array:
    """A mass on a slightly hardening spring with damping, integrated by the leapfrog method on the fine grid."""
    return np.asarray(_swing(opening_mm, dt_s, 2 * np.pi * frequency_hz, damping_ratio, 0.02))


def soft_contact(gap_mm: Array, floor_mm: float, remaining_slope: float, softness_mm: float) -> Array:
    """Contact of fingers with rough surfaces: the slope changes smoothly within `softness_mm`."""
    above = softness_mm * np.logaddexp(0.0, (gap_mm - floor_mm) / softness_mm)
    return floor_mm + above + remaining_slope * (gap_mm - floor_mm - above)


def warming(time_s: Array, amplitude_mm: float, tau_s: float) -> Array:
    """Warming of two bodies in series: a fast skin with 8 % of the effect, and the bulk."""
    return amplitude_mm * (1 - 0.92 * np.exp(-time_s / (1.05 * tau_s)) - 0.08 * np.exp(-time_s / (0.5 * tau_s)))
