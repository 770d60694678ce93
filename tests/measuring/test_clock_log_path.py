"""What the clock's fit takes from a log: encoder steps, reversals between two lines, and the frames' own noise."""

import numpy as np
import pytest

from fingervision.domain.drive import DriveHistory
from fingervision.measuring.clock.log_path import LogPath
from fingervision.measuring.clock.noise_of_motion import _even_variance
from fingervision.stage_record.encoder import input_sigma

STEP_MM = 0.002


def read_out(place_mm):
    """Round places to the lines of an encoder."""
    return np.round(place_mm / STEP_MM) * STEP_MM


@pytest.mark.parametrize("lines_a_row", [0.3, 0.6, 0.92, 0.97, 1.3])
def test_an_encoder_is_recognised_at_nearly_one_line_per_row(lines_a_row):
    rows = np.arange(1000)
    wave = np.abs((rows + 250) % 500 - 250)
    read = read_out(lines_a_row * STEP_MM * wave)
    sigma, step = input_sigma(read, (slice(0, read.size),), 0.01 * rows)
    assert step == pytest.approx(STEP_MM)
    assert sigma == pytest.approx(STEP_MM / np.sqrt(12.0), rel=0.5)


def test_set_points_in_equal_steps_with_a_repeated_row_are_no_encoder():
    read = np.repeat(np.arange(200) * 0.01, 1)
    read = np.insert(read, [50, 120], [read[50], read[120]])
    assert input_sigma(read, (slice(0, read.size),), 0.1 * np.arange(read.size))[1] == 0.0


def test_reversals_between_two_lines_are_not_cut():
    rng = np.random.default_rng(12)
    time_s = np.arange(0.0, 40.0, 0.008)
    corners = np.arange(0.0, 42.0, 2.0)
    tops = np.where(np.arange(corners.size) % 2, 0.5 + 0.2 * rng.random(corners.size), 0.1 * rng.random(corners.size))
    place = np.interp(time_s, corners, tops)
    step = 0.007
    path = LogPath.of(DriveHistory(time_s, np.round(place / step) * step))
    assert path.step_mm == pytest.approx(step)
    drawn = np.interp(corners[1:-1], path.drive.time_s, path.drive.input_mm)
    outward = (drawn - tops[1:-1]) * np.where(tops[1:-1] > 0.3, 1.0, -1.0)
    # By the smoothing alone all are cut, by half a step on average.
    assert abs(outward.mean()) < 0.12 * step
    assert np.abs(outward).max() < 0.6 * step


def test_a_stage_that_rounds_its_reversals_is_not_made_to_turn_at_once():
    time_s = np.arange(0.0, 30.0, 0.008)
    place = 0.3 - 0.3 * np.cos(2.0 * np.pi * time_s / 6.0)
    step = 0.003
    path = LogPath.of(DriveHistory(time_s, np.round(place / step) * step))
    assert path.drive.input_mm.max() < 0.6 + 0.6 * step


@pytest.mark.parametrize("wrong", [0.0, 0.02])
@pytest.mark.parametrize("uncertain", [0.0, 0.5])
def test_the_frames_own_variance_is_found_beside_uncertain_and_wrong_ones(wrong, uncertain):
    rng = np.random.default_rng(3)
    input_mm2 = np.where(rng.random(2000) < uncertain, 9.0, 0.0)
    residual = rng.normal(size=2000) * np.sqrt(1.0 + input_mm2)
    residual[rng.random(2000) < wrong] += 40.0
    assert _even_variance(residual**2, input_mm2) == pytest.approx(1.0, rel=0.25)
