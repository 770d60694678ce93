"""The catalogue's definitions, written anew from effects.md: what each effect does to a simulation at the samples.

The judge's own implementation. Every effect is a function of its parameters in the order of the table in effects.md;
recursions start each run at rest at its first sample.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
CREEP_TAU_S = np.array([1.0, 4.0, 16.0, 64.0])


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Where the judge evaluates: true inputs and times at the frames, all runs one after another.

    Parameters
    ----------
    input_mm, run_time_s, table_time_s : ndarray, shape (n,)
        Input and the two clocks.
    starts : ndarray of int, shape (runs + 1,)
        First sample of each run, and n.
    """

    input_mm: Array
    run_time_s: Array
    table_time_s: Array
    starts: NDArray[np.int64]

    def late(self, values: Array, delay_s: float) -> Array:
        """Values of `delay_s` ago, linear between samples, held before each run's start."""
        out = np.empty_like(values)
        for a, b in zip(self.starts[:-1], self.starts[1:], strict=True):
            out[a:b] = np.interp(self.run_time_s[a:b] - delay_s, self.run_time_s[a:b], values[a:b])
        return out


@dataclass(frozen=True, slots=True, eq=False)
class Simulated:
    """The simulation table, with a far row at each end so that the line goes on, and its place in the picture."""

    input_mm: Array
    gap_mm: Array
    midline_mm: Array
    force_n: Array | None
    placement_mm: float = 0.0

    @property
    def rest_gap_mm(self) -> float:
        """Gap at zero input."""
        return float(np.interp(0.0, self.input_mm, self.gap_mm))


