"""The definitions in effects.md at the rows of a table: an independent program for each effect, for the gap only.

Halves are symmetric, so that effects that move both points together (`camera_drift`, `assembly_asymmetry`) do not
change the gap. The play and the sliders share one start state per run, from -1 to 1. The effect `position_error_map` is
not in this module: it is linear in its curve, which is projected out for sets that contain the effect (`nearest.py`).
"""

import numpy as np

from tests.benchmarks.world.rig import Array, Path, Rig

Effects = dict[str, Array]
"""Parameters of each effect by name, in the order of effects.md."""
CREEP_TAUS_S = (1.0, 4.0, 16.0, 64.0)


def clipped_along(lower: Array, upper: Array, first: Array) -> Array:
    """State that starts at `first` and is clipped to [lower, upper] at successive points, for k cases at once; shape
    (k, m).

    Two successive clips are equivalent to one clip, so that all states are found by doubling (Hillis & Steele 1986).
    """
    low, high = lower.copy(), upper.copy()
    shift = 1
    while shift < low.shape[1]:
        here_low, here_high = low[:, shift:], high[:, shift:]
        new_low = np.clip(low[:, :-shift], here_low, here_high)
        new_high = np.clip(high[:, :-shift], here_low, here_high)
        low = np.concatenate([low[:, :shift], new_low], axis=1)
        high = np.concatenate([high[:, :shift], new_high], axis=1)
        shift *= 2
    return np.clip(first[:, None], low, high)


def places(path: Path, u: Array, half_mm: Array, start: Array) -> Array:
    """Outputs of play operators of several half widths, shape (k, m)."""
    out = np.empty((half_mm.size, u.size))
    for r, (a, b) in enumerate(zip(path.starts[:-1], path.starts[1:], strict=True)):
        first = u[a] + start[r] * half_mm
        out[:, a:b] = clipped_along(u[a:b] - half_mm[:, None], u[a:b] + half_mm[:, None], first)
    return out


def _jumped(path: Path, u: Array, jump_mm: float) -> Array:
    out = np.empty_like(u)
    for a, b in zip(path.starts[:-1], path.starts[1:], strict=True):
        place = u[a]
        for i in range(a, b):
            if abs(u[i] - place) > jump_mm:
                place = u[i]
            out[i] = place
    return out


def _late(path: Path, u: Array, delay_s: float) -> Array:
    if path.at_rest:
        return u
    out = np.empty_like(u)
    for a, b in zip(path.starts[:-1], path.starts[1:], strict=True):
        out[a:b] = np.interp(path.time_s[a:b] - delay_s, path.time_s[a:b], u[a:b])
    return out


def _limited(path: Path, u: Array, speed_mm_s: float) -> Array:
    if path.at_rest:
        return u
    out = np.empty_like(u)
    for a, b in zip(path.starts[:-1], path.starts[1:], strict=True):
        place, out[a] = u[a], u[a]
        for i in range(a + 1, b):
            way = speed_mm_s * (path.time_s[i] - path.time_s[i - 1])
            place = min(max(u[i], place - way), place + way)
            out[i] = place
    return out


def _low_passed(path: Path, o: Array, tau_s: float) -> Array:
    out = np.empty_like(o)
    for a, b in zip(path.starts[:-1], path.starts[1:], strict=True):
        out[a] = o[a]
        for i in range(a + 1, b):
            dt = path.time_s[i] - path.time_s[i - 1]
            # If readings are at rest, each step is complete before the reading; otherwise the input is linear between
            # points.
            slope = 0.0 if path.at_rest or dt == 0 else (o[i] - o[i - 1]) / dt
            before = o[i] if path.at_rest else o[i - 1]
            settled = before - slope * tau_s
            out[i] = settled + slope * dt + (out[i - 1] - settled) * np.exp(-dt / tau_s)
    return out


