"""The number of independent values in a correlated residual, against the closed formula for a first-order process."""

import numpy as np
import pytest
from scipy.signal import lfilter

from fingervision.diagnosis.noise.independent_values import independent_values


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9])
def test_a_first_order_process_holds_its_closed_form(memory: float) -> None:
    rows, draws = 4000, 20
    rng = np.random.default_rng(7)
    noises = lfilter([1.0], [1.0, -memory], rng.normal(size=(draws, rows)), axis=1)
    runs = (slice(0, rows // 2), slice(rows // 2, rows))
    found = np.mean([independent_values(noise, runs) for noise in noises])
    # The sum of memory^|k| over all k is (1 + memory) / (1 - memory); summation up to the first zero changes it by some
    # percent.
    assert found == pytest.approx(rows * (1.0 - memory) / (1.0 + memory), rel=0.15)


def test_offsets_of_runs_do_not_count_as_correlation() -> None:
    noise = np.random.default_rng(8).normal(size=400)
    runs = (slice(0, 200), slice(200, 400))
    moved = noise + np.repeat([0.0, 50.0], 200)
    assert independent_values(moved, runs) == pytest.approx(independent_values(noise, runs))
