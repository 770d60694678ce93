"""Definitions of effects with memory, computed sample by sample; `starts` contains each run's first sample, and n."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@njit(cache=True)
def limited(u: Array, t: Array, starts: NDArray[np.int64], speed: float) -> Array:
    """Output that follows the input at no more than a given speed."""
    out = np.empty_like(u)
    for r in range(starts.size - 1):
        place = u[starts[r]]
        out[starts[r]] = place
        for i in range(starts[r] + 1, starts[r + 1]):
            way = speed * (t[i] - t[i - 1])
            place = min(max(u[i], place - way), place + way)
            out[i] = place
    return out


@njit(cache=True)
def play(u: Array, starts: NDArray[np.int64], full_width: float, begin: Array) -> Array:
    """Play operator; at each run's start, the output is `begin` half widths from the input."""
    out = np.empty_like(u)
    half = 0.5 * full_width
    for r in range(starts.size - 1):
        place = u[starts[r]] + begin[r] * half
        for i in range(starts[r], starts[r + 1]):
            place = min(max(place, u[i] - half), u[i] + half)
            out[i] = place
    return out


@njit(cache=True)
def jump(u: Array, starts: NDArray[np.int64], size: float) -> Array:
    """Output that stays constant until the input is more than `size` away, then follows at once."""
    out = np.empty_like(u)
    for r in range(starts.size - 1):
        place = u[starts[r]]
        for i in range(starts[r], starts[r + 1]):
            if abs(u[i] - place) > size:
                place = u[i]
            out[i] = place
    return out


@njit(cache=True)
def sliders(u: Array, starts: NDArray[np.int64], fraction: float, reach: float, begin: Array) -> Array:
    """Eight elastic sliders with reaches k / 8 of `reach`; at each run's start, the extension of each is -`begin` times
    its reach.

    The sign is that of the play: -1 is the state after upward motion.
    """
    out = np.empty_like(u)
    e = np.zeros(8)
    for r in range(starts.size - 1):
        for k in range(8):
            e[k] = -begin[r] * reach * (k + 1) / 8
        for i in range(starts[r], starts[r + 1]):
            mean = 0.0
            for k in range(8):
                if i > starts[r]:
                    limit = reach * (k + 1) / 8
                    e[k] = min(max(e[k] + u[i] - u[i - 1], -limit), limit)
                mean += e[k] / 8
            out[i] = u[i] - fraction * mean
    return out


@njit(cache=True)
def low_pass(o: Array, t: Array, starts: NDArray[np.int64], tau: float, begin: Array, stepped: bool = False) -> Array:
    """First-order low-pass filter, exact for an input that is linear between samples, or steps right after each.

    At each run's start, the filter is relaxed if `begin` is 0, and at the smallest or largest value if `begin` is -1 or
    1.
    """
    out = np.empty_like(o)
    least, largest = np.min(o), np.max(o)
    for r in range(starts.size - 1):
        first = o[starts[r]]
        room = largest - first if begin[r] > 0 else first - least
        out[starts[r]] = first + begin[r] * room
        for i in range(starts[r] + 1, starts[r + 1]):
            dt = t[i] - t[i - 1]
            fade = np.exp(-dt / tau)
            slope = 0.0 if stepped or dt == 0.0 else (o[i] - o[i - 1]) / dt
            before = o[i] if stepped else o[i - 1]
            out[i] = before + slope * dt - slope * tau + (out[i - 1] - before + slope * tau) * fade
    return out


@njit(cache=True)
def oscillator(o: Array, t: Array, starts: NDArray[np.int64], frequency_hz: float, zeta: float) -> Array:
    """Damped second-order system with unit gain, from rest; exact for an input that is linear between samples."""
    out = np.empty_like(o)
    omega = 2 * np.pi * frequency_hz
    zeta = min(zeta, 0.999999)
    damped = omega * np.sqrt(1 - zeta * zeta)
    for r in range(starts.size - 1):
        x, v = o[starts[r]], 0.0
        out[starts[r]] = x
        for i in range(starts[r] + 1, starts[r + 1]):
            dt = t[i] - t[i - 1]
            if dt <= 0.0:
                out[i] = x
                continue
            slope = (o[i] - o[i - 1]) / dt
            # The particular solution for a ramp o is o - 2 zeta slope / omega.
            lag = 2 * zeta * slope / omega
            a = x - (o[i - 1] - lag)
            b = (v - slope + zeta * omega * a) / damped
            fade, c, s = np.exp(-zeta * omega * dt), np.cos(damped * dt), np.sin(damped * dt)
            free = fade * (a * c + b * s)
            v = fade * ((b * damped - zeta * omega * a) * c - (a * damped + zeta * omega * b) * s) + slope
            x = free + o[i] - lag
            out[i] = x
    return out
