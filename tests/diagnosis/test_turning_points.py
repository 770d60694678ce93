"""Turning points between two rows: found where the stage turned, and decisive for small plays."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import diagnose
from fingervision.stage_record.corners import Corner, corners
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model

PERIOD_S, EVERY_S = 8.0, 0.04


def reversals(u: np.ndarray, t: np.ndarray, sigma_mm: float) -> list[Corner]:
    """Corners at which the stage turned."""
    return [c for c in corners(u, t, (slice(0, t.size),), sigma_mm) if c.least_mm is not None]


def triangle(t: np.ndarray) -> np.ndarray:
    """Strokes of 2 mm at a constant speed, with sharp corners."""
    return 2.0 * np.abs((t / PERIOD_S) % 1.0 * 2.0 - 1.0)


def cosine(t: np.ndarray) -> np.ndarray:
    """Strokes of 2 mm without corners."""
    return 1.0 + np.cos(2.0 * np.pi * t / PERIOD_S)


@pytest.mark.parametrize("motion", [triangle, cosine])
@pytest.mark.parametrize("phase_s", [0.004, 0.013, 0.019, 0.031])
def test_turning_points_lie_where_the_stage_turned(motion: Callable[[np.ndarray], np.ndarray], phase_s: float) -> None:
    t = np.arange(0.0, 30.0, EVERY_S) + phase_s
    u = motion(t)
    points = reversals(u, t, 0.0)
    ends = np.array([2.0 * round(point.input_mm / 2.0) for point in points])
    assert len(points) == 7
    np.testing.assert_allclose([point.input_mm for point in points], ends, atol=5e-4)
    np.testing.assert_allclose([point.time_s for point in points], 4.0 * np.arange(1, 8), atol=0.002)


def test_no_turning_point_at_a_hold_a_noisy_end_or_a_long_pause() -> None:
    t = np.arange(0.0, 30.0, EVERY_S)
    held = np.clip(triangle(t), 0.1, 1.9)
    assert not reversals(held, t, 0.0)
    rng = np.random.default_rng(3)
    noisy = cosine(t + 0.013) + 0.002 * rng.standard_normal(t.size)
    assert len(reversals(noisy, t, 0.002)) <= 1
    turn = np.abs(t % PERIOD_S - 4.0) < 0.3
    paused = t[~turn & (np.abs(t % PERIOD_S - 8.0) > 0.3) & (t % PERIOD_S > 0.3)]
    assert not reversals(triangle(paused), paused, 0.0)


def test_two_equal_rows_at_an_end_are_a_stop() -> None:
    strokes = np.concatenate([np.linspace(0.0, 1.0, 80), np.linspace(1.0, 0.0, 80), np.linspace(0.0, 1.0, 80)])
    assert not reversals(strokes, EVERY_S * np.arange(strokes.size), 0.0)


def test_a_play_as_small_as_the_motion_between_two_rows_is_no_delay(tmp_path: Path) -> None:
    fine_s = np.arange(0.0, 40.0, 0.001)
    input_mm, place_mm = triangle(fine_s), np.empty(fine_s.size)
    state, play_mm = input_mm[0], 0.018
    for k, u in enumerate(input_mm):
        state = min(max(state, u - play_mm / 2), u + play_mm / 2)
        place_mm[k] = state
    rows = np.arange(13, fine_s.size, 40)
    gap_mm = 3.0 + 0.8 * place_mm[rows] + 0.002 * np.random.default_rng(8).standard_normal(rows.size)
    lines = [f"{fine_s[i]:.3f},{input_mm[i]:.5f},{gap:.5f}" for i, gap in zip(rows, gap_mm, strict=True)]
    (tmp_path / "measured.csv").write_text("\n".join(["time_s,input_mm,gap_mm", *lines]))
    (tmp_path / "sim.csv").write_text("input_mm,gap_mm\n-0.5,2.6\n3,5.4\n")
    report = diagnose(read_measured_table(tmp_path / "measured.csv"), read_model(tmp_path / "sim.csv")).report
    assert [effect.name for effect in report.effects] == ["backlash"]
    play = report.effects[0].parameters["play_mm"]
    assert play.value == pytest.approx(play_mm, abs=3.0 * (play.u or 0.0))
