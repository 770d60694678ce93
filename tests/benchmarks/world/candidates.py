"""Effects that may be named for a table, with the bounds in effects.md and starting values of a search."""

from dataclasses import dataclass
from itertools import product

import numpy as np

from tests.benchmarks.world.definitions import NEEDS_MOTION
from tests.benchmarks.world.rig import Array, Rig

WITH_START = ("backlash", "friction_hysteresis")
"""Effects whose state at the start of a run is a nuisance parameter."""
CLOCKED = ("thermal_drift", "camera_scale_drift")
"""Effects that are excluded if the time restarts between runs."""
OFFSETS = frozenset({"input_offset", "rest_gap_error", "edge_bias"})
RATIOS = frozenset({"input_scale", "lever_ratio_error", "scale_error"})
MAP = "position_error_map"


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """Parameters of one effect: names, bounds and starting values, each of shape (p,)."""

    name: str
    names: tuple[str, ...]
    lower: Array
    upper: Array
    begins: tuple[Array, ...]


def _of(name: str, names: tuple[str, ...], bounds: list[tuple[float, float]], begins: list[list[float]]) -> Candidate:
    low, high = np.array(bounds, dtype=float).T
    return Candidate(name, names, low, high, tuple(np.clip(np.array(b, dtype=float), low, high) for b in begins))


def time_restarts(rig: Rig) -> bool:
    """Whether `time_s` restarts with a run."""
    return bool(np.any(np.diff(rig.time_s) < 0))


def candidates(rig: Rig, size_mm: float) -> dict[str, Candidate]:
    """All effects that the table allows; `size_mm` is the size of its disagreement with the simulation."""
    u, path = rig.path.input_mm, rig.path
    low, high = float(u.min()), float(u.max())
    width = high - low
    gap = rig.simulation.gap(u)
    rest = float(rig.simulation.gap(np.zeros(1))[0])
    opening = max(float(np.max(np.abs(gap - rest))), 1e-6)
    slope = max(float(np.ptp(gap)) / width, 1e-6)
    tall = float(np.max(np.abs(gap)))
    total = max(float(np.ptp(path.time_s)), 1.0)
    s, d = size_mm / slope, size_mm
    steps = np.abs(np.diff(u))
    moving = steps[steps > 1e-3 * steps.max()]
    shortest = min(max(4 * float(np.median(moving)), 1e-4), 0.45 * width)
    dt = np.diff(path.time_s)
    rate = 1 / float(np.median(dt[dt > 0]))
    both = (-1.0, 1.0)
    bounded = min(width, 0.5)
    periods = 1 / np.linspace(2 / width, 1 / shortest, 60)
    taus = np.geomspace(max(2.0, total / 20), min(3000.0, 3 * total + 3), 3)
    found = [
        _of("drive_lag", ("delay_s",), [(0, 1)], [[0.02], [0.1], [0.3]]),
        _of("input_offset", ("offset_mm",), [(-0.5, 0.5)], [[s]]),
        _of("input_scale", ("ratio",), [(-0.3, 0.3)], [[d / opening]]),
        _of("encoder_cyclic_error", ("amplitude_mm", "period_mm", "phase_rad"),
            [(0, 0.2), (shortest, width / 2), (-20, 20)], [[1.4 * s, p, a] for p in periods for a in (0.0, 1.57)]),
        _of("end_stop", ("upper_mm", "lower_mm"), [(low, high)] * 2,
            [[high - f * width, low] for f in (0.02, 0.1, 0.3)] + [[high, low + f * width] for f in (0.02, 0.1, 0.3)]),
        _of("slew_limit", ("speed_mm_s",), [(0.02 * width / total, 1e4)],
            [[f * width] for f in (0.3, 1.0, 3.0, 10.0)]),
        _of("backlash", ("play_mm",), [(0, 0.5)], [[s], [2 * s], [5 * s]]),
        _of("stick_slip", ("jump_mm",), [(min(1e-3 * width, 0.1), 0.5)],
            [[f * bounded] for f in np.geomspace(0.005, 0.5, 12)]),
        _of("friction_hysteresis", ("fraction", "reach_mm"), [(0, 0.9), (0.02 * width, 0.6 * width)],
            [[min(2 * s / (f * width), 0.5), f * width] for f in (0.02, 0.1, 0.4)]),
        _of("lever_ratio_error", ("ratio",), [(-0.3, 0.3)], [[d / opening]]),
        _of("large_deflection", ("reach_mm", "cross"), [(opening / 2, 1e4 * opening), (-2, 2)],
            [[r * opening, c] for r in (1.0, 10.0) for c in (-1.0, 1.0)]),
        _of("viscoelastic_creep", tuple(f"fraction_{k}s" for k in (1, 4, 16, 64)), [(0, 0.5)] * 4,
            [[min(d / opening, 0.1)] * 4]),
        _of("structural_resonance", ("frequency_hz", "damping_ratio"), [(0.5, max(0.4 * rate, 0.6)), (0.005, 1)],
            [list(b) for b in product((0.7, 2.0, 0.2 * rate), (0.1, 0.7))]),
        _of("rest_gap_error", ("offset_mm",), [(-2, 2)], [[d]]),
        _of("finger_contact", ("floor_mm", "remaining_slope"), [(0, max(rest, 1e-3)), (0, 0.5)],
            [[float(gap.min()) + f * float(np.ptp(gap)), 0.1] for f in (0.02, 0.1, 0.3)]),
        _of("thermal_drift", ("amplitude_mm", "tau_s"), [(-2, 2), (2, 3000)],
            [[sign * 2 * d, t] for t in taus for sign in both]),
        _of("camera_scale_drift", ("rate_per_s",), [(-1e-3, 1e-3)], [[d / tall / total]]),
        _of("out_of_plane_motion", ("relative_per_mm",), [(-0.02, 0.02)], [[d / opening / tall]]),
        _of("scale_error", ("ratio",), [(-0.2, 0.2)], [[d / tall]]),
        _of("lens_distortion", ("k_per_mm2",), [(-5e-3, 5e-3)], [[4 * d / tall**3]]),
        _of("camera_tilt", ("k_per_mm",), [(-0.02, 0.02)], [[2 * np.sqrt(d / tall) / tall]]),
        _of("edge_bias", ("offset_mm",), [(-0.1, 0.1)], [[d]]),
        _of("camera_latency", ("delay_s",), [(0, 1)], [[0.02], [0.1], [0.3]]),
    ]  # fmt: skip
    without = set(NEEDS_MOTION if path.at_rest else ()) | set(CLOCKED if time_restarts(rig) else ())
    if rate * 0.4 <= 0.5:
        without.add("structural_resonance")
    return {c.name: c for c in found if c.name not in without}
