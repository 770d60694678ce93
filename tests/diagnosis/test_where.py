"""Regions of disagreement: noise alone gives none, and a disagreement is reported once, with its channel and range."""

import numpy as np
import pytest

from fingervision.diagnosis.compare import rough
from fingervision.diagnosis.noise.noise_model import Noise
from fingervision.diagnosis.report.residual_localization import where
from fingervision.domain.effect import Array, History

NOISE_MM = 0.001
NULLS, FALSE_ALARMS = 200, 6
"""The threshold is the 99 % quantile of the maximum: 200 tests give two false alarms on average, and more than six with
a probability of 0.5 %."""


def swept(runs: int = 2) -> History:
    """History with one triangle of the input in each run."""
    time_s = np.arange(400) / 25.0
    input_mm = np.tile(np.interp(time_s % 8.0, [0.0, 4.0, 8.0], [-0.4, 1.4, -0.4]), runs)
    clock_s = np.concatenate([time_s + 20.0 * k for k in range(runs)])
    return History(input_mm, clock_s, tuple(slice(400 * k, 400 * k + 400) for k in range(runs)), 4.0, 11.0)


def channels(gap: Array, midline: Array) -> dict[str, Array]:
    return {"gap": gap, "left": midline - 0.5 * gap, "right": midline + 0.5 * gap, "midline": midline}


def edges(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    left, right = NOISE_MM * rng.standard_normal((2, n))
    return right - left, 0.5 * (left + right)


NOISES = {"gap": Noise(np.sqrt(2.0) * NOISE_MM, 0.0, 0.0), "midline": Noise(np.sqrt(0.5) * NOISE_MM, 0.0, 0.0)}


def test_noise_alone_names_no_place() -> None:
    history, rng = swept(), np.random.default_rng(20261121)
    n = history.input_mm.size
    found = [where(channels(*edges(rng, n)), NOISES, history, np.zeros(n, dtype=bool), rng) for _ in range(NULLS)]
    assert sum(map(bool, found)) <= FALSE_ALARMS


def test_a_shift_of_the_gap_is_named_once() -> None:
    history, rng = swept(), np.random.default_rng(3)
    gap, midline = edges(rng, history.input_mm.size)
    low = history.input_mm < 0.0
    (place,) = where(channels(gap + 0.02 * low, midline), NOISES, history, np.zeros(low.size, dtype=bool), rng)
    assert (place.channel, place.variable) == ("gap", "input")
    assert place.size == pytest.approx(0.02, abs=0.002)
    assert place.end == pytest.approx(0.0, abs=0.01)
    assert "smaller" not in place.words
    assert place.words.endswith("in all runs")


def test_what_one_finger_does_is_said_of_that_finger() -> None:
    history, rng = swept(1), np.random.default_rng(4)
    gap, midline = edges(rng, history.input_mm.size)
    shift = 0.01
    (place,) = where(channels(gap + shift, midline + 0.5 * shift), NOISES, history, np.zeros(gap.size, dtype=bool), rng)
    assert place.channel == "right"
    assert place.size == pytest.approx(shift, abs=0.0003)
    assert "farther right than simulated" in place.words
    assert "run" not in place.words


def test_a_step_at_the_reversal_is_no_noise() -> None:
    history, rng = swept(), np.random.default_rng(5)
    noise = NOISE_MM * rng.standard_normal(history.input_mm.size)
    step = 0.1 * np.sign(np.gradient(history.input_mm))
    left_over = np.std(rough(noise + step, history))
    # A line fitted between reversals removes up to 8 % of the variance of the noise; the step is 100 times the noise.
    assert 0.9 * NOISE_MM < left_over < 1.1 * NOISE_MM
