"""Faulty tables are refused with one sentence; if a diagnosis is still possible, it states what is missing."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli import cli
from fingervision.diagnosis.compare import compare
from fingervision.diagnosis.inference.hypothesis import Explanation
from fingervision.diagnosis.inference.hypothesis_fit import fit
from fingervision.diagnosis.inference.plausibility import mixed_rows
from fingervision.diagnosis.inference.search import problem_of
from fingervision.diagnosis.input.preparation import prepare
from fingervision.diagnosis.report.sentences import open_parameters
from fingervision.domain.errors import DataError, ExitCode, FingervisionError
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from fingervision.storage.simulation_table import read_simulation_table

GOOD = "\n".join(f"{0.1 * k},{4.0 + 0.77 * k}" for k in range(8))


def write(folder: Path, text: str, name: str = "measured.csv") -> Path:
    path = folder / name
    path.write_text(text + "\n")
    return path


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("input_mm,gap_mm\n0,4\n1,11\n2,18", "at least 5 rows with an input and a gap, but has 3"),
        (
            "input_mm,gap_mm\n" + "\n".join(f"0.5,{k}" for k in range(6)),
            "input_mm must change, but is 0.5 in every row",
        ),
        ("input_mm,gap_mm\n" + "\n".join(f"{k},4.5" for k in range(6)), "gap_mm must change, but is 4.5 in every row"),
        ("input_um,gap_mm\n" + GOOD, "must have a column input_mm, but has input_um,gap_mm: rename input_um"),
        ("input_mm,spalt\n" + GOOD, "must have a column gap_mm, but has input_mm,spalt: add it"),
        ("input_mm,gap_mm\n0,NaN\n" + GOOD, "gap_mm must be a finite number, but is 'NaN' in line 2"),
        (
            "input_mm,gap_mm,time_s\n" + "\n".join(f"0.{k},{k},{k // 2}" for k in range(8)),
            "time_s must be unique within a run, but 0 s occurs twice",
        ),
        ("input_mm,gap_mm\n" + GOOD + "\n1", "must have 2 cells like the header, but has 1"),
    ],
)
def test_a_wrong_table_is_refused_in_a_sentence(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(DataError) as caught:
        read_measured_table(write(tmp_path, text))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1e3, "is in micrometres"),
        (1e-3, "is in metres"),
        (10.0, "is in tenths of a millimetre"),
        (-1.0, "has the opposite sign"),
    ],
)
def test_inputs_in_another_unit_are_recognised(tmp_path: Path, factor: float, words: str) -> None:
    rows = "\n".join(f"{0.15 * k * factor},{4.0 + 1.155 * k}" for k in range(8))
    table = read_measured_table(write(tmp_path, "input_mm,gap_mm\n" + rows))
    with pytest.raises(DataError, match=f"correct the column if it {words}"):
        prepare(table, read_model(write(tmp_path, "input_mm,gap_mm\n-0.1,3.23\n2,19.4", "sim.csv")))


def test_exchanged_columns_outside_the_model_are_recognised(tmp_path: Path) -> None:
    rows = "\n".join(f"{0.15 * k},{4.0 + 1.155 * k}" for k in range(8))
    table = read_measured_table(write(tmp_path, "gap_mm,input_mm\n" + rows))
    with pytest.raises(DataError, match="correct the column if it was exchanged with gap_mm"):
        prepare(table, read_model(write(tmp_path, "input_mm,gap_mm\n-1,-3.7\n2,19.4", "sim.csv")))


@pytest.mark.parametrize("exchanged", [True, False])
def test_exchanged_columns_partly_within_the_model_are_recognised(tmp_path: Path, exchanged: bool) -> None:
    columns = "gap_mm,input_mm\n" if exchanged else "input_mm,gap_mm\n"
    inputs = 0.1 * np.arange(8) + (0.0 if exchanged else 0.6)
    rows = "\n".join(f"{u},{0.5 + 0.77 * u}" for u in inputs)
    table = read_measured_table(write(tmp_path, columns + rows))
    with pytest.raises(DataError, match="leave those rows out") as refused:
        prepare(table, read_model(write(tmp_path, "input_mm,gap_mm\n-0.5,0.115\n1,1.27", "sim.csv")))
    assert ("correct the column if it was exchanged with gap_mm" in str(refused.value)) == exchanged


def test_a_model_that_does_not_cover_the_inputs_is_refused(tmp_path: Path) -> None:
    table = read_measured_table(write(tmp_path, "input_mm,gap_mm\n" + GOOD))
    with pytest.raises(DataError, match=r"must lie within the model's 0 to 0\.5 mm, but runs from 0 to 0\.7"):
        prepare(table, read_model(write(tmp_path, "input_mm,gap_mm\n0,4\n0.5,7.8", "sim.csv")))


def test_a_simulation_that_ignores_the_input_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="gap_mm must depend on the input, but is 4 in every row"):
        read_simulation_table(write(tmp_path, "input_mm,gap_mm\n0,4\n1,4", "sim.csv"))


def test_exchanged_edges_and_times_that_run_backwards_are_mended_and_said(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    rows = [f"{0.1 * k},{4 + k},{0.1 * k},{2 + 0.5 * k},{-2 - 0.5 * k}" for k in rng.permutation(9)]
    table = read_measured_table(write(tmp_path, "time_s,gap_mm,input_mm,left_mm,right_mm\n" + "\n".join(rows)))
    assert any("exchanged" in note for note in table.notes)
    assert any("backwards" in note for note in table.notes)
    assert np.all(np.diff(table.input_mm) > 0.0)
    assert np.all(table.gap_mm > 0.0)


@pytest.mark.parametrize("command", ["diagnose", "compare"])
def test_a_refused_table_leaves_no_empty_folder(tmp_path: Path, command: str) -> None:
    table = write(tmp_path, "input_mm,gap_mm\n" + GOOD)
    model, out = write(tmp_path, "input_mm,gap_mm\n0,4\n0.5,7.8", "sim.csv"), tmp_path / "out"
    asked = [command, str(table), "--model", str(model), "--out", str(out)]
    refused = CliRunner().invoke(cli, asked)
    assert isinstance(refused.exception, FingervisionError)
    assert "must lie within the model's" in str(refused.exception)
    assert not out.exists()
    out.mkdir()
    assert CliRunner().invoke(cli, asked).exit_code != ExitCode.DONE
    assert out.exists()


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("right", None),
        ("scattered", "of the rows agree"),
        ("shifted", "two groups about 0.4 mm"),
        ("halved", "two groups about 0.4 mm"),
    ],
)
def test_rows_that_are_no_one_measurement_are_asked_about(tmp_path: Path, kind: str, words: str | None) -> None:
    """Two of three rows are wrong, or half of the rows have another zero: naming any effect would be wrong."""
    rng = np.random.default_rng(4)
    at = rng.uniform(-0.9, 1.9, 240)
    wrong = rng.random(at.size) < (0.5 if kind == "halved" else 2.0 / 3.0)
    away = {"scattered": 0.5 * rng.standard_normal(at.size), "right": np.zeros(at.size)}.get(
        kind, np.full(at.size, 0.4)
    )
    gap = 4.0 + 7.7 * at + 0.05 + 0.003 * rng.standard_normal(at.size) + np.where(wrong, away, 0.0)
    rows = "\n".join(f"{u:.6f},{g:.6f}" for u, g in zip(at, gap, strict=True))
    data = prepare(
        read_measured_table(write(tmp_path, "input_mm,gap_mm\n" + rows)),
        read_model(write(tmp_path, "input_mm,gap_mm\n-1,-3.7\n2,19.4", "sim.csv")),
    )
    problem = problem_of(data, None)
    found = fit(problem, ("rest_gap_error",), {"rest_gap_error": {}})
    finding = mixed_rows(data, found, problem)
    if words is None:
        assert finding is None
    else:
        assert finding is not None
        assert words in finding


@pytest.mark.parametrize(("u_s", "is_open"), [(50.0, False), (1500.0, True)])
def test_a_warming_slower_than_the_data_show_is_open_ended(tmp_path: Path, u_s: float, is_open: bool) -> None:
    rows = "\n".join(f"{60 * k},{0.1 * (k % 8)},{4.0 + 0.77 * (k % 8)}" for k in range(24))
    data = prepare(
        read_measured_table(write(tmp_path, "time_s,input_mm,gap_mm\n" + rows)),
        read_model(write(tmp_path, "input_mm,gap_mm\n-1,-3.7\n2,19.4", "sim.csv")),
    )
    problem = problem_of(data, None)
    warming = {"thermal_drift": {"amplitude_mm": 0.1, "tau_s": 2000.0}}
    found = Explanation(("thermal_drift",), warming, 0.0, problem.measured, np.diag([1e-6, u_s**2]), 2, (0.0,))
    assert [(name, parameter.name) for name, parameter in open_parameters(found, problem)] == (
        [("thermal_drift", "tau_s")] if is_open else []
    )


@pytest.mark.parametrize("unit", [1.0, 10.0, 25.4])
def test_a_comparison_asks_about_a_unit_of_the_gap(tmp_path: Path, unit: float) -> None:
    rng = np.random.default_rng(6)
    at = np.linspace(-0.9, 1.9, 40)
    gap = (4.0 + 7.7 * at + 0.005 * rng.standard_normal(40)) / unit
    table = write(tmp_path, "input_mm,gap_mm\n" + "\n".join(f"{u:.6f},{g:.8f}" for u, g in zip(at, gap, strict=True)))
    found = compare(
        read_measured_table(table), read_model(write(tmp_path, "input_mm,gap_mm\n-1,-3.7\n2,19.4", "sim.csv"))
    )
    assert any(f"{1.0 / unit:.3g} times" in note for note in found.data.notes) == (unit != 1.0)
