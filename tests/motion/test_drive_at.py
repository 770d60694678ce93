"""Input of the drive at a frame's time: interpolated, but neither extrapolated nor interpolated between two runs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.domain.drive import DriveHistory
from fingervision.motion.drive_at import drive_at, within_jump

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


def test_a_jump_between_two_rests_has_no_input_inside() -> None:
    times = np.arange(12.0)
    log = DriveHistory(times, np.where(times < 6.0, 0.2, 0.9))
    assert drive_at(log, 5.5) is None
    assert [drive_at(log, at).input_mm for at in (5.0, 6.0, 4.5)] == [0.2, 0.9, 0.2]  # type: ignore[union-attr]
    assert within_jump(log, np.array([4.5, 5.0, 5.5, 6.0, 20.0])).tolist() == [False, False, True, False, False]


def test_a_ramp_between_corners_and_an_encoder_step_are_no_jumps() -> None:
    corners = DriveHistory(np.array([0.0, 1.0, 4.0, 5.0, 8.0, 9.0]), np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0]))
    assert drive_at(corners, 2.5).input_mm == pytest.approx(0.5)  # type: ignore[union-attr]
    slow = np.round(np.arange(0.0, 40.0, 0.2) * 0.05 / 0.03) * 0.03
    encoder = DriveHistory(np.arange(slow.size) * 0.2, slow)
    assert all(drive_at(encoder, at) is not None for at in encoder.time_s[:-1] + 0.1)


def test_a_motion_that_bends_between_the_rows_is_followed_by_a_curve() -> None:
    def motion(time_s: np.ndarray) -> np.ndarray:
        return np.asarray(0.2 * np.sin(2.0 * np.pi * 5.0 * time_s))

    rng, noise_mm = np.random.default_rng(4), 5e-5
    rows_s = np.arange(0.0, 2.0, 5e-3)
    log = DriveHistory(rows_s, motion(rows_s) + rng.normal(0.0, noise_mm, rows_s.size))
    frames_s = rng.uniform(0.1, 1.9, 300)
    found = np.array([drive_at(log, at).input_mm for at in frames_s])  # type: ignore[union-attr]
    # The rows' noise, and chords where the noise hides the bend; all chords are inside the bends by up to 6e-4 mm.
    assert float(np.std(found - motion(frames_s))) < 1.5 * noise_mm
    assert float(np.max(np.abs(np.interp(frames_s, rows_s, motion(rows_s)) - motion(frames_s)))) > 10.0 * noise_mm


@pytest.mark.parametrize(
    "input_mm",
    [
        np.interp(np.arange(40.0), [0.0, 3.0, 8.0, 9.0, 20.0, 39.0], [0.0, 0.0, 1.0, 1.0, -0.3, 0.8]),
        np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0]),
        np.round(np.arange(40.0) * 0.013 / 0.05) * 0.05,
    ],
    ids=["strokes", "only corners", "encoder"],
)
def test_strokes_corners_and_steps_of_an_encoder_stay_linear(input_mm: np.ndarray) -> None:
    log = DriveHistory(np.arange(float(input_mm.size)), input_mm)
    for at in np.arange(0.3, input_mm.size - 1.0, 0.7):
        state = drive_at(log, float(at))
        if state is not None:
            assert state.input_mm == pytest.approx(float(np.interp(at, log.time_s, input_mm)), abs=1e-12)


def test_a_stage_that_turns_between_two_rows_is_followed_to_its_turning_point() -> None:
    def strokes(time_s: np.ndarray) -> np.ndarray:
        return 0.3 * np.abs((time_s / 1.0069) % 2.0 - 1.0)

    rows_s = np.arange(0.0, 6.0, 0.02)
    exact, noisy = strokes(rows_s), strokes(rows_s) + np.random.default_rng(3).normal(0.0, 1e-4, rows_s.size)
    turns_s = 1.0069 * np.arange(1.0, 5.0)
    for input_mm, within_mm in ((exact, 1e-9), (noisy, 5e-4)):
        log = DriveHistory(rows_s, input_mm)
        followed = [drive_at(log, at).input_mm for at in turns_s]  # type: ignore[union-attr]
        assert followed == pytest.approx(strokes(turns_s), abs=within_mm)
    # The chord between the rows misses the turning point by more.
    assert np.max(np.abs(np.interp(turns_s, rows_s, exact) - strokes(turns_s))) > 2e-3
