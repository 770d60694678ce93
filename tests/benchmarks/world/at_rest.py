"""Rigs that move, wait and are read: stages against a laser, slits, slow drifts."""

from dataclasses import dataclass, field, replace

import numpy as np

from tests.benchmarks.world import physics
from tests.benchmarks.world.error_map import ErrorMap
from tests.benchmarks.world.rig import Array, Booleans, Hidden, Integers, Path, Rig, Simulation


@dataclass(frozen=True, slots=True, eq=False)
class Stations:
    """Where the stage goes, one station after another, over all runs.

    Parameters
    ----------
    position_mm, time_s : ndarray, shape (m,)
        Set positions, and when they are read; the time may restart with a run.
    run : ndarray of int, shape (m,)
    read, listed : ndarray of bool, shape (m,)
        Whether a reading is taken there, and whether the station is in the table at all.
    """

    position_mm: Array
    time_s: Array
    run: Integers
    read: Booleans
    listed: Booleans


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """What is hidden in the stage.

    Parameters
    ----------
    play_mm, start : float
        Clearance, and where it stands before the first station (-1 where upward motion pushes).
    error_map : ErrorMap or None
    ratio : float
        The input's unit is off.
    offset_mm : float
        The gap's zero is off.
    drift_mm, drift_tau_s : float
        Warming from the first station on.
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
    """How the stage is read.

    Parameters
    ----------
    noise_mm, resolution_mm : float
        Standard deviation of a reading, and the last digit.
    gap_at_zero_mm : float
        Gap where the input is zero.
    simulation : str
        `line`: target is position; `map`: the mean of all readings at each place, as reports tabulate it.
    zeroed : bool
        The reference is set to zero at the first reading.
    correlation : float
        AR(1) from reading to reading.
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
    """Where the stage really stands at each station, in mm of input."""
    u = stations.position_mm * (1 + parts.ratio)
    if parts.error_map is not None:
        u = u + parts.error_map(u)
    return physics.play(u, parts.play_mm, parts.start)


def hidden_of(parts: Parts, shift_mm: float, places_mm: Array) -> tuple[Hidden, ...]:
    """The parts by their canonical names; `shift_mm` is how far the zero of the gap is off altogether."""
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
    """Gap at each station without the noise of reading."""
    gap = gap_at_zero_mm + parts.offset_mm + (placed(stations, parts) if place_mm is None else place_mm)
    if parts.drift_mm:
        gap = gap + physics.warming(stations.time_s, parts.drift_mm, parts.drift_tau_s)
    return gap


def read_at_rest(
    rng: np.random.Generator, stations: Stations, parts: Parts, reading: Reading, place_mm: Array | None = None
) -> Rig:
    """Read a stage at its stations; `place_mm` where it stands by other physics than that of `placed`."""
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
        # The readings' own noise is in the table of means, so what is left of it in the difference is less.
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
    """Mean of the readings at each place, each direction having the same weight as in a report."""
    return np.array([gap[read & (stations.position_mm == p)].mean() for p in places])


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Draw evenly in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def bidirectional(
    targets_mm: Array, cycles: int, overshoot_mm: float, dwell_s: float, move_s: float, *, listed: bool
) -> Stations:
    """ISO 230-2: up and down over the targets, an overshoot beyond each end, listed as rows without a gap or not."""
    low, high = float(targets_mm[0]) - overshoot_mm, float(targets_mm[-1]) + overshoot_mm
    position, read = [], []
    for _ in range(cycles):
        for end, way in ((low, targets_mm), (high, targets_mm[::-1])):
            position += [end, *way.tolist()]
            read += [False] + [True] * way.size
    steps = [move_s if not r else dwell_s for r in read]
    # The way from an overshoot back to the first target is short; every other reading comes after its dwell.
    time = np.concatenate([[0.0], np.cumsum([move_s if not read[i] else steps[i + 1] for i in range(len(read) - 1)])])
    seen = np.array(read)
    run = np.zeros(len(position), dtype=np.int64)
    return Stations(np.array(position), time, run, seen, seen | listed)
