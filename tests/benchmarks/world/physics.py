"""Physics of the simulated set-ups, computed point by point along the path."""

import numpy as np

from tests.benchmarks.world.rig import Array


def play(u_mm: Array, width_mm: float, start: float) -> Array:
    """Play of width `width_mm`; the start state is -1 if engaged by upward motion, 1 if engaged by downward motion."""
    half = 0.5 * width_mm
    place = u_mm[0] + start * half
    out = []
    for u in u_mm.tolist():
        if u - place > half:
            place = u - half
        elif place - u > half:
            place = u + half
        out.append(place)
    return np.array(out)


def friction_loop(u_mm: Array, fraction: float, reach_mm: float, start: float) -> Array:
    """Eight elastic sliders in parallel, each of which slips at its own extension."""
    limits = reach_mm * np.arange(1, 9) / 8
    strain = start * limits
    out = [u_mm[0] - fraction * strain.mean()]
    for step, u in zip(np.diff(u_mm), u_mm[1:], strict=True):
        strain = np.clip(strain + step, -limits, limits)
        out.append(u - fraction * strain.mean())
    return np.array(out)


def late(time_s: Array, u_mm: Array, delay_s: float) -> Array:
    """Delay a signal by a dead time."""
    return np.interp(time_s - delay_s, time_s, u_mm)


def at_limited_speed(time_s: Array, u_mm: Array, speed_mm_s: float) -> Array:
    """Output that follows the input at no more than a given speed."""
    place = float(u_mm[0])
    out = [place]
    for dt, u in zip(np.diff(time_s).tolist(), u_mm[1:].tolist(), strict=True):
        way = speed_mm_s * dt
        place = min(max(u, place - way), place + way)
        out.append(place)
    return np.array(out)


def maxwell(time_s: Array, opening_mm: Array, shares: Array, taus_s: Array) -> Array:
    """Response of a generalised Maxwell solid to an input that is linear between points; relaxed at the first point."""
    slow = np.full(taus_s.size, opening_mm[0])
    out = [opening_mm[0]]
    for i in range(1, time_s.size):
        dt = time_s[i] - time_s[i - 1]
        slope = (opening_mm[i] - opening_mm[i - 1]) / dt
        settled = opening_mm[i - 1] - slope * taus_s
        slow = settled + slope * dt + (slow - settled) * np.exp(-dt / taus_s)
        out.append(opening_mm[i] - float(shares @ (opening_mm[i] - slow)))
    return np.array(out)


def warming(time_s: Array, amplitude_mm: float, tau_s: float) -> Array:
    """Warming of one body from the first reading on."""
    return amplitude_mm * (1 - np.exp(-(time_s - time_s[0]) / tau_s))


def slow_noise(rng: np.random.Generator, count: int, sd_mm: float, correlation: float) -> Array:
    """Reading noise as an AR(1) process over the rows; white for a correlation of 0."""
    out = [float(rng.standard_normal())]
    for kick in rng.standard_normal(count - 1).tolist():
        out.append(correlation * out[-1] + float(np.sqrt(1 - correlation**2)) * kick)
    return sd_mm * np.array(out)


def rounded(values: Array, step: float) -> Array:
    """Round values to whole steps; unchanged for a step of 0."""
    return values if step == 0 else step * np.round(values / step)
