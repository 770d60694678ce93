"""Speeds that a record can show to be the highest speed of a stage."""

import numpy as np
import pytest

from fingervision.domain.effect import History
from fingervision.effects.slew_limit import narrow

RATE_HZ = 50.0


def searched(input_mm: np.ndarray) -> tuple[float, float]:
    """Lowest and highest speed limit that is searched (mm/s)."""
    time_s = np.arange(input_mm.size) / RATE_HZ
    found = narrow(History(input_mm, time_s, (slice(0, input_mm.size),), 1.0, 5.0))
    assert not isinstance(found, str)
    return found[0].lower, found[0].upper


def test_under_step_commands_alone_any_slower_speed_is_possible() -> None:
    lowest, highest = searched(np.repeat([0.0, 4.0, 0.0, 4.0], 100))
    assert highest == pytest.approx(4.0 * RATE_HZ)
    assert lowest < 0.05 * highest, "a jump is no motion that the stage has been seen to make"


def test_beside_ramps_the_stage_went_as_fast_as_they_do() -> None:
    ramp = np.linspace(0.0, 4.0, 101)
    lowest, highest = searched(np.concatenate([np.zeros(50), ramp, np.full(50, 4.0), np.zeros(50)]))
    # The slowest twentieth of the stretches include rest at an end of the ramp.
    assert 0.2 * 0.04 * RATE_HZ < lowest <= 0.04 * RATE_HZ
    assert highest == pytest.approx(4.0 * RATE_HZ)


def test_a_stage_that_crosses_the_range_within_the_record_is_slow_enough_at_any_sample_rate() -> None:
    lowest, _ = searched(np.repeat([0.0, 4.0, 0.0, 4.0], 250))
    assert lowest <= 4.0 / (999 / RATE_HZ)
