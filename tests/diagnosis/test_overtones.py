"""Small harmonics of a screw error are reported as a part of the screw error."""

import re
from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.report import DiagnosisReport, Verdict
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model

SEED = 3
EDGE_MM, AMPLITUDE_MM, PERIOD_MM = 0.003, 0.012, 0.2
SHARE_PERCENT, PROBED = 2.0, 0.1
"""Tolerances: the share is linear in the residual, and the amplitude is fitted without it; probes have ten periods per
octave."""


def screwed(folder: Path, harmonic: float) -> DiagnosisReport:
    """Diagnose two runs to the end of the range and back, with a screw error whose second harmonic is a share of the
    first.
    """
    rng = np.random.default_rng(SEED)
    lines = []
    for run, speed in enumerate((0.05, 0.1)):
        count = int(1.6 / speed * 12)
        u = 0.4 - np.abs(np.linspace(-0.8, 0.8, count))
        angle = 2.0 * np.pi * u / PERIOD_MM
        driven = u + AMPLITUDE_MM * (np.sin(angle + 0.4) + harmonic * np.sin(2.0 * angle + 1.9))
        left, right = (side * (2.0 + 3.5 * driven) + EDGE_MM * rng.standard_normal(count) for side in (-1, 1))
        lines += [f"{run},{k / 12},{u[k]},{right[k] - left[k]},{left[k]},{right[k]}" for k in range(count)]
    (folder / "measured.csv").write_text("run,time_s,input_mm,gap_mm,left_mm,right_mm\n" + "\n".join(lines) + "\n")
    (folder / "sim.csv").write_text("input_mm,gap_mm\n-0.6,-0.2\n0.6,8.2\n")
    return diagnose(read_measured_table(folder / "measured.csv"), read_model(folder / "sim.csv")).report


@pytest.mark.slow
@pytest.mark.parametrize("harmonic", [0.0, 0.08, 0.18])
def test_a_small_harmonic_is_no_second_name(tmp_path: Path, harmonic: float) -> None:
    report = screwed(tmp_path, harmonic)
    assert report.verdict is Verdict.NAMED
    assert report.alternatives == (("encoder_cyclic_error",),)
    assert ("harmonic of order 2" in report.remaining) == (harmonic > 0.0)
    if harmonic > 0.0:
        told = re.search(r"(\d+) % of its first", report.remaining)
        assert told is not None
        assert float(told[1]) == pytest.approx(100.0 * harmonic, abs=SHARE_PERCENT)


@pytest.mark.slow
@pytest.mark.long
def test_a_large_harmonic_is_told(tmp_path: Path) -> None:
    report = screwed(tmp_path, 0.6)
    assert report.verdict is Verdict.UNKNOWN
    told = re.search(r"a wave over the input with a period of ([\d.]+) mm", report.unknown or "")
    assert told is not None
    # One of the two waves is named as an effect; the report also describes the other wave.
    named = [e.parameters["period_mm"].value for e in report.effects if "period_mm" in e.parameters]
    waves = sorted([float(told[1]), *named])
    assert waves == pytest.approx([0.5 * PERIOD_MM, PERIOD_MM], rel=PROBED)
