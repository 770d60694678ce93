"""Every effect that may be named for a table: parameters, bounds and starting values of a search."""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from tests.benchmarks.hidden.catalogue_chain import MAP, MAP_WAVES, Samples, Simulated
from tests.benchmarks.hidden.noise import Noise
from tests.benchmarks.hidden.sizes import CLOCKED

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """One effect of the catalogue, for a given table.

    Parameters
    ----------
    name : str
        Name in the catalogue.
    lower, upper : ndarray, shape (p,)
        Bounds according to effects.md for the table.
    starts : tuple of ndarray, shape (p,)
        Starting values of a search, with small sizes, so that each is also a linear signature.
    groups : tuple of tuple of int
        Groups of starting values that form one linear signature.
    names : tuple of str
        Names of the parameters of the effect.
    """

    name: str
    names: tuple[str, ...]
    lower: Array
    upper: Array
    starts: tuple[Array, ...]
    groups: tuple[tuple[int, ...], ...]


def _one(name: str, parameter: str, bound: float, start: float, lower: float | None = None) -> Candidate:
    low = -bound if lower is None else lower
    return Candidate(name, (parameter,), np.array([low]), np.array([bound]), (np.array([start]),), ((0,),))


def _many(name: str, names: tuple[str, ...], lower: list[float], upper: list[float], starts: list[list[float]],
          together: int = 1) -> Candidate:  # fmt: skip
    groups = tuple(tuple(range(i, i + together)) for i in range(0, len(starts), together))
    return Candidate(
        name, names, np.array(lower), np.array(upper), tuple(np.array(s, dtype=float) for s in starts), groups
    )


def map_candidate(width_mm: float) -> Candidate:
    """The map of position errors, in the form used by the benchmark."""
    count = len(MAP_WAVES)
    names = tuple(f"wave_{k}_mm" for k in MAP_WAVES)
    begins = (1e-3 * width_mm * np.eye(count)).tolist()
    return _many(MAP, names, [-0.3 * width_mm] * count, [0.3 * width_mm] * count, begins, count)


