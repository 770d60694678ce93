"""Pure error is the scatter of visits to the same position from the same direction."""

import numpy as np
import pytest

from fingervision.diagnosis.noise.channel_noises import most_noise
from fingervision.diagnosis.noise.replicates import pure_error, resolution, visits

SCATTER_MM = 0.003
TARGETS = np.arange(-20.0, 21.0, 5.0)
CYCLES = 40
"""Number of cycles, large enough to determine a standard deviation to 2 %."""
KNOWN = 0.06
"""Relative tolerance: three standard uncertainties of the standard deviation over all cycles."""


def cycles(overshoot_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Path of ISO 230-2 cycles and the numbers of its measured rows; without overshoots, each end is measured once per
    visit.
    """
    path, read = [], []
    for _ in range(CYCLES):
        for targets in (TARGETS, TARGETS[::-1]):
            beyond = targets[0] - np.sign(targets[1] - targets[0]) * overshoot_mm
            path += [beyond, *targets] if overshoot_mm else list(targets)
            read += [False] * bool(overshoot_mm) + [True] * targets.size
    return np.array(path), np.flatnonzero(read)


def estimated(values: np.ndarray, path: np.ndarray, rows: np.ndarray) -> tuple[float, float]:
    label = visits(path, (slice(0, path.size),), rows)
    found = pure_error(values, 28.0 * np.arange(rows.size), label, np.zeros(rows.size, dtype=bool))
    assert found is not None
    return found.sd_mm, found.trend_sigmas


def test_a_reversal_and_a_map_are_no_scatter() -> None:
    path, rows = cycles(0.5)
    rng = np.random.default_rng(5)
    way = np.sign(np.diff(path, prepend=path[0] - 1.0))[rows]
    values = 0.02 * way + 0.05 * np.sin(path[rows]) + SCATTER_MM * rng.standard_normal(rows.size)
    sd, trend = estimated(values, path, rows)
    assert sd == pytest.approx(SCATTER_MM, rel=KNOWN)
    assert abs(trend) < 4.0


@pytest.mark.parametrize("drift", [lambda t: 0.06 * (1.0 - np.exp(-t / 0.3)), lambda t: 0.05 * t])
def test_a_drift_from_cycle_to_cycle_is_told_and_taken_out(drift: object) -> None:
    path, rows = cycles(0.5)
    rng = np.random.default_rng(6)
    t = np.linspace(0.0, 1.0, rows.size)
    values = drift(t) + SCATTER_MM * rng.standard_normal(rows.size)  # type: ignore[operator]
    sd, trend = estimated(values, path, rows)
    assert trend > 10.0
    assert sd == pytest.approx(SCATTER_MM, rel=2 * KNOWN)


def test_a_wave_of_the_room_is_no_scatter() -> None:
    path, rows = cycles(0.5)
    t = np.arange(rows.size)
    values = 0.02 * np.sin(2.0 * np.pi * t / 31.0) + SCATTER_MM * np.random.default_rng(11).standard_normal(rows.size)
    sd, trend = estimated(values, path, rows)
    assert trend > 10.0
    assert sd == pytest.approx(SCATTER_MM, rel=2 * KNOWN)


@pytest.mark.parametrize("drifting", ["places", "sides"])
def test_places_or_sides_that_drift_apart_are_no_scatter(drifting: str) -> None:
    path, rows = cycles(0.5)
    rng = np.random.default_rng(8)
    t = np.linspace(0.0, 1.0, rows.size)
    side = np.sign(np.diff(path, prepend=path[0] - 1.0))[rows]
    apart = 0.03 * t * path[rows] / 20.0 if drifting == "places" else 0.04 * side * np.exp(-t / 0.3)
    label = visits(path, (slice(0, path.size),), rows)
    none = np.zeros(rows.size, dtype=bool)
    found = pure_error(apart + SCATTER_MM * rng.standard_normal(rows.size), 28.0 * t, label, none, path[rows])
    assert found is not None
    assert found.has_trend
    assert found.sd_mm == pytest.approx(SCATTER_MM, rel=2 * KNOWN)


def test_zeros_of_runs_are_no_scatter() -> None:
    path, rows = cycles(0.5)
    rng = np.random.default_rng(9)
    half = path.size // 2
    values = np.where(rows < half, 0.0, 0.012) + SCATTER_MM * rng.standard_normal(rows.size)
    runs = (slice(0, int(np.sum(rows < half))), slice(int(np.sum(rows < half)), rows.size))
    label = visits(path, (slice(0, half), slice(half, path.size)), rows)
    found = pure_error(values, 1.0 * np.arange(rows.size), label, np.zeros(rows.size, dtype=bool), path[rows], runs)
    assert found is not None
    assert found.sd_mm == pytest.approx(SCATTER_MM, rel=KNOWN)


def test_the_overshoot_tells_from_which_side_an_end_was_approached() -> None:
    path, rows = cycles(0.5)
    label = visits(path, (slice(0, path.size),), rows)
    at_end = label[path[rows] == TARGETS[-1]]
    assert set(at_end[0::2]).isdisjoint(at_end[1::2])


def test_a_second_reading_of_one_visit_is_no_repeat() -> None:
    path = np.array([0.0, 1.0, 1.0, 2.0, 1.0, 0.0, 1.0])
    label = visits(path, (slice(0, path.size),), np.arange(path.size))
    assert label[2] == -1
    assert label[1] == label[6] >= 0
    assert label[4] not in (label[1], -1)


def test_few_repeats_tell_nothing() -> None:
    path = np.array([0.0, 1.0, 0.0, 1.0, 0.0])
    label = visits(path, (slice(0, 5),), np.arange(5))
    assert pure_error(path, np.arange(5.0), label, np.zeros(5, dtype=bool)) is None


def test_the_digits_of_a_reading_are_found_and_noise_has_none() -> None:
    assert resolution(np.round(np.random.default_rng(1).normal(size=200), 3)) == pytest.approx(0.001)
    assert resolution(np.random.default_rng(1).normal(size=200)) == 0.0


def test_readings_at_evenly_spaced_targets_have_the_digits_of_their_file() -> None:
    # One visit each of thirty positions 1.545 mm apart: nearly multiples of 1.545 mm, but not to all digits of the
    # file.
    places = np.linspace(2.24, 47.04, 30)
    gaps = np.round(places + 1e-3 * np.random.default_rng(2).normal(size=places.size), 6)
    assert resolution(gaps) <= 1e-6
    assert resolution(np.arange(40.0) / 34.0) == pytest.approx(1.0 / 34.0), "pixels have digits without end"


def test_a_scatter_that_cannot_be_told_is_no_scatter_of_the_last_digit() -> None:
    # A rest contains no second visit of a position, and its readings have seven decimals.
    noise = np.round(1e-3 * np.random.default_rng(3).normal(size=300), 7)
    assert most_noise(noise, np.zeros(300), (slice(0, 300),), 3e-8) > 1e-3


def test_a_drift_that_few_visits_hide_shows_in_readings_that_follow_one_another() -> None:
    # Five cycles over ten positions: five readings at one position show little of a drift, a hundred successive
    # readings show much.
    label = np.tile(np.r_[np.arange(10), 19 - np.arange(10)], 5)
    row, told = np.arange(100), {"drift": 0, "wandering": 0}
    for seed in range(40):
        noise = np.random.default_rng(seed).normal(0.0, 1.0, 100)
        warmed = pure_error(noise + 3.0 * (1.0 - np.exp(-row / 40.0)), 30.0 * row, label, np.zeros(100, bool))
        slow = noise.copy()
        for k in range(1, 100):
            slow[k] = 0.6 * slow[k - 1] + 0.8 * slow[k]
        wandered = pure_error(slow, 30.0 * row, label, np.zeros(100, bool))
        assert warmed is not None
        assert wandered is not None
        told["drift"] += warmed.has_trend and warmed.correlation == 0.0
        told["wandering"] += wandered.correlation > 0.0
    assert told["drift"] >= 36
    assert told["wandering"] >= 36
