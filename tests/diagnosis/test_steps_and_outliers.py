"""Samples of a stage that is still moving after each step of a command are not gross errors."""

from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import Diagnosis, diagnose
from fingervision.domain.report import Verdict
from tests.diagnosis.tables import written

LEVELS_MM = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.0, 1.0, 2.0)
UNEVEN_MM = (0.0, 1.0, 3.0, 3.5, 5.0, 2.0, 4.0, 1.5, 0.0, 2.5, 3.0, 1.0, 2.0)
HOLD, RATE_HZ, NOISE_MM = 44, 20.0, 0.002


def diagnosed(folder: Path, gap_of: np.ndarray, input_mm: np.ndarray) -> Diagnosis:
    rows = [f"{k / RATE_HZ:.4f},{x:.6f},{gap:.6f}" for k, (x, gap) in enumerate(zip(input_mm, gap_of, strict=True))]
    return diagnose(*written(folder, "time_s,input_mm,gap_mm", rows, "-1,0\n7,8"))


@pytest.mark.parametrize(
    ("levels_mm", "names"),
    [
        (LEVELS_MM, ("drive_lag",)),
        pytest.param(UNEVEN_MM, ("drive_lag", "slew_limit"), marks=pytest.mark.slow),
    ],
)
def test_two_late_samples_after_each_step_are_a_finding(
    tmp_path: Path, levels_mm: tuple[float, ...], names: tuple[str, ...]
) -> None:
    # Equal steps are all late by the same time, which a delay explains; of unequal steps, long ones take longer.
    command = np.repeat(levels_mm, HOLD)
    rng = np.random.default_rng(5)
    # The stage starts 70 ms late and moves at 18 mm/s, which two of 44 samples show.
    fine_s = np.arange(command.size * 50) / (50 * RATE_HZ)
    asked = command[np.clip(((fine_s - 0.07) * RATE_HZ).astype(int), 0, None)]
    place = np.empty_like(fine_s)
    place[0] = asked[0]
    for k in range(1, place.size):
        place[k] = place[k - 1] + np.clip(asked[k] - place[k - 1], -18.0 / (50 * RATE_HZ), 18.0 / (50 * RATE_HZ))
    found = diagnosed(tmp_path, 1.0 + place[::50] + rng.normal(0.0, NOISE_MM, command.size), command)
    assert found.report.verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    assert names in [tuple(sorted(each)) for each in found.report.alternatives]
    assert found.report.standing_share < 0.05


@pytest.mark.parametrize("share", [0.02, 0.15])
def test_gross_errors_at_any_time_are_set_aside_only_while_they_are_few(tmp_path: Path, share: float) -> None:
    rng = np.random.default_rng(6)
    time = np.arange(600) / RATE_HZ
    ramp = 2.5 - 2.5 * np.cos(2.0 * np.pi * time / 15.0)
    gap = 1.0 + ramp + rng.normal(0.0, NOISE_MM, time.size)
    wrong = rng.random(time.size) < share
    gap[wrong] += rng.uniform(0.3, 1.0, int(wrong.sum())) * rng.choice([-1.0, 1.0], int(wrong.sum()))
    verdict = diagnosed(tmp_path, gap, ramp).report.verdict
    assert verdict is (Verdict.AGREES if share < 0.1 else Verdict.UNKNOWN)


@pytest.mark.slow
def test_a_square_wave_shows_dead_time_and_highest_speed(tmp_path: Path) -> None:
    command = np.tile(np.repeat([0.0, 4.0], 40), 3)
    fine_s = np.arange(command.size * 50) / (50 * RATE_HZ)
    asked = command[np.clip(((fine_s - 0.12) * RATE_HZ).astype(int), 0, None)]
    place = np.zeros_like(fine_s)
    for k in range(1, place.size):
        place[k] = place[k - 1] + np.clip(asked[k] - place[k - 1], -6.0 / (50 * RATE_HZ), 6.0 / (50 * RATE_HZ))
    noise = np.random.default_rng(8).normal(0.0, NOISE_MM, command.size)
    report = diagnosed(tmp_path, 1.0 + place[::50] + noise, command).report
    assert report.verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    assert all("slew_limit" in names for names in report.alternatives)
    found = {key: value.value for effect in report.effects for key, value in effect.parameters.items()}
    assert found["speed_mm_s"] == pytest.approx(6.0, rel=0.03)
    assert found["delay_s"] == pytest.approx(0.12, abs=0.01)


@pytest.mark.slow
def test_the_size_of_jumps_is_found_between_the_sizes_that_signatures_try(tmp_path: Path) -> None:
    # Each jump occurs at a definite sample: the minimum of the score is 0.6 % wide, while the sizes tried by signatures
    # are 2.3 % apart.
    time = np.arange(500) / 10.0
    ramp = 1.5 - 1.5 * np.cos(2.0 * np.pi * time / 20.0)
    place, stands = np.empty_like(ramp), ramp[0]
    for k, x in enumerate(ramp):
        stands = x if abs(x - stands) > 0.06 else stands
        place[k] = stands
    noise = np.random.default_rng(9).normal(0.0, 0.003, ramp.size)
    rows = [f"{t:.4f},{x:.6f},{gap:.6f}" for t, x, gap in zip(time, ramp, 2.0 + place + noise, strict=True)]
    report = diagnose(*written(tmp_path, "time_s,input_mm,gap_mm", rows, "-1,1\n4,6")).report
    assert report.verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    assert report.effects[0].parameters["jump_mm"].value == pytest.approx(0.06, rel=0.01)
