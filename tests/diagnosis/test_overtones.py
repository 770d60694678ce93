"""Small harmonics of a screw error are reported as a part of the screw error."""

import re
from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.report import DiagnosisReport, Verdict
from tests.diagnosis.tables import written

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
    return diagnose(*written(folder, "run,time_s,input_mm,gap_mm,left_mm,right_mm", lines, "-0.6,-0.2\n0.6,8.2")).report


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


def test_an_error_with_many_harmonics_is_one_cyclic_error(tmp_path: Path) -> None:
    # A resolver against counted steps, one way at constant speed: the harmonics of its error fall with their order.
    u = 0.9 + 0.0075 * np.arange(500)
    angle = 2.0 * np.pi * u / PERIOD_MM
    shares = (1.0, 0.073, 0.053, 0.029, 0.020, 0.012)
    off = sum(share * np.sin(k * angle + 0.7 * k) for k, share in enumerate(shares, start=1))
    gap = 5.0 + u + AMPLITUDE_MM * off + 3e-5 * np.random.default_rng(SEED).standard_normal(u.size)
    rows = [f"{0.03 * k},{u[k]},{gap[k]:.6f}" for k in range(u.size)]
    report = diagnose(*written(tmp_path, "time_s,input_mm,gap_mm", rows, "0,5\n6,11")).report
    assert report.verdict is Verdict.NAMED
    assert report.alternatives == (("encoder_cyclic_error",),)
    amplitude = report.effects[0].parameters["amplitude_mm"]
    assert amplitude.u is not None
    assert abs(amplitude.value - AMPLITUDE_MM) < 2.0 * amplitude.u
    assert "harmonic of order 2" in report.remaining


def test_a_harmonic_is_no_play_behind_a_wave_that_drives_back(tmp_path: Path) -> None:
    # The wave is so steep that the stage moves back in every period: a play behind it looks like the harmonic.
    u = 1.12835 + 0.0033978 * np.arange(429)
    angle = 2.0 * np.pi * u / 0.1107306 + 3.1707
    off = 0.0363897 * (np.sin(angle) + 0.08 * np.sin(2.0 * angle + 1.0))
    gap = 3.0 + u + off + 0.00185 * np.random.default_rng(SEED).standard_normal(u.size)
    rows = [f"{0.1 * k},{u[k]},{gap[k]:.6f}" for k in range(u.size)]
    report = diagnose(
        *written(tmp_path, "time_s,input_mm,gap_mm", rows, "0.9819258,3.9819258\n2.7290415,5.7290415")
    ).report
    assert report.alternatives == (("encoder_cyclic_error",),)


@pytest.mark.slow
def test_a_large_harmonic_is_told(tmp_path: Path) -> None:
    report = screwed(tmp_path, 0.6)
    assert report.verdict is Verdict.UNKNOWN
    told = re.search(r"a wave over the input with a period of ([\d.]+) mm", report.unknown or "")
    assert told is not None
    # One of the two waves is named as an effect; the report also describes the other wave.
    named = [e.parameters["period_mm"].value for e in report.effects if "period_mm" in e.parameters]
    waves = sorted([float(told[1]), *named])
    assert waves == pytest.approx([0.5 * PERIOD_MM, PERIOD_MM], rel=PROBED)