def candidates(
    model: Simulated, at: Samples, noise: Noise, *, time_restarts: bool, has_force: bool, with_map: bool = False
) -> list[Candidate]:
    """All effects that a table allows, in the catalogue's order.

    The map of position errors is included only on request, because its many parameters fit many tables.
    """
    u = at.input_mm
    low, high = float(u.min()), float(u.max())
    width = high - low
    steps = np.abs(np.diff(u))
    moving = steps[steps > max(1e-3 * steps.max(), noise.encoder_step_mm / 2)]
    shortest = max(4 * float(np.median(moving)), 0.02 * width)
    rate_hz = 1 / float(np.median(np.diff(at.run_time_s[: at.starts[1]])))
    total_s = float(at.table_time_s.max())
    gap = np.interp(u, model.input_mm, model.gap_mm)
    opening = float(np.max(np.abs(gap - model.rest_gap_mm)))
    rest, closed = model.rest_gap_mm, float(gap.min())
    found = [
        _one("drive_lag", "delay_s", 1.0, 0.02, 0.0),
        _one("input_offset", "offset_mm", 0.5, 1e-3 * width),
        _one("input_scale", "ratio", 0.3, 1e-3),
    ]
    count = int(min(60, 2.5 * width / shortest * 2))
    periods = 1 / np.linspace(1 / (width / 2), 1 / min(shortest, width / 2.05), max(count, 4))
    found.append(
        _many("encoder_cyclic_error", ("amplitude_mm", "period_mm", "phase_rad"), [0, shortest, -20.0],
              [0.2, width / 2, 20.0],
              [[1e-3 * width, p, a] for p in periods for a in (0.0, np.pi / 2)], 2)
    )  # fmt: skip
    depths = width * np.array([0.01, 0.03, 0.07, 0.14, 0.25])
    stops = [[high - d, low] for d in depths] + [[high, low + d] for d in depths]
    found.append(_many("end_stop", ("upper_mm", "lower_mm"), [low, low], [high, high], stops))
    # The speed limit must be below the fastest motion, but above the slowest motion including its reversals.
    speeds = np.abs(np.diff(u)) / np.maximum(np.diff(at.run_time_s), 1e-9)
    speeds = speeds[(np.diff(at.run_time_s) > 0) & (steps > 1e-3 * steps.max())]
    slowest, fastest = (float(q) for q in np.quantile(speeds, [0.02, 0.98]))
    if slowest < 0.9 * fastest:
        found.append(_many("slew_limit", ("speed_mm_s",), [slowest], [2 * fastest],
                           [[slowest + f * (fastest - slowest)] for f in (0.2, 0.5, 0.8, 0.95)]))  # fmt: skip
    plays = min(0.5, width) * np.array([0.003, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4])
    found.append(_many("backlash", ("play_mm",), [0.0], [0.5], [[p] for p in plays]))
    seen = max(2 * noise.encoder_step_mm, 6 * float(np.sqrt(noise.input_variance_mm2)), 1e-3 * width)
    if seen < 0.45:
        jumps = np.geomspace(seen, min(0.5, width), 40)
        found.append(_many("stick_slip", ("jump_mm",), [seen], [0.5], [[j] for j in jumps]))
    reaches = width * np.array([0.025, 0.05, 0.1, 0.2, 0.35, 0.6])
    found.append(_many("friction_hysteresis", ("fraction", "reach_mm"), [0.0, 0.02 * width], [0.9, 0.6 * width],
                       [[0.05, r] for r in reaches]))  # fmt: skip
    found.append(_one("lever_ratio_error", "ratio", 0.3, 1e-3))
    found.append(_many("large_deflection", ("reach_mm", "cross"), [opening / 2, -2.0], [200 * opening, 2.0],
                       [[10 * opening, 0.0], [30 * opening, 0.5]], 2))  # fmt: skip
    found.append(_many("viscoelastic_creep", tuple(f"fraction_{k}s" for k in (1, 4, 16, 64)), [0.0] * 4, [0.5] * 4,
                       (0.01 * np.eye(4)).tolist(), 4))  # fmt: skip
    top = 0.4 * rate_hz
    if top > 0.5:
        rings = [[f, z] for f, z in product(np.geomspace(0.5, top, 6), (0.01, 0.1, 0.6))]
        found.append(_many("structural_resonance", ("frequency_hz", "damping_ratio"), [0.5, 0.005], [top, 1.0], rings))
    found += [_one("rest_gap_error", "offset_mm", 2.0, 1e-3), _one("assembly_asymmetry", "share", 0.5, 1e-3)]
    floors = [closed + d * (rest - closed) for d in (0.02, 0.06, 0.15, 0.3, 0.5, 0.8)]
    found.append(_many("finger_contact", ("floor_mm", "remaining_slope"), [0.0, 0.0], [rest, 0.5],
                       [[f, 0.2] for f in floors]))  # fmt: skip
    if has_force:
        found.append(_one("hinge_stiffness_error", "ratio", 0.9, 1e-2))
    if not time_restarts:
        taus = np.geomspace(2.0, min(3000.0, 5 * total_s + 4), 8)
        found.append(_many("thermal_drift", ("amplitude_mm", "tau_s"), [-2.0, 2.0], [2.0, 3000.0],
                           [[1e-3, t] for t in taus]))  # fmt: skip
        found.append(_one("camera_drift", "rate_mm_per_s", 0.05, 1e-5))
        found.append(_one("camera_scale_drift", "rate_per_s", 1e-3, 1e-6))
    found += [
        _one("out_of_plane_motion", "relative_per_mm", 0.02, 1e-4),
        _one("scale_error", "ratio", 0.2, 1e-3),
        _one("lens_distortion", "k_per_mm2", 5e-3, 1e-5),
        _one("camera_tilt", "k_per_mm", 0.02, 1e-4),
        _one("edge_bias", "offset_mm", 0.1, 1e-3),
        _one("camera_latency", "delay_s", 1.0, 0.02, 0.0),
    ]
    if with_map:
        found.insert([c.name for c in found].index("end_stop") + 1, map_candidate(width))
    assert not (time_restarts and {c.name for c in found} & set(CLOCKED))
    return found
