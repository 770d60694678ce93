"""A slot of known width distinguishes errors of the camera from errors of the gripper."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.measured_table import MeasuredTable, ReferenceSlot
from fingervision.domain.report import DiagnosisReport, Verdict
from fingervision.models.corrected import CorrectedModel
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model

SIZE_MM, U_MM, NOISE_MM = 4.0, 0.002, 0.002
OFFSET_MM = 0.06


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> tuple[MeasuredTable, CorrectedModel]:
    """Tables with a gap that is 0.06 mm too large throughout: an edge bias, or an error of the gap at rest."""
    folder = tmp_path_factory.mktemp("bench")
    rng = np.random.default_rng(4)
    up = np.linspace(-0.3, 1.2, 80)
    input_mm = np.concatenate([up, up[-2::-1]])
    gap_mm = 4.0 + 7.7 * input_mm + OFFSET_MM + NOISE_MM * rng.standard_normal(input_mm.size)
    lines = [f"{0.04 * k:.2f},{u:.6f},{g:.6f}" for k, (u, g) in enumerate(zip(input_mm, gap_mm, strict=True))]
    (folder / "samples.csv").write_text("time_s,input_mm,gap_mm\n" + "\n".join(lines) + "\n")
    (folder / "sim.csv").write_text("input_mm,gap_mm\n-0.5,0.15\n1.5,15.55\n")
    return read_measured_table(folder / "samples.csv"), read_model(folder / "sim.csv")


def report_with(bench: tuple[MeasuredTable, CorrectedModel], *slots: ReferenceSlot) -> DiagnosisReport:
    table, model = bench
    return diagnose(replace(table, slots=slots), model).report


def slot(measured_mm: float) -> ReferenceSlot:
    return ReferenceSlot(SIZE_MM, U_MM, measured_mm, 0.0003)


@pytest.fixture(scope="module")
def bare(bench: tuple[MeasuredTable, CorrectedModel]) -> DiagnosisReport:
    """Diagnosis without a reference slot."""
    return report_with(bench)


def test_without_a_slot_camera_and_gripper_are_not_told_apart(bare: DiagnosisReport) -> None:
    assert bare.verdict is Verdict.AMBIGUOUS
    assert {("edge_bias",), ("rest_gap_error",)} <= set(bare.alternatives)


def test_a_slot_that_is_as_much_too_wide_is_the_camera(bench: tuple[MeasuredTable, CorrectedModel]) -> None:
    report = report_with(bench, slot(SIZE_MM + OFFSET_MM))
    assert report.verdict is Verdict.NAMED
    assert [effect.name for effect in report.effects] == ["edge_bias"]
    assert "the reference slot of 4 mm measures 4.0600 mm, as edge_bias predicts 4.06" in " ".join(report.notes)
    assert "rules out " in " ".join(report.notes)


def test_a_slot_as_wide_as_it_is_leaves_the_gripper(bench: tuple[MeasuredTable, CorrectedModel]) -> None:
    report = report_with(bench, slot(SIZE_MM))
    assert ("edge_bias",) not in report.alternatives
    assert ("rest_gap_error",) in report.alternatives
    assert report.effects[0].name != "edge_bias"


def test_a_slot_that_nothing_explains_drops_nothing(
    bench: tuple[MeasuredTable, CorrectedModel], bare: DiagnosisReport
) -> None:
    report = report_with(bench, slot(SIZE_MM - 0.5))
    assert report.alternatives == bare.alternatives
    assert "measures 3.5000 mm, but " in " ".join(report.notes)


def test_a_slot_too_poorly_known_drops_nothing(
    bench: tuple[MeasuredTable, CorrectedModel], bare: DiagnosisReport
) -> None:
    poor = ReferenceSlot(SIZE_MM, 0.05, SIZE_MM, 0.0003)
    assert report_with(bench, poor).alternatives == bare.alternatives


def test_the_slots_of_a_run_are_read_beside_its_table_and_nowhere_else(tmp_path: Path) -> None:
    rows = "time_s,input_mm,gap_mm\n" + "\n".join(f"{k},{0.1 * k:.1f},{4 + 0.7 * k:.1f}" for k in range(8)) + "\n"
    for name in ("samples.csv", "joined.csv", "other.csv"):
        (tmp_path / name).write_text(rows)
    assert read_measured_table(tmp_path / "samples.csv").slots == ()
    found = {"size_mm": 4.0, "u_size_mm": 0.002, "measured_mm": 4.08, "u_random_mm": 0.0003, "ratio": 1.02}
    about = {"samples": "samples.csv", "joined": "joined.csv", "reference_slots": [found]}
    (tmp_path / "run.json").write_text(json.dumps(about))
    expected = (ReferenceSlot(4.0, 0.002, 4.08, 0.0003),)
    assert read_measured_table(tmp_path / "samples.csv").slots == expected
    assert read_measured_table(tmp_path / "joined.csv").slots == expected
    assert read_measured_table(tmp_path / "other.csv").slots == ()
    (tmp_path / "run.json").write_text('{"samples": "samples.csv", "reference_slots": [{"size_mm": 4')
    assert read_measured_table(tmp_path / "samples.csv").slots == ()
