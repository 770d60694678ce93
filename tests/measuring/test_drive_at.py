"""The drive at a frame's time: interpolated, never extrapolated, never across two runs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.domain.drive import DriveHistory
from fingervision.measuring.drive_at import drive_at

# Rounding of a weighted mean of two doubles.
ROUNDING = 1e-9

LINE = DriveHistory(np.array([1.0, 2.0, 4.0]), np.array([0.0, 3.0, 9.0]))
TWO_RUNS = DriveHistory(
    np.array([0.0, 1.0, 3.0, 4.0]), np.array([0.0, 1.0, 5.0, 6.0]), ("a", "a", "b", "b"), np.array([1.0, 2.0, 3.0, 4.0])
)


@given(st.floats(1.0, 4.0))
def test_a_straight_drive_is_followed_exactly(time_s: float) -> None:
    state = drive_at(LINE, time_s)
    assert state is not None
    assert state.input_mm == pytest.approx(3.0 * (time_s - 1.0), abs=ROUNDING)
    assert state.run == ""
    assert state.force_n is None


@given(st.one_of(st.floats(max_value=1.0, exclude_max=True), st.floats(min_value=4.0, exclude_min=True)))
def test_nothing_is_extrapolated(time_s: float) -> None:
    assert drive_at(LINE, time_s) is None


def test_a_frame_belongs_to_the_run_that_brackets_it() -> None:
    inside = drive_at(TWO_RUNS, 3.5)
    assert inside is not None
    assert (inside.run, inside.input_mm, inside.force_n) == ("b", 5.5, 3.5)
    assert drive_at(TWO_RUNS, 2.0) is None
    last = drive_at(TWO_RUNS, 1.0)
    first = drive_at(TWO_RUNS, 3.0)
    assert last is not None
    assert first is not None
    assert (last.run, first.run) == ("a", "b")
