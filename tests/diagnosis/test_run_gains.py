"""Gains that differ from run to run: no ratio is claimed for their mean, and the interval of a ratio contains them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.report import DiagnosisReport, Verdict
from tests.diagnosis.tables import written

ROWS = 120
SLOPE = 4.0
NOISE_MM = 0.0018


def diagnosed(folder: Path, gains: Sequence[float], seed: int) -> DiagnosisReport:
    rng = np.random.default_rng(seed)
    time_s = 0.2 * np.arange(ROWS)
    input_mm = np.interp(time_s % 8.0, [0.0, 4.0, 8.0], [0.0, 2.0, 0.0])
    rows = []
    for run, gain in enumerate(gains):
        gap_mm = 2.0 + (1.0 + gain) * SLOPE * input_mm + NOISE_MM * rng.standard_normal(ROWS)
        columns = zip(100.0 * run + time_s, input_mm, gap_mm, strict=True)
        rows += [f"{run},{t:.2f},{u:.6f},{g:.6f}" for t, u, g in columns]
    return diagnose(*written(folder, "run,time_s,input_mm,gap_mm", rows, "-1,-2\n3,14")).report


@pytest.mark.parametrize("seed", [1, 2])
def test_two_runs_of_different_gain_show_no_ratio(tmp_path: Path, seed: int) -> None:
    # The mean of two gains that are 0.16 % apart is uncertain by 0.08 %; it was named, as 0.160 % with u = 0.003 %.
    report = diagnosed(tmp_path, (0.0024, 0.0008), seed)
    assert not report.effects
    assert report.verdict is Verdict.UNKNOWN
    assert "gains that differ from run to run" in str(report.unknown)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_ratio_that_all_runs_share_is_named_with_the_uncertainty_of_its_mean(tmp_path: Path, seed: int) -> None:
    gains = 0.01 + 0.002 * np.random.default_rng(seed).standard_normal(5)
    report = diagnosed(tmp_path, gains.tolist(), seed)
    (effect,) = report.effects
    ratio = effect.parameters["ratio"]
    expected = float(np.std(gains, ddof=1)) / 5.0**0.5
    assert 0.4 * expected < ratio.u < 2.5 * expected
    assert abs(ratio.value - 0.01) < 3.0 * ratio.u


def test_equal_gains_of_two_runs_are_a_ratio(tmp_path: Path) -> None:
    report = diagnosed(tmp_path, (0.003, 0.003), 3)
    assert any(names in report.alternatives for names in (("lever_ratio_error",), ("input_scale",)))
