"""Missing frames are counted, but frames that a network delays are not."""

import numpy as np
import pytest

from fingervision.live.cadence import Cadence

PERIOD_S = 0.04


def watched(times_s: np.ndarray) -> Cadence:
    cadence = Cadence()
    for time_s in times_s:
        cadence.add(float(time_s))
    return cadence


@pytest.mark.parametrize("lost", [[], [50], [50, 51, 52], [30, 60, 61, 150]])
def test_missing_frames_are_counted(lost: list[int]) -> None:
    times = np.delete(np.arange(200) * PERIOD_S, lost)
    assert watched(times).missing == len(lost)


@pytest.mark.parametrize("seed", range(5))
def test_jitter_alone_is_no_drop(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.arange(2000) * PERIOD_S + rng.uniform(0.0, 0.5 * PERIOD_S, 2000)
    assert watched(times).missing == 0


@pytest.mark.parametrize("held_up", [2, 3, 6, 11, 40])
def test_a_burst_after_a_hold_up_is_no_drop(held_up: int) -> None:
    times = np.arange(200) * PERIOD_S
    times[100 : 100 + held_up] = times[100 + held_up] - 0.001 * np.arange(held_up, 0, -1)
    assert watched(times).missing == 0


def test_rate_and_jitter_are_those_of_the_times() -> None:
    rng = np.random.default_rng(1)
    cadence = watched(np.arange(100) * PERIOD_S + rng.normal(0.0, 0.001, 100))
    assert cadence.rate_hz == pytest.approx(25.0, rel=0.01)
    assert cadence.jitter_s == pytest.approx(0.001 * np.sqrt(2.0), rel=0.25)
    assert cadence.period_s == pytest.approx(PERIOD_S, rel=0.01)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("lost", [[], [700], [300, 301, 1500]])
def test_lateness_that_is_mostly_small_and_sometimes_large_is_no_drop(seed: int, lost: list[int]) -> None:
    # A busy machine: as many frames as came are a little later than the one before as are earlier, a few much later.
    rng = np.random.default_rng(seed)
    late_s = rng.exponential(0.2 * PERIOD_S, 2000)
    times = np.maximum.accumulate(np.arange(2000) * PERIOD_S + late_s)
    assert watched(np.delete(times, lost)).missing == len(lost)


def test_a_period_that_is_not_quite_right_adds_up_to_nothing() -> None:
    drift = np.cumsum(0.004 * PERIOD_S * np.sin(np.arange(5000) / 400.0))
    assert watched(np.arange(5000) * PERIOD_S + drift).missing == 0
