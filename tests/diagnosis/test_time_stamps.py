"""Times that a container rounds are part of the input's uncertainty: a fast motion then shows no effect of its own."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fingervision as fv
from fingervision.domain.measured_table import MeasuredTable
from fingervision.effects.play_operator import play
from fingervision.interface.column_tables import measured_from_columns
from fingervision.motion.time_stamps import frame_resolution_s, input_error_of_stamps
from fingervision.storage.measured_table import read_measured_table

RATE_HZ, MOTION_HZ, STROKE_MM, SLOPE = 120.0, 3.1, 0.3, 7.72
NOISE_MM, LOG_NOISE_MM, RESOLUTION_S, FILMED_S = 5e-4, 1e-5, 1e-3, 1.6
MODEL = {"input_mm": [-0.1, 0.6], "gap_mm": [1.0 - 0.1 * SLOPE, 1.0 + 0.6 * SLOPE]}


def filmed(play_mm: float, seed: int, log_noise_mm: float = LOG_NOISE_MM) -> MeasuredTable:
    """Frames of a fast motion, whose input is read from a log at times rounded to a millisecond."""
    rng = np.random.default_rng(seed)

    def driven(time_s: np.ndarray) -> np.ndarray:
        turns = MOTION_HZ * np.maximum(time_s - 0.4, 0.0)
        return np.asarray(0.5 * STROKE_MM * (1.0 - np.cos(2.0 * np.pi * turns)))

    time_s = np.arange(int(FILMED_S * RATE_HZ)) / RATE_HZ
    stamps_s = np.round(time_s, 3)
    fine_s = np.arange(0.0, FILMED_S, 2e-4)
    moved = np.interp(time_s, fine_s, play(driven(fine_s), play_mm, 0.0) if play_mm else driven(fine_s))
    return measured_from_columns(
        {
            "time_s": stamps_s.tolist(),
            "input_mm": (driven(stamps_s) + rng.normal(0.0, log_noise_mm, time_s.size)).tolist(),
            "gap_mm": (1.0 + SLOPE * moved + rng.normal(0.0, NOISE_MM, time_s.size)).tolist(),
            "u_random_mm": [NOISE_MM] * time_s.size,
        }
    )


def test_nothing_is_seen_where_only_times_are_rounded() -> None:
    table = filmed(0.0, seed=5)
    assert table.stamp_s == 0.0  # nothing says that its input was read from a log
    stamped = replace(table, stamp_s=frame_resolution_s(table.time_s))
    assert stamped.stamp_s == RESOLUTION_S
    found = fv.diagnose(stamped, MODEL)
    assert (found.verdict, found.effects) == ("agrees", ())
    # The same residual is no noise of the picture.
    assert fv.diagnose(table, MODEL).verdict != "agrees"


def test_a_noisy_log_takes_nothing_from_the_noise_that_the_picture_states() -> None:
    table = replace(filmed(0.0, seed=7, log_noise_mm=7e-5), stamp_s=RESOLUTION_S)
    assert fv.diagnose(table, MODEL).verdict == "agrees"


def test_a_play_beside_rounded_times_is_named_with_its_uncertainty() -> None:
    found = fv.diagnose(replace(filmed(0.02, seed=6), stamp_s=RESOLUTION_S), MODEL)
    assert [effect.name for effect in found.effects] == ["backlash"]
    width = found.effects[0].parameters["play_mm"]
    assert abs(width.value - 0.02) < 3.0 * width.u


def test_the_error_is_that_of_a_uniform_time() -> None:
    rng = np.random.default_rng(7)
    time_s = np.arange(4000) / 100.0 + rng.uniform(-4e-3, 4e-3, 4000)
    stamps_s = np.round(time_s, 3)
    true_mm, read_mm = (0.4 * np.sin(2.0 * np.pi * 3.0 * each) for each in (time_s, stamps_s))
    stated_mm = input_error_of_stamps(true_mm, time_s, (slice(0, 4000),), frame_resolution_s(stamps_s))
    # The standard deviation of 4000 uniform errors is known to 1 %, the speed from neighbouring rows to 1 %.
    assert np.sqrt(np.mean((read_mm - true_mm) ** 2) / np.mean(stated_mm**2)) == pytest.approx(1.0, rel=0.04)


@pytest.mark.parametrize(
    ("times_s", "resolution_s"),
    [
        (np.round(np.arange(60) / 120.0, 3), 1e-3),
        (np.round(np.arange(60) / 24.0 + np.random.default_rng(1).uniform(-4e-3, 4e-3, 60), 3), 1e-3),
        (np.round(np.arange(60) / 24.0, 2), 1e-2),
        (np.delete(np.arange(60) / 25.0, [7, 20]), 0.0),  # 40 ms are whole milliseconds
        (np.round(np.arange(60) / 24.0 * 90_000) / 90_000, 0.0),
        (np.round(np.arange(60) / 700.0, 3), 1e-3),
        (np.arange(60) / 1000.0, 0.0),
        (np.arange(2) / 25.0, 0.0),
    ],
)
def test_a_resolution_is_seen_where_times_were_rounded(times_s: np.ndarray, resolution_s: float) -> None:
    assert frame_resolution_s(times_s) == resolution_s


def test_only_a_table_that_measure_joined_with_a_log_has_stamps(tmp_path: Path) -> None:
    rows = [f"{k},{round(k / 120.0, 3)},ok,{1.0 + 0.077 * k},{0.01 * k}" for k in range(40)]
    for name in ("gaps.csv", "other.csv"):
        (tmp_path / name).write_text("frame,time_s,status,gap_mm,input_mm\n" + "\n".join(rows) + "\n")
    assert read_measured_table(tmp_path / "gaps.csv").stamp_s == 0.0
    (tmp_path / "summary.json").write_text(json.dumps({"settings": {"drive_offset": "given"}}))
    assert read_measured_table(tmp_path / "gaps.csv").stamp_s == RESOLUTION_S
    assert read_measured_table(tmp_path / "other.csv").stamp_s == 0.0
