"""Halts of a stage in the record of an encoder."""

import numpy as np
import pytest

from fingervision.motion.log_path import level_halts

STEP_MM = 0.03


@pytest.mark.parametrize("is_turned", [False, True])
def test_a_halt_that_the_first_or_last_row_alone_ends_stays_within_half_a_step(is_turned: bool) -> None:
    at_mm = np.concatenate([np.linspace(0.0, 0.3, 20), np.full(39, 0.3), [0.33]])
    reading_mm = np.round(at_mm / STEP_MM) * STEP_MM
    reading_mm = reading_mm[::-1] if is_turned else reading_mm
    time_s = 0.02 * np.arange(reading_mm.size)
    found_mm = level_halts(time_s, reading_mm, reading_mm.copy(), STEP_MM)
    assert np.all(np.abs(found_mm - reading_mm) <= 0.5 * STEP_MM + 1e-9)
