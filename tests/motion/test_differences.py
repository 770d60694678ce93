"""Differences of a record with uneven sampling: they are zero for a straight motion, and have the size of the noise."""

import numpy as np
import pytest

from fingervision.motion.encoder import differences, input_sigma


@pytest.mark.parametrize("order", [2, 3, 4])
def test_a_polynomial_of_a_lower_degree_vanishes_and_even_rows_give_ordinary_differences(order):
    rng = np.random.default_rng(5)
    time_s = np.cumsum(rng.uniform(0.05, 0.25, 60))
    values = np.polyval(rng.normal(size=order), time_s - 3.0)
    assert np.max(np.abs(differences(values, time_s, order))) < 1e-9 * np.ptp(values)
    noise = rng.normal(size=30)
    assert np.allclose(differences(noise, 0.1 * np.arange(30), order), np.diff(noise, order))
    assert differences(values[:order], time_s[:order], order).size == 0


def test_the_noise_of_a_log_with_late_and_missing_rows_is_its_own():
    """Ordinary differences would include the delay of a row times the speed, ten times the noise in this test."""
    rng = np.random.default_rng(6)
    time_s = np.arange(600) * 0.02 + rng.uniform(-0.004, 0.004, 600)
    time_s = time_s[rng.random(600) > 0.05]
    input_mm = np.interp(time_s, [0.0, 4.0, 8.0, 12.0], [0.0, 2.0, 0.5, 2.0]) + rng.normal(0.0, 2e-4, time_s.size)
    sigma_mm, step_mm = input_sigma(input_mm, (slice(0, time_s.size),), time_s)
    assert step_mm == 0.0
    assert sigma_mm == pytest.approx(2e-4, rel=0.15)
