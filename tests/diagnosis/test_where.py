"""Regions of disagreement: noise alone gives none, and a disagreement is reported once, with its channel and range."""

import numpy as np
import pytest

from fingervision.diagnosis.compare import compare
from fingervision.diagnosis.noise.noise_model import Noise
from fingervision.diagnosis.report.residual_localization import where
from fingervision.domain.effect import Array, History
from fingervision.domain.measured_table import MeasuredTable
from fingervision.models.corrected import CorrectedModel
from fingervision.models.table import TableModel

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


def test_structure_that_other_passes_repeat_is_no_noise() -> None:
    """Strokes with a play, with a ripple over the input, or with nothing: the stated noise is that of the readings."""
    rng, at = np.random.default_rng(5), np.arange(2000)
    u = np.abs((at / 100.0) % 2.0 - 1.0) - 0.5
    lag = 0.15 * np.sign(np.gradient(u))
    line = np.array([-1.0, 1.0])
    model = CorrectedModel(
        "line", TableModel("line", line, -2.0 - 3.0 * line, 2.0 + 3.0 * line), "line.csv", (-1, 1), {}
    )
    for left in (0.0 * u, lag, 0.1 * np.sin(50.0 * u)):
        gap = 4.0 + 6.0 * u + left + NOISE_MM * rng.standard_normal(u.size)
        found = compare(MeasuredTable(u, gap, None, at / 20.0, (slice(0, u.size),), ("1",)), model)
        # The least of several bounds may be a few per cent below the noise, and a tenth above it.
        assert 0.9 * NOISE_MM < found.noise_mm < 1.2 * NOISE_MM
