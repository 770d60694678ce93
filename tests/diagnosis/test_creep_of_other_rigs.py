"""Creep of a polymer finger whose gain differs between runs; the data are computed in this file alone."""

from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.report import Verdict
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model

LOADS_MM = (0.4, 0.8, 1.2, 1.6)
GAINS = (1.035, 0.97, 1.01, 0.985)
SHARES = ((0.12, 1.5), (0.08, 20.0))
RATE_HZ, HOLD_S, NOISE_MM = 4.0, 50.0, 0.004


def crept(time_s: np.ndarray, opening_mm: np.ndarray) -> np.ndarray:
    """Response of the finger to an opening that is constant between samples."""
    out = opening_mm.copy()
    for share, tau_s in SHARES:
        behind = opening_mm[0]
        for k in range(1, time_s.size):
            behind += (opening_mm[k] - behind) * (1.0 - np.exp(-(time_s[k] - time_s[k - 1]) / tau_s))
            out[k] -= share * (opening_mm[k] - behind)
    return out


@pytest.mark.slow
def test_gains_that_differ_from_load_to_load_are_no_friction_and_no_map(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    time_s = np.arange(0.0, HOLD_S, 1.0 / RATE_HZ)
    rows = ["run,time_s,input_mm,gap_mm"]
    for run, (load, gain) in enumerate(zip(LOADS_MM, GAINS, strict=True)):
        u = np.where(time_s < 2.0, 0.0, load)
        gap = 3.0 + gain * crept(time_s, 2.0 * u) + NOISE_MM * rng.standard_normal(u.size)
        rows += [f"{run},{t:.4f},{x:.6f},{g:.6f}" for t, x, g in zip(time_s, u, gap, strict=True)]
    (tmp_path / "measured.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "simulation.csv").write_text("input_mm,gap_mm\n-0.2,2.6\n1.8,6.6\n")
    found = diagnose(read_measured_table(tmp_path / "measured.csv"), read_model(tmp_path / "simulation.csv")).report
    assert found.verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    named = {name for names in found.alternatives for name in names}
    assert "viscoelastic_creep" in named
    # The mean of the four gains differs from 1, which is an error of a ratio.
    assert named <= {"viscoelastic_creep", "lever_ratio_error", "input_scale", "scale_error"}
    # Noise contributes 5 %; the rest is the part of the mean gain that the slowest creep imitates.
    assert found.standing_share < 0.1
