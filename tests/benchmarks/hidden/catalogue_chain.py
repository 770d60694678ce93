"""Independent implementation of the definitions in effects.md: change of a simulation by each effect, at the samples.

Every effect is a function of its parameters, in the order of the table in effects.md. The start states of effects with
memory are unknown in each run: `RUN_START` (plays and sliders) and `CREEP_START` contain one number from -1 to 1 per
run. Without these entries, the play is centred, the sliders are relaxed, and the creep is settled.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.hidden.recursions import jump, limited, low_pass, oscillator, play, sliders

Array = NDArray[np.float64]
CREEP_TAU_S = np.array([1.0, 4.0, 16.0, 64.0])
RUN_START, CREEP_START = "run_start", "creep_start"
WITH_START = {"backlash": RUN_START, "friction_hysteresis": RUN_START, "viscoelastic_creep": CREEP_START}
"""Effects whose start state is a nuisance parameter, with the key of this parameter."""
MAP = "position_error_map"
MAP_WAVES = np.arange(1, 15)
"""Numbers of half waves over the travel in the map of position errors; the diagnosis uses a Gaussian process
instead."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """True inputs and times at the frames, for all runs in succession.

    Parameters
    ----------
    input_mm, run_time_s, table_time_s : ndarray, shape (n,)
        Input, time since the start of the run, and time since the start of the table.
    starts : ndarray of int, shape (runs + 1,)
        First sample of each run, and n.
    at_rest : bool
        Whether the input steps right after each sample and rests until the next one.
    """

    input_mm: Array
    run_time_s: Array
    table_time_s: Array
    starts: NDArray[np.int64]
    at_rest: bool = False

    def late(self, values: Array, delay_s: float) -> Array:
        """Values delayed by `delay_s`, linear between samples and constant before each run's start."""
        out = np.empty_like(values)
        for a, b in zip(self.starts[:-1], self.starts[1:], strict=True):
            out[a:b] = np.interp(self.run_time_s[a:b] - delay_s, self.run_time_s[a:b], values[a:b])
        return out


@dataclass(frozen=True, slots=True, eq=False)
class Simulated:
    """The simulation table, extended linearly by a distant row at each end, with its position in the picture."""

    input_mm: Array
    gap_mm: Array
    midline_mm: Array
    force_n: Array | None
    placement_mm: float = 0.0
    travel_mm: tuple[float, float] = (0.0, 1.0)

    @property
    def rest_gap_mm(self) -> float:
        """Simulated gap at zero input."""
        return float(np.interp(0.0, self.input_mm, self.gap_mm))


def extended(
    input_mm: Array,
    gap_mm: Array,
    midline_mm: Array,
    force_n: Array | None,
    placement_mm: float = 0.0,
    travel_mm: tuple[float, float] | None = None,
) -> Simulated:
    """Extend a table by a distant row at each end, on a line through the quarter of the rows at that end.

    `travel_mm` contains the ends of the range over which a map of position errors has zero mean and slope; by default
    those of the table.
    """
    travel = travel_mm or (float(input_mm[0]), float(input_mm[-1]))
    quarter = max(2, len(input_mm) // 4)
    far = 10.0 * np.ptp(input_mm)

    def grown(values: Array) -> Array:
        first = np.polyfit(input_mm[:quarter], values[:quarter], 1)[0]
        last = np.polyfit(input_mm[-quarter:], values[-quarter:], 1)[0]
        return np.concatenate([[values[0] - first * far], values, [values[-1] + last * far]])

    u = np.concatenate([[input_mm[0] - far], input_mm, [input_mm[-1] + far]])
    force = None if force_n is None else grown(force_n)
    return Simulated(u, grown(gap_mm), grown(midline_mm), force, placement_mm, travel)


def map_errors(u: Array, travel_mm: tuple[float, float], heights_mm: Array) -> Array:
    """Map of position errors at given inputs: half waves, each minus its straight line over the travel."""
    even = np.linspace(0.0, 1.0, 201)
    z = np.clip((u - travel_mm[0]) / (travel_mm[1] - travel_mm[0]), -0.1, 1.1)
    out = np.zeros_like(u)
    for k, height in zip(MAP_WAVES, heights_mm, strict=True):
        line = np.polyfit(even, np.cos(np.pi * k * even), 1)
        out += height * (np.cos(np.pi * k * z) - np.polyval(line, z))
    return out


Effects = dict[str, Array]
"""Parameters of the acting effects by name, in the order of effects.md; start states may be included."""


def without_starts(acting: Effects) -> Effects:
    """Effects without the entries of start states."""
    return {name: values for name, values in acting.items() if name not in (RUN_START, CREEP_START)}


def driven(at: Samples, acting: Effects, travel_mm: tuple[float, float] = (0.0, 1.0)) -> Array:
    """Input that the mechanism receives at the samples."""
    u = at.input_mm
    zero = np.zeros(1)
    begin = acting.get(RUN_START, np.zeros(len(at.starts) - 1))
    if "drive_lag" in acting:
        u = at.late(u, acting["drive_lag"][0])
    u = (u + acting.get("input_offset", zero)[0]) * (1 + acting.get("input_scale", zero)[0])
    if "encoder_cyclic_error" in acting:
        amplitude, period, phase = acting["encoder_cyclic_error"]
        u = u + amplitude * np.sin(2 * np.pi * u / period + phase)
    if "end_stop" in acting:
        upper, lower = acting["end_stop"]
        u = np.clip(u, lower, upper)
    if MAP in acting:
        u = u + map_errors(u, travel_mm, acting[MAP])
    if "slew_limit" in acting:
        u = limited(u, at.run_time_s, at.starts, acting["slew_limit"][0])
    if "backlash" in acting:
        u = play(u, at.starts, acting["backlash"][0], begin)
    if "stick_slip" in acting:
        u = jump(u, at.starts, acting["stick_slip"][0])
    if "friction_hysteresis" in acting:
        u = sliders(u, at.starts, *acting["friction_hysteresis"], begin)
    return u


def respond(model: Simulated, at: Samples, acting: Effects) -> tuple[Array, Array, Array]:
    """Gap, midline and force at the samples; the effects act in the catalogue's order."""
    u = driven(at, acting, model.travel_mm)
    zero = np.zeros(1)
    centred = np.zeros(len(at.starts) - 1)
    rest = model.rest_gap_mm
    o = (np.interp(u, model.input_mm, model.gap_mm) - rest) * (1 + acting.get("lever_ratio_error", zero)[0])
    midline = model.placement_mm + np.interp(u, model.input_mm, model.midline_mm)
    if "large_deflection" in acting:
        reach, cross = acting["large_deflection"]
        o = reach * np.sin(o / reach) + cross * reach * (1 - np.cos(o / reach))
    if "viscoelastic_creep" in acting:
        o = o - sum(
            share * (o - low_pass(o, at.run_time_s, at.starts, tau, acting.get(CREEP_START, centred), at.at_rest))
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
