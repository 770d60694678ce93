"""Path of the stage for the clock fit: encoder steps, reversals between two encoder lines, and noise of the frames."""

import numpy as np
import pytest

from fingervision.domain.drive import DriveHistory
from fingervision.motion.clock.noise import even_variance
from fingervision.motion.encoder import input_sigma, on_lines
from fingervision.motion.log_path import LogPath, drawn_paths
from tests.benchmarks import drawn_recordings

STEP_MM = 0.002


def read_out(place_mm):
    """Round positions to the lines of an encoder."""
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


@pytest.mark.parametrize(("row_s", "step"), [(0.008, 0.007), (0.03, 0.0091)], ids=["many rows", "a row each line"])
def test_reversals_between_two_lines_are_not_cut(row_s, step):
    rng = np.random.default_rng(12)
    time_s = np.arange(0.0, 40.0, row_s)
    corners = np.arange(0.0, 42.0, 2.0)
    tops = np.where(np.arange(corners.size) % 2, 0.5 + 0.2 * rng.random(corners.size), 0.1 * rng.random(corners.size))
    place = np.interp(time_s, corners, tops)
    path = LogPath.of(DriveHistory(time_s, np.round(place / step) * step))
    assert path.record.step_mm == pytest.approx(step)
    # At the row next to each reversal; between two rows the curve cuts it besides.
    at = [int(np.argmin(np.abs(time_s - corner_s))) for corner_s in corners[1:-1]]
    drawn = np.interp(time_s[at], path.drive.time_s, path.drive.input_mm)
    outward = (drawn - place[at]) * np.where(tops[1:-1] > 0.3, 1.0, -1.0)
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
    assert even_variance(residual**2, input_mm2) == pytest.approx(1.0, rel=0.25)


def test_a_rounded_turn_between_two_rows_is_drawn_finely_enough_for_the_play():
    corner_s, speed = 0.25 * 0.06, 1.5
    time_s = np.arange(0.0, 12.0, 0.06)
    corners = np.arange(-0.99, 14.0, 2.04)  # half-way between two rows
    tops = np.where(np.arange(corners.size) % 2, speed, 0.0)
    path = LogPath.of(DriveHistory(time_s, np.interp(time_s, corners, tops)))
    turned = path.rounded(corner_s)
    slope = np.diff(tops)[0] / np.diff(corners)[0]
    for at_s, top in zip(corners[1:-2], tops[1:-2], strict=True):
        near = np.linspace(-0.7, 0.7, 57) * corner_s
        # Two tangents and a parabola: the turn is cut by an eighth of the duration times the change of speed.
        true = slope * np.where(np.abs(near) < 0.5 * corner_s, near**2 / corner_s + 0.25 * corner_s, np.abs(near))
        found = np.interp(at_s + near, turned.drive.time_s, turned.drive.input_mm)
        assert np.max(np.abs(np.abs(found - top) - true)) < 0.05 * 0.25 * slope * corner_s


def test_a_record_that_ends_within_an_encoders_line_is_read():
    one = drawn_recordings.draw(232003, creep=0.02)
    assert LogPath.of(DriveHistory(one.log_s, one.input_mm)).record.step_mm > 0.0


def test_a_halt_between_two_lines_is_at_its_reading():
    """Smoothing alone would continue the motion during a halt by up to half a step, which would falsify play and
    offset.
    """
    rng = np.random.default_rng(31)
    corners_s, corners_mm, now_s, at_mm = [0.0, 1.0], [0.05, 0.05], 1.0, 0.05
    for target_mm in rng.uniform(0.0, 0.6, 12):
        now_s += abs(target_mm - at_mm) / 0.16
        corners_s += [now_s, now_s + 0.6]
        corners_mm += [target_mm, target_mm]
        now_s, at_mm = now_s + 0.6, target_mm
    time_s = np.arange(0.0, now_s, 0.0146)
    step = 0.0126
    path = LogPath.of(DriveHistory(time_s, np.round(np.interp(time_s, corners_s, corners_mm) / step) * step))
    assert path.record.step_mm == pytest.approx(step)
    halts_s = np.array(corners_s[2::2]) + 0.3
    found = np.interp(halts_s, path.drive.time_s, path.drive.input_mm)
    np.testing.assert_allclose(found, np.round(np.array(corners_mm[2::2]) / step) * step, atol=1e-9)


def test_halts_at_equal_distances_are_not_taken_for_the_lines_of_an_encoder():
    """Without this rule, readings on the encoder's lines would be moved by up to 6 um, for any step of a staircase
    motion.
    """
    read = drawn_recordings.draw(99001093).input_mm
    np.testing.assert_array_equal(on_lines(read, (slice(0, read.size),)), read)


def test_a_corner_on_a_row_does_not_lie_between_rows_however_the_times_are_rounded():
    time_s = np.round(np.arange(0.0, 6.0, 0.01), 2)
    path = LogPath.of(DriveHistory(time_s, np.round(np.interp(time_s, [0.6, 4.6, 6.0], [0.0, 1.5, 0.975]), 6)))
    assert path.parts.corner_s.size == 0
    assert path.drive.input_mm.max() == pytest.approx(1.5)


@pytest.mark.parametrize("lines_a_row", [0.13, 0.37, 0.9])
def test_drawn_errors_of_an_encoder_are_as_large_as_its_own(lines_a_row):
    # Drawn without the averaging over the rows of a stroke, they were two to four times as large.
    time_s, speed = 0.08 * np.arange(600), lines_a_row * 0.025 / 0.08
    place = 0.007 + speed * np.abs((time_s + 5.0) % 10.0 - 5.0)
    path = LogPath.of(DriveHistory(time_s, np.round(place / 0.025) * 0.025))

    def at_rows(drive):
        return np.interp(time_s, drive.time_s, drive.input_mm)

    own_mm = float(np.std(at_rows(path.drive) - place))
    drawn_mm = np.std([at_rows(one.drive) - at_rows(path.drive) for one in drawn_paths(path)])
    assert 0.7 * own_mm < drawn_mm < 2.2 * own_mm
