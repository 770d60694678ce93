"""Sizes of simulated effects: random ordinary sizes, and scaling of an effect by one factor."""

from collections.abc import Callable

import numpy as np

from tests.benchmarks.hidden.design import Design
from tests.benchmarks.hidden.gripper_table import GripperTable, InputRange
from tests.benchmarks.hidden.plant import Hidden

CLOCKED = ("thermal_drift", "camera_drift", "camera_scale_drift")
"""Effects that are excluded if the time restarts between runs, as stated in effects.md."""

NAMES = (
    "drive_lag", "input_offset", "input_scale", "encoder_cyclic_error", "end_stop", "backlash", "stick_slip",
    "friction_hysteresis", "lever_ratio_error", "large_deflection", "viscoelastic_creep", "structural_resonance",
    "rest_gap_error", "assembly_asymmetry", "finger_contact", "thermal_drift", "hinge_stiffness_error", "camera_drift",
    "camera_scale_drift", "out_of_plane_motion", "scale_error", "lens_distortion", "camera_tilt", "edge_bias",
    "camera_latency",
)  # fmt: skip
"""Effects from which the first rows draw, in the catalogue's order."""

WITH_START = ("backlash", "friction_hysteresis")
"""Effects with random start states."""
MAP_HEIGHTS = 8
"""Number of knots of a simulated map of position errors."""


def draw_hidden(
    rng: np.random.Generator, name: str, table: GripperTable, inputs: InputRange, design: Design, total_s: float
) -> Hidden:
    """Draw an effect with an ordinary size for a gripper and its runs."""
    sign = float(rng.choice([-1.0, 1.0]))
    opening = float(np.max(np.abs(table.gap(np.array([inputs.lower_mm, inputs.upper_mm])) - table.rest_gap_mm)))

    def about(size: float) -> float:
        return float(sign * size * rng.uniform(0.5, 2.0))

    p = (
        _of_the_drive(rng, name, inputs, about)
        or _of_the_mechanism(rng, name, inputs, opening, design, total_s, about)
        or _of_the_camera(name, total_s, about)
    )
    if p is None:
        raise ValueError(f"hidden effect must be one of {NAMES} or of those of the rows, but is {name}.")
    return Hidden(name, p)


def _of_the_drive(
    rng: np.random.Generator, name: str, inputs: InputRange, about: Callable[[float], float]
) -> dict[str, float] | None:
    width = inputs.width_mm
    match name:
        case "drive_lag" | "camera_latency":
            return {"delay_s": abs(about(0.15))}
        case "input_offset":
            return {"offset_mm": about(0.02)}
        case "input_scale" | "lever_ratio_error" | "scale_error":
            return {"ratio": about(0.03)}
        case "encoder_cyclic_error":
            period = width * rng.uniform(0.12, 0.35)
            return {"amplitude_mm": abs(about(0.01)), "period_mm": period, "phase_rad": rng.uniform(0, 2 * np.pi)}
        case "end_stop":
            depth = width * rng.uniform(0.05, 0.2)
            upper = rng.random() < 0.5
            return {"upper_mm": inputs.upper_mm - depth} if upper else {"lower_mm": inputs.lower_mm + depth}
        case "position_error_map":
            heights = rng.standard_normal(MAP_HEIGHTS) * 0.01
            return {f"height_{k}_mm": float(h) for k, h in enumerate(heights)}
        case "slew_limit":
            return {"speed_mm_s": width * rng.uniform(0.1, 0.4)}
        case "backlash":
            return {"play_mm": abs(about(0.015))}
    return None


def _of_the_mechanism(
    rng: np.random.Generator,
    name: str,
    inputs: InputRange,
    opening: float,
    design: Design,
    total_s: float,
    about: Callable[[float], float],
) -> dict[str, float] | None:
    width = inputs.width_mm
    match name:
        case "stick_slip":
            return {"jump_mm": width * rng.uniform(0.04, 0.12)}
        case "friction_hysteresis":
            reach = width * rng.uniform(0.1, 0.4)
            return {"fraction": rng.uniform(0.1, 0.5), "reach_mm": reach, "dahl": float(rng.random() < 0.5)}
        case "large_deflection":
            return {"reach_mm": opening * rng.uniform(0.8, 2.0), "cross": rng.uniform(-1, 1)}
        case "viscoelastic_creep":
            total = rng.uniform(0.05, 0.3)
            shares = rng.dirichlet([1.0] * 5) * total
            return {f"share_{k}": float(s) for k, s in enumerate(shares)}
        case "structural_resonance":
            top = max(0.3 * design.rate_hz, 0.7)
            return {"frequency_hz": rng.uniform(0.6, top), "damping_ratio": rng.uniform(0.02, 0.4)}
        case "rest_gap_error":
            return {"offset_mm": about(0.1)}
        case "assembly_asymmetry":
            return {"share": about(0.05)}
        case "finger_contact":
            floor = rng.uniform(0.3, 0.8)
            return {"floor_mm": floor, "remaining_slope": rng.uniform(0, 0.4), "softness_mm": 0.01}
        case "thermal_drift":
            return {"amplitude_mm": about(0.1), "tau_s": total_s * rng.uniform(0.15, 1.0)}
        case "hinge_stiffness_error":
            return {"ratio": about(0.2)}
    return None


