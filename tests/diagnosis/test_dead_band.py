"""A servo that stops within a band around its command is described, because no effect of the catalogue fits."""

import re

import numpy as np
import pytest
from numpy.typing import NDArray

from fingervision.diagnosis.report.diagnosis_report import band_words
from fingervision.domain.effect import History

Array = NDArray[np.float64]
BAND_MM, RATE_HZ, HOLD, STEPS = 0.03, 20.0, 30, 24
NOISE_MM, SLOPE = 0.002, 2.0


def servo(command: Array, kind: str) -> Array:
    """Position of a servo with a gain of 8 / s and at most 6 mm/s, integrated with twenty steps per sample."""
    fine, place, moves, out = 20, command[0], False, []
    for target in command:
        for _ in range(fine):
            error = target - place
            moves = abs(error) > (BAND_MM if not moves or kind == "stops" else 1e-3)
            speed = 8.0 * error if moves or kind == "exact" else 0.0
            place += np.clip(speed, -6.0, 6.0) / RATE_HZ / fine
        out.append(place)
    return np.array(out)


def said(kind: str, *, small: bool, seed: int = 3) -> str | None:
    rng = np.random.default_rng(seed)
    heights = rng.uniform(0.005, 0.12, STEPS) if small else rng.uniform(0.1, 1.5, STEPS)
    level = np.cumsum(heights * rng.choice([-1.0, 1.0], STEPS))
    command = np.repeat(level, HOLD)
    gap = SLOPE * command + 1.0
    measured = SLOPE * servo(command, kind) + 1.3 + NOISE_MM * rng.standard_normal(command.size)
    history = History(command, np.arange(command.size) / RATE_HZ, (slice(0, command.size),), 1.0, 1.0, commanded=True)
    return band_words(history, gap, measured - gap)


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_servo_that_stops_at_the_edge_of_its_band_rests_short_of_its_commands(seed: int) -> None:
    words = said("stops", small=False, seed=seed)
    assert words is not None
    assert "short of the command" in words
    band = float(re.findall(r"by ([0-9.]+) mm \(median\)", words)[0])
    assert band == pytest.approx(BAND_MM, rel=0.2)


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_servo_that_wakes_beyond_its_band_leaves_small_steps_unanswered(seed: int) -> None:
    words = said("wakes", small=True, seed=seed)
    assert words is not None
    assert "had no response" in words
    largest = float(re.findall(r"up to ([0-9.]+) mm", words)[0])
    assert largest < BAND_MM


@pytest.mark.parametrize("small", [True, False])
def test_a_servo_without_a_band_is_not_said_to_have_one(*, small: bool) -> None:
    assert all(said("exact", small=small, seed=seed) is None for seed in range(4))
