"""Set-ups that are read at rest after each motion: stages measured with a laser, slits, slow drifts."""

from dataclasses import dataclass, field, replace

import numpy as np

from tests.benchmarks.world import physics
from tests.benchmarks.world.error_map import ErrorMap
from tests.benchmarks.world.rig import Array, Booleans, Hidden, Integers, Path, Rig, Simulation


@dataclass(frozen=True, slots=True, eq=False)
class Stations:
    """Successive positions (stations) of the stage, over all runs.

    Parameters
    ----------
    position_mm, time_s : ndarray, shape (m,)
        Set positions, and the times of their readings; the time may restart with each run.
    run : ndarray of int, shape (m,)
    read, listed : ndarray of bool, shape (m,)
        Whether a reading is taken at the station, and whether the table contains the station.
    """

    position_mm: Array
    time_s: Array
    run: Integers
    read: Booleans
    listed: Booleans


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """Simulated errors of the stage.

    Parameters
    ----------
    play_mm, start : float
        Play, and its state before the first station (-1: engaged by upward motion).
    error_map : ErrorMap or None
    ratio : float
        Relative error of the input's scale.
    offset_mm : float
        Error of the gap's zero.
    drift_mm, drift_tau_s : float
        Amplitude and time constant of a warming that starts at the first station.
    """

    play_mm: float = 0.0
    start: float = -1.0
    error_map: ErrorMap | None = None
    ratio: float = 0.0
    offset_mm: float = 0.0
    drift_mm: float = 0.0
    drift_tau_s: float = 1.0


@dataclass(frozen=True, slots=True)
class Reading:
    """Properties of the readings.

    Parameters
    ----------
    noise_mm, resolution_mm : float
        Standard deviation of a reading, and unit of its last digit.
    gap_at_zero_mm : float
        Gap at zero input.
    simulation : str
        `line`: the position equals the target; `map`: mean of all readings at each position, as in published reports.
    zeroed : bool
        Whether the reference is set to zero at the first reading.
    correlation : float
        Coefficient of the AR(1) noise between successive readings.
    """

    noise_mm: float
    resolution_mm: float
    gap_at_zero_mm: float
    simulation: str = "line"
    zeroed: bool = False
    correlation: float = 0.0
    kind: str = ""
    note: str = field(default="")


def placed(stations: Stations, parts: Parts) -> Array:
    """Actual position of the stage at each station, in mm of input."""
    u = stations.position_mm * (1 + parts.ratio)
    if parts.error_map is not None:
        u = u + parts.error_map(u)
    return physics.play(u, parts.play_mm, parts.start)


def hidden_of(parts: Parts, shift_mm: float, places_mm: Array) -> tuple[Hidden, ...]:
    """Simulated errors by the names of the catalogue; `shift_mm` is the total error of the gap's zero."""
    found = []
    if parts.ratio:
        found.append(Hidden("input_scale", {"ratio": parts.ratio}))
    if parts.error_map is not None:
        rms = float(np.sqrt(np.mean(parts.error_map(places_mm) ** 2)))
        found.append(Hidden("position_error_map", {"rms_mm": rms}))
    if parts.play_mm:
        found.append(Hidden("backlash", {"play_mm": parts.play_mm}))
    if shift_mm:
        found.append(Hidden("rest_gap_error", {"offset_mm": shift_mm}))
    if parts.drift_mm:
        found.append(Hidden("thermal_drift", {"amplitude_mm": parts.drift_mm, "tau_s": parts.drift_tau_s}))
    return tuple(found)


def clean_gap(stations: Stations, parts: Parts, gap_at_zero_mm: float, place_mm: Array | None = None) -> Array:
    """Gap at each station without reading noise."""
    gap = gap_at_zero_mm + parts.offset_mm + (placed(stations, parts) if place_mm is None else place_mm)
    if parts.drift_mm:
        gap = gap + physics.warming(stations.time_s, parts.drift_mm, parts.drift_tau_s)
    return gap