def extended(
    input_mm: Array, gap_mm: Array, midline_mm: Array, force_n: Array | None, placement_mm: float = 0.0
) -> Simulated:
    """Add the far rows: slope of a line through the last quarter of the rows there."""
    quarter = max(2, len(input_mm) // 4)
    far = 10.0 * np.ptp(input_mm)

    def grown(values: Array) -> Array:
        first = np.polyfit(input_mm[:quarter], values[:quarter], 1)[0]
        last = np.polyfit(input_mm[-quarter:], values[-quarter:], 1)[0]
        return np.concatenate([[values[0] - first * far], values, [values[-1] + last * far]])

    u = np.concatenate([[input_mm[0] - far], input_mm, [input_mm[-1] + far]])
    return Simulated(u, grown(gap_mm), grown(midline_mm), None if force_n is None else grown(force_n), placement_mm)


@njit(cache=True)
def play(u: Array, starts: NDArray[np.int64], full_width: float) -> Array:
    """Play operator, centred at each run's start."""
    out = np.empty_like(u)
    half = 0.5 * full_width
    for r in range(starts.size - 1):
        place = u[starts[r]]
        for i in range(starts[r], starts[r + 1]):
            place = min(max(place, u[i] - half), u[i] + half)
            out[i] = place
    return out


@njit(cache=True)
def jump(u: Array, starts: NDArray[np.int64], size: float) -> Array:
    """Stays until the input is more than `size` away, then follows at once."""
    out = np.empty_like(u)
    for r in range(starts.size - 1):
        place = u[starts[r]]
        for i in range(starts[r], starts[r + 1]):
            if abs(u[i] - place) > size:
                place = u[i]
            out[i] = place
    return out


@njit(cache=True)
def sliders(u: Array, starts: NDArray[np.int64], fraction: float, reach: float) -> Array:
    """Eight elastic sliders of reach k / 8."""
    out = np.empty_like(u)
    e = np.zeros(8)
    for r in range(starts.size - 1):
        e[:] = 0.0
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
def low_pass(o: Array, t: Array, starts: NDArray[np.int64], tau: float) -> Array:
    """First order, exact for an input linear between samples, relaxed at each run's start."""
    out = np.empty_like(o)
    for r in range(starts.size - 1):
        out[starts[r]] = o[starts[r]]
        for i in range(starts[r] + 1, starts[r + 1]):
            dt = t[i] - t[i - 1]
            fade = np.exp(-dt / tau)
            slope = (o[i] - o[i - 1]) / dt
            out[i] = o[i] - slope * tau + (out[i - 1] - o[i - 1] + slope * tau) * fade
    return out


@njit(cache=True)
def oscillator(o: Array, t: Array, starts: NDArray[np.int64], frequency_hz: float, zeta: float) -> Array:
    """Second order, damped to ground, unit gain, exact for an input linear between samples, from rest."""
    out = np.empty_like(o)
    omega = 2 * np.pi * frequency_hz
    zeta = min(zeta, 0.999999)
    damped = omega * np.sqrt(1 - zeta * zeta)
    for r in range(starts.size - 1):
        x, v = o[starts[r]], 0.0
        out[starts[r]] = x
        for i in range(starts[r] + 1, starts[r + 1]):
            dt = t[i] - t[i - 1]
            slope = (o[i] - o[i - 1]) / dt
            # Particular solution for a ramp: o - 2 zeta slope / omega, moving with the slope.
            lag = 2 * zeta * slope / omega
            a = x - (o[i - 1] - lag)
            b = (v - slope + zeta * omega * a) / damped
            fade, c, s = np.exp(-zeta * omega * dt), np.cos(damped * dt), np.sin(damped * dt)
            free = fade * (a * c + b * s)
            v = fade * ((b * damped - zeta * omega * a) * c - (a * damped + zeta * omega * b) * s) + slope
            x = free + o[i] - lag
            out[i] = x
    return out


Effects = dict[str, Array]
"""Parameters of the effects that act, by name; arrays in the order of effects.md."""


def respond(model: Simulated, at: Samples, acting: Effects) -> tuple[Array, Array, Array]:
    """Gap, midline and force at the samples, with the effects acting in the catalogue's order."""
    u = at.input_mm
    zero = np.zeros(1)
    if "drive_lag" in acting:
        u = at.late(u, acting["drive_lag"][0])
    u = (u + acting.get("input_offset", zero)[0]) * (1 + acting.get("input_scale", zero)[0])
    if "encoder_cyclic_error" in acting:
        amplitude, period, phase = acting["encoder_cyclic_error"]
        u = u + amplitude * np.sin(2 * np.pi * u / period + phase)
    if "end_stop" in acting:
        upper, lower = acting["end_stop"]
        u = np.clip(u, lower, upper)
    if "backlash" in acting:
        u = play(u, at.starts, acting["backlash"][0])
    if "stick_slip" in acting:
        u = jump(u, at.starts, acting["stick_slip"][0])
    if "friction_hysteresis" in acting:
        u = sliders(u, at.starts, *acting["friction_hysteresis"])
    rest = model.rest_gap_mm
    o = (np.interp(u, model.input_mm, model.gap_mm) - rest) * (1 + acting.get("lever_ratio_error", zero)[0])
    midline = model.placement_mm + np.interp(u, model.input_mm, model.midline_mm)
    if "large_deflection" in acting:
        reach, cross = acting["large_deflection"]
        o = reach * np.sin(o / reach) + cross * reach * (1 - np.cos(o / reach))
    if "viscoelastic_creep" in acting:
        o = o - sum(
            share * (o - low_pass(o, at.run_time_s, at.starts, tau))
            for share, tau in zip(acting["viscoelastic_creep"], CREEP_TAU_S, strict=True)
        )
    if "structural_resonance" in acting:
        o = oscillator(o, at.run_time_s, at.starts, *acting["structural_resonance"])
    gap = rest + o + acting.get("rest_gap_error", zero)[0]
    midline = midline + acting.get("assembly_asymmetry", zero)[0] * o
    if "finger_contact" in acting:
        floor, remaining = acting["finger_contact"]
        gap = np.where(gap < floor, floor - remaining * (floor - gap), gap)
    if "thermal_drift" in acting:
        amplitude, tau = acting["thermal_drift"]
        gap = gap + amplitude * (1 - np.exp(-at.table_time_s / tau))
    gap, midline = _seen(gap, midline, at, acting, rest)
    force = np.zeros_like(u) if model.force_n is None else np.interp(u, model.input_mm, model.force_n)
    return gap, midline, force * (1 + acting.get("hinge_stiffness_error", zero)[0])


def _seen(gap: Array, midline: Array, at: Samples, acting: Effects, rest: float) -> tuple[Array, Array]:
    zero = np.zeros(1)
    t = at.table_time_s
    points = []
    for side in (-0.5, 0.5):
        x = midline + side * gap
        x = x + acting.get("camera_drift", zero)[0] * t
        x = x * (1 + acting.get("camera_scale_drift", zero)[0] * t)
        x = x / (1 - acting.get("out_of_plane_motion", zero)[0] * (gap - rest))
        x = x * (1 + acting.get("scale_error", zero)[0])
        x = x * (1 + acting.get("lens_distortion", zero)[0] * x**2)
        x = x / (1 + acting.get("camera_tilt", zero)[0] * x)
        x = x + side * acting.get("edge_bias", zero)[0]
        if "camera_latency" in acting:
            x = at.late(x, acting["camera_latency"][0])
        points.append(x)
    return points[1] - points[0], (points[0] + points[1]) / 2
