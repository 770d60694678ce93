"""Stages measured with a laser, with several causes of error at once; the data are computed in this file alone."""

from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import Diagnosis, diagnose
from fingervision.diagnosis.inference.hypothesis_fit import bounded_step
from fingervision.domain.report import Verdict
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from tests.diagnosis.tables import written

TARGETS_MM = np.linspace(-100.0, 100.0, 7)
NOISE_MM = 0.003
CYCLES = 5


def driven_mm(play_mm: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Commanded positions, flags of measured rows, and actual positions of a stage with play that overshoots each end
    by 0.5 mm.
    """
    up = [(TARGETS_MM[0] - 0.5, False), *((x, True) for x in TARGETS_MM)]
    down = [(TARGETS_MM[-1] + 0.5, False), *((x, True) for x in TARGETS_MM[::-1])]
    cycle = CYCLES * (up + down)
    position, read = np.array([x for x, _ in cycle]), np.array([seen for _, seen in cycle])
    rising = np.diff(position, prepend=position[0] - 1.0) > 0.0
    return position, read, position + np.where(rising, -0.5, 0.5) * play_mm


def report_of(
    folder: Path, gap_mm: np.ndarray, position: np.ndarray, read: np.ndarray, model_mm: np.ndarray
) -> Diagnosis:
    rows = [
        f"{15.0 * k},{x},{gap if seen else ''}"
        for k, (x, gap, seen) in enumerate(zip(position, gap_mm, read, strict=True))
    ]
    (folder / "measured.csv").write_text("time_s,input_mm,gap_mm\n" + "\n".join(rows) + "\n")
    at = [TARGETS_MM[0] - 1.0, *TARGETS_MM, TARGETS_MM[-1] + 1.0]
    known = [model_mm[0] - 1.0, *model_mm, model_mm[-1] + 1.0]
    lines = [f"{x},{gap}" for x, gap in zip(at, known, strict=True)]
    (folder / "simulation.csv").write_text("input_mm,gap_mm\n" + "\n".join(lines) + "\n")
    return diagnose(read_measured_table(folder / "measured.csv"), read_model(folder / "simulation.csv"))


@pytest.mark.slow
def test_play_beside_a_map_an_offset_and_a_ratio_is_no_creep(tmp_path: Path) -> None:
    position, read, stands = driven_mm(0.024)
    curve = 0.03 * np.sin(2.0 * np.pi * stands / 170.0 + 0.4) + 0.02 * np.cos(2.0 * np.pi * stands / 90.0)
    gap = stands + 0.00025 * stands + curve + 103.0 + np.random.default_rng(2).normal(0.0, NOISE_MM, stands.size)
    gap += 3.0 - gap[1]
    found = report_of(tmp_path, gap, position, read, TARGETS_MM + 103.0).report
    assert found.verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    assert all({"backlash", "friction_hysteresis"} & set(names) for names in found.alternatives)
    named = {effect.name: effect.parameters for effect in found.effects}
    assert named["backlash"]["play_mm"].value == pytest.approx(0.024, abs=0.002)


@pytest.mark.slow
def test_a_drift_is_found_that_needs_an_offset_beside_it(tmp_path: Path) -> None:
    # The simulation is the mean of the readings, as in published reports; the mean of the drift is then an offset.
    position, read, stands = driven_mm(0.024)
    share = np.arange(stands.size) / stands.size
    noise = np.random.default_rng(3).normal(0.0, NOISE_MM, stands.size)
    gap = stands + 103.0 - 0.015 * (1.0 - np.exp(-share / 0.5)) + noise
    mean = np.array([gap[read & (position == x)].mean() for x in TARGETS_MM])
    found = report_of(tmp_path, gap, position, read, mean).report
    named = {effect.name: effect.parameters for effect in found.effects}
    assert found.unknown is None
    assert named["backlash"]["play_mm"].value == pytest.approx(0.024, abs=0.003)
    assert all("thermal_drift" in names for names in found.alternatives)


def test_outliers_in_a_tabulated_mean_make_no_effect(tmp_path: Path) -> None:
    position, read, stands = driven_mm(0.0)
    gap = stands + 103.0 + np.random.default_rng(4).normal(0.0, NOISE_MM, stands.size)
    gap[[10, 33]] += 15.0 * NOISE_MM
    mean = np.array([gap[read & (position == x)].mean() for x in TARGETS_MM])
    found = report_of(tmp_path, gap, position, read, mean).report
    assert not found.effects
    assert found.disagreement.after_rms_mm <= found.disagreement.before_rms_mm


def test_a_step_held_at_its_bounds_is_better_than_one_clipped() -> None:
    rng = np.random.default_rng(6)
    better = 0
    for _ in range(30):
        root = rng.normal(size=(3, 3))
        matrix, pull = root @ root.T + 0.3 * np.eye(3), rng.normal(size=3)
        low, high = -rng.uniform(0.0, 0.6, 3), rng.uniform(0.0, 0.6, 3)
        step, clipped = bounded_step(matrix, pull, (low, high)), np.clip(np.linalg.solve(matrix, pull), low, high)
        cost, of_clipped = (0.5 * x @ matrix @ x - pull @ x for x in (step, clipped))
        assert np.all((low <= step) & (step <= high))
        assert cost <= of_clipped + 1e-12
        better += cost < of_clipped - 1e-6
    assert better > 10


@pytest.mark.slow
def test_a_map_that_was_read_from_one_side_is_no_friction(tmp_path: Path) -> None:
    position, read, stands = driven_mm(0.024)
    read &= np.diff(position, prepend=position[0] - 1.0) > 0.0
    curve = 0.012 * np.sin(2.0 * np.pi * stands / 140.0 + 0.8)
    gap = stands + 103.0 + curve + np.random.default_rng(4).normal(0.0, NOISE_MM, stands.size)
    found = report_of(tmp_path, gap, position, read, TARGETS_MM + 103.0).report
    assert all("position_error_map" in names for names in found.alternatives)
    assert found.verdict is not Verdict.AGREES


def test_a_play_beside_an_offset_in_sixty_rows_is_no_correlated_noise(tmp_path: Path) -> None:
    there_and_back = 0.5 - 0.5 * np.cos(np.linspace(0.0, 4.0 * np.pi, 60, endpoint=False))
    rising = np.diff(there_and_back, prepend=-1.0) > 0.0
    gap = 2.05 + 6.0 * (there_and_back + np.where(rising, -0.005, 0.005))
    gap += np.random.default_rng(7).normal(0.0, 0.004, gap.size)
    rows = [f"{0.1 * k:.1f},{x},{y}" for k, (x, y) in enumerate(zip(there_and_back, gap, strict=True))]
    found = diagnose(*written(tmp_path, "time_s,input_mm,gap_mm", rows, "-0.5,-1\n1.5,11")).report
    assert found.verdict in (Verdict.NAMED, Verdict.AMBIGUOUS)
    assert all({"backlash", "friction_hysteresis"} & set(names) for names in found.alternatives)
    assert found.disagreement.after_rms_mm < 0.006
