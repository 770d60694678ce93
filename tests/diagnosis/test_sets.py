"""Sets of effects that the data cannot distinguish, independent of the order of the search."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from fingervision.diagnosis.compare import compare
from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.parameter import Estimate
from fingervision.domain.report import DiagnosisReport, Verdict
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from tests.diagnosis.tables import written

Array = NDArray[np.float64]
SEED = 7
EDGE_MM, RATE_HZ = 0.003, 8.0
SPEEDS_MM_S = (0.1, 0.2, 0.3)


def way(time_s: Array, seconds: float) -> Array:
    """Two motions to the end of the range and back; each reversal takes half a second."""
    shifts = np.linspace(-0.25, 0.25, 21)
    shares = [np.clip((time_s + shift) / seconds, 0.0, 1.0) for shift in shifts]
    return np.asarray(np.mean([0.4 - np.abs((3.2 * share) % 1.6 - 0.8) for share in shares], axis=0))


def answered(
    folder: Path,
    *,
    late_s: float = 0.0,
    straight: bool = False,
    curve: float = 0.0,
    away: float = 0.0,
    offset_mm: float = 0.0,
    runs: int = 3,
) -> DiagnosisReport:
    """Diagnose triangles at several speeds with a delay, an arc, a motion out of the plane, and an offset of the gap.

    If `straight`, the stage moves along straight lines between its samples.
    """
    rng = np.random.default_rng(SEED)
    lines = []
    for run, speed in enumerate(SPEEDS_MM_S[:runs]):
        seconds = 3.2 / speed
        t = np.arange(0.0, seconds, 1.0 / RATE_HZ)
        u, driven = (way(at, seconds) for at in (t, t - late_s))
        driven = np.interp(t - late_s, t, u) if straight else driven
        bent = np.sin(curve * 7.0 * driven) / curve if curve else 7.0 * driven
        gap = (4.0 + bent + offset_mm) * (1.0 + away * bent)
        left, right = (side * 0.5 * gap + EDGE_MM * rng.standard_normal(t.size) for side in (-1, 1))
        lines += [f"{run},{t[k]},{u[k]},{right[k] - left[k]},{left[k]},{right[k]}" for k in range(t.size)]
    return diagnose(*written(folder, "run,time_s,input_mm,gap_mm,left_mm,right_mm", lines, "-0.6,-0.2\n0.6,8.2")).report


@pytest.mark.slow
@pytest.mark.parametrize("straight", [False, True])
@pytest.mark.parametrize("late_s", [0.03, 0.06])
def test_a_delay_is_told_from_a_resonance_however_the_stage_went_between_two_samples(
    tmp_path: Path, late_s: float, straight: bool
) -> None:
    sets = answered(tmp_path, late_s=late_s, straight=straight).alternatives
    assert set(sets) == {("drive_lag",), ("camera_latency",)}


@pytest.mark.slow
def test_a_model_with_the_delay_disagrees_nowhere(tmp_path: Path) -> None:
    answered(tmp_path, late_s=0.03)
    model = read_model(tmp_path / "sim.csv")
    late = replace(model, effects={"drive_lag": {"delay_s": Estimate(0.03, 0.0003, "s")}})
    table = read_measured_table(tmp_path / "measured.csv")
    assert diagnose(table, late).report.verdict is Verdict.AGREES
    assert compare(table, late).places == ()


def test_an_arc_beside_another_effect_is_found_from_where_the_pair_puts_it(tmp_path: Path) -> None:
    # If the arc is fitted alone, its parameters are too far from those of the pair for the search to return to them.
    # The pair with the lever ratio was then missing.
    sets = answered(tmp_path, curve=0.05, away=0.004).alternatives
    assert ("large_deflection", "out_of_plane_motion") in sets
    assert ("lever_ratio_error", "large_deflection") in sets


def test_what_gains_from_noise_alone_is_no_member(tmp_path: Path) -> None:
    # With two runs, an offset gains a chi-square of only some 20 over the scatter of runs, and a wave in the noise
    # gains a third of that.
    sets = answered(tmp_path, offset_mm=0.01, runs=2).alternatives
    assert {("rest_gap_error",), ("edge_bias",), ("input_offset",)} >= set(sets)
    assert len(sets) >= 2