def _of_the_camera(name: str, total_s: float, about: Callable[[float], float]) -> dict[str, float] | None:
    match name:
        case "camera_drift":
            return {"rate_mm_per_s": about(0.1 / total_s)}
        case "camera_scale_drift":
            return {"rate_per_s": about(0.02 / total_s)}
        case "out_of_plane_motion":
            return {"relative_per_mm": about(0.004)}
        case "lens_distortion":
            return {"k_per_mm2": about(0.002)}
        case "camera_tilt":
            return {"k_per_mm": about(0.005)}
        case "edge_bias":
            return {"offset_mm": about(0.03)}
    return None


def scaled(effect: Hidden, factor: float, inputs: InputRange, table: GripperTable) -> Hidden:
    """The same effect with its size multiplied by a factor; shape parameters (period, reach of the sliders) are
    unchanged.
    """
    p = dict(effect.parameters)
    match effect.name:
        case "encoder_cyclic_error" | "thermal_drift":
            key = "amplitude_mm"
            p[key] *= factor
        case "end_stop":
            if "upper_mm" in p:
                p["upper_mm"] = inputs.upper_mm - factor * (inputs.upper_mm - p["upper_mm"])
            else:
                p["lower_mm"] = inputs.lower_mm + factor * (p["lower_mm"] - inputs.lower_mm)
        case "friction_hysteresis":
            p["fraction"] *= factor
        case "large_deflection":
            p["reach_mm"] /= np.sqrt(factor)
            p["cross"] *= np.sqrt(factor)
        case "structural_resonance":
            p["frequency_hz"] /= factor
        case "slew_limit":
            p["speed_mm_s"] /= factor
        case "finger_contact":
            closed = float(table.gap(np.array([inputs.lower_mm]))[0])
            p["floor_mm"] = closed + factor * (p["floor_mm"] - closed)
            p["softness_mm"] = min(p["softness_mm"], 0.1 * abs(p["floor_mm"] - closed))
        case _:
            p = {key: value * factor for key, value in p.items()}
    return Hidden(effect.name, p)


LIMITS = {
    "drive_lag": ("delay_s", 0.95), "input_offset": ("offset_mm", 0.45), "input_scale": ("ratio", 0.28),
    "encoder_cyclic_error": ("amplitude_mm", 0.18), "backlash": ("play_mm", 0.45), "stick_slip": ("jump_mm", 0.45),
    "friction_hysteresis": ("fraction", 0.8), "lever_ratio_error": ("ratio", 0.28), "large_deflection": ("cross", 1.9),
    "rest_gap_error": ("offset_mm", 1.9), "assembly_asymmetry": ("share", 0.45), "thermal_drift": ("amplitude_mm", 1.9),
    "hinge_stiffness_error": ("ratio", 0.85), "camera_drift": ("rate_mm_per_s", 0.045),
    "camera_scale_drift": ("rate_per_s", 9e-4), "out_of_plane_motion": ("relative_per_mm", 0.018),
    "scale_error": ("ratio", 0.18), "lens_distortion": ("k_per_mm2", 4.5e-3), "camera_tilt": ("k_per_mm", 0.018),
    "edge_bias": ("offset_mm", 0.095), "camera_latency": ("delay_s", 0.95),
}  # fmt: skip


def within_bounds(effect: Hidden, table: GripperTable, inputs: InputRange, rate_hz: float) -> bool:
    """Whether the parameters are within the catalogue's bounds, with a small margin."""
    p = effect.parameters
    ends = table.gap(np.array([inputs.lower_mm, inputs.upper_mm])) - table.rest_gap_mm
    match effect.name:
        case "position_error_map":
            return max(abs(v) for v in p.values()) < 0.2 * inputs.width_mm
        case "slew_limit":
            # The slowest strokes of every design take 18 s, including reversals.
            return p["speed_mm_s"] > inputs.width_mm / 15
        case "end_stop":
            stop = p.get("upper_mm", p.get("lower_mm", 0.0))
            return bool(inputs.lower_mm + 0.1 * inputs.width_mm < stop or "lower_mm" in p) and bool(
                stop < inputs.upper_mm and stop > inputs.lower_mm
            )
        case "viscoelastic_creep":
            return sum(p.values()) < 0.48
        case "structural_resonance":
            return 0.55 < p["frequency_hz"] < 0.36 * rate_hz
        case "finger_contact":
            return 0.02 < p["floor_mm"] < 0.8 * table.rest_gap_mm
        case "large_deflection":
            return bool(p["reach_mm"] > 0.55 * np.max(np.abs(ends)) and abs(p["cross"]) < 1.9)
    key, limit = LIMITS[effect.name]
    return abs(p[key]) < limit