def _ringing(path: Path, o: Array, frequency_hz: float, damping: float) -> Array:
    if path.at_rest:
        return o
    omega = 2 * np.pi * frequency_hz
    damped = omega * np.sqrt(1 - min(damping, 0.999) ** 2)
    out = np.empty_like(o)
    for a, b in zip(path.starts[:-1], path.starts[1:], strict=True):
        x, v, out[a] = o[a], 0.0, o[a]
        for i in range(a + 1, b):
            dt = path.time_s[i] - path.time_s[i - 1]
            if dt <= 0:
                out[i] = x
                continue
            slope = (o[i] - o[i - 1]) / dt
            lag = 2 * damping * slope / omega
            p, q = x - o[i - 1] + lag, v - slope
            s = (q + damping * omega * p) / damped
            fade, c, w = np.exp(-damping * omega * dt), np.cos(damped * dt), np.sin(damped * dt)
            x = fade * (p * c + s * w) + o[i] - lag
            v = fade * (q * c - (omega**2 * p + damping * omega * q) / damped * w) + slope
            out[i] = x
    return out


def driven(path: Path, acting: Effects, start: Array) -> Array:
    """Input that the mechanism receives, along the path, which already includes the dead time of a command."""
    u, zero = path.input_mm, np.zeros(1)
    if "drive_lag" in acting and not path.commanded:
        u = _late(path, u, acting["drive_lag"][0])
    u = (u + acting.get("input_offset", zero)[0]) * (1 + acting.get("input_scale", zero)[0])
    if "encoder_cyclic_error" in acting:
        amplitude, period, phase = acting["encoder_cyclic_error"]
        u = u + amplitude * np.sin(2 * np.pi * u / period + phase)
    if "end_stop" in acting:
        u = np.clip(u, acting["end_stop"][1], acting["end_stop"][0])
    if "slew_limit" in acting:
        u = _limited(path, u, acting["slew_limit"][0])
    if "backlash" in acting:
        u = places(path, u, 0.5 * acting["backlash"], start)[0]
    if "stick_slip" in acting:
        u = _jumped(path, u, acting["stick_slip"][0])
    if "friction_hysteresis" in acting:
        fraction, reach = acting["friction_hysteresis"]
        # The extension of a slider is the difference between the input and the output of a play of that half width.
        strains = u - places(path, u, reach * np.arange(1, 9) / 8, start)
        u = u - fraction * strains.mean(axis=0)
    return u


def respond(rig: Rig, acting: Effects, start: Array) -> Array:
    """Gap at the rows with a reading."""
    path, zero = rig.path, np.zeros(1)
    if path.commanded and "drive_lag" in acting:
        path = path.delayed(acting["drive_lag"][0])
    rest = float(rig.simulation.gap(np.zeros(1))[0])
    o = rig.simulation.gap(driven(path, acting, start)) - rest
    o = o * (1 + acting.get("lever_ratio_error", zero)[0])
    if "large_deflection" in acting:
        reach, cross = acting["large_deflection"]
        o = reach * np.sin(o / reach) + cross * reach * (1 - np.cos(o / reach))
    if "viscoelastic_creep" in acting:
        shares = acting["viscoelastic_creep"]
        o = o - sum(a * (o - _low_passed(path, o, tau)) for a, tau in zip(shares, CREEP_TAUS_S, strict=True) if a)
    if "structural_resonance" in acting:
        o = _ringing(path, o, *acting["structural_resonance"])
    gap = rest + o + acting.get("rest_gap_error", zero)[0]
    if "finger_contact" in acting:
        floor, remaining = acting["finger_contact"]
        gap = np.where(gap < floor, floor - remaining * (floor - gap), gap)
    t = path.time_s - path.time_s[0]
    if "thermal_drift" in acting:
        amplitude, tau = acting["thermal_drift"]
        gap = gap + amplitude * (1 - np.exp(-t / tau))
    gap = gap * (1 + acting.get("camera_scale_drift", zero)[0] * t)
    gap = gap / (1 - acting.get("out_of_plane_motion", zero)[0] * (gap - rest))
    gap = gap * (1 + acting.get("scale_error", zero)[0])
    gap = gap * (1 + acting.get("lens_distortion", zero)[0] * gap**2 / 4)
    gap = gap / (1 - (acting.get("camera_tilt", zero)[0] * gap / 2) ** 2)
    gap = gap + acting.get("edge_bias", zero)[0]
    if "camera_latency" in acting:
        gap = _late(path, gap, acting["camera_latency"][0])
    return np.asarray(gap[path.row][rig.read])