def read_at_rest(
    rng: np.random.Generator, stations: Stations, parts: Parts, reading: Reading, place_mm: Array | None = None
) -> Rig:
    """Simulate readings at all stations; `place_mm` replaces the positions computed by `placed`."""
    clean = clean_gap(stations, parts, reading.gap_at_zero_mm, place_mm)
    noise = physics.slow_noise(rng, clean.size, reading.noise_mm, reading.correlation)
    read = stations.read & stations.listed
    shift = parts.offset_mm
    if reading.zeroed:
        first = int(np.argmax(read))
        wrong = float(clean[first] - reading.gap_at_zero_mm - stations.position_mm[first])
        clean = clean - wrong
        shift -= wrong
    gap = physics.rounded(clean + noise, reading.resolution_mm)
    places = np.unique(stations.position_mm[read])
    reach = 0.05 * float(np.ptp(stations.position_mm)) + 1e-3
    ends = np.array([stations.position_mm.min() - reach, stations.position_mm.max() + reach])
    simulation = Simulation(ends, ends + reading.gap_at_zero_mm)
    hidden_map = parts.error_map is not None
    if reading.simulation == "map":
        seen, wanted = _means(stations, read, gap, places), _means(stations, read, clean, places)
        rows = np.concatenate([[ends[0]], places, [ends[1]]])
        simulation = Simulation(
            rows, np.concatenate([[seen[0] + ends[0] - places[0]], seen, [seen[-1] + ends[1] - places[-1]]])
        )
        # The table of means contains the noise of the same readings, so that the difference contains less noise.
        clean = clean + np.interp(stations.position_mm, places, seen - wanted)
        hidden_map = False
        drifted = physics.warming(stations.time_s, parts.drift_mm, parts.drift_tau_s) if parts.drift_mm else None
        shift = 0.0 if drifted is None else -float(drifted[read].mean())
        parts = replace(parts, ratio=0.0)
    listed = stations.listed
    return Rig(
        kind=reading.kind,
        run=stations.run[listed],
        time_s=stations.time_s[listed],
        input_mm=stations.position_mm[listed],
        gap_mm=gap[listed],
        read=read[listed],
        clean_gap_mm=clean[listed],
        noise_mm=float(np.hypot(reading.noise_mm, reading.resolution_mm / np.sqrt(12))),
        simulation=simulation,
        path=Path.of_rows(stations.time_s[listed], stations.position_mm[listed], stations.run[listed], at_rest=True),
        hidden=hidden_of(parts if hidden_map else replace(parts, error_map=None), shift, places),
        correlation=reading.correlation,
        note=reading.note,
    )


def _means(stations: Stations, read: Booleans, gap: Array, places: Array) -> Array:
    """Mean of the readings at each position; both directions have the same weight, as in published reports."""
    return np.array([gap[read & (stations.position_mm == p)].mean() for p in places])


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw a number whose logarithm is uniformly distributed."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def bidirectional(
    targets_mm: Array, cycles: int, overshoot_mm: float, dwell_s: float, move_s: float, *, listed: bool
) -> Stations:
    """Cycles of ISO 230-2 over the targets with overshoots at the ends, which are rows without a gap or not in the
    table.
    """
    low, high = float(targets_mm[0]) - overshoot_mm, float(targets_mm[-1]) + overshoot_mm
    position, read = [], []
    for _ in range(cycles):
        for end, way in ((low, targets_mm), (high, targets_mm[::-1])):
            position += [end, *way.tolist()]
            read += [False] + [True] * way.size
    steps = [move_s if not r else dwell_s for r in read]
    # The distance from an overshoot back to the first target is short; all other readings follow a dwell.
    time = np.concatenate([[0.0], np.cumsum([move_s if not read[i] else steps[i + 1] for i in range(len(read) - 1)])])
    seen = np.array(read)
    run = np.zeros(len(position), dtype=np.int64)
    return Stations(np.array(position), time, run, seen, seen | listed)
