"""Tables that are wrong end in one sentence; where an answer is still possible it is given with what it lacks."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli import cli
from fingervision.diagnosis.input.preparation import prepare
from fingervision.domain.errors import ExitCode, FingervisionError
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
        ("input_mm,gap_mm\n0,NaN\n" + GOOD, "gap_mm must be a finite number, but is NaN in data row 1"),
        (
            "input_mm,gap_mm,time_s\n" + "\n".join(f"0.{k},{k},{k // 2}" for k in range(8)),
            "time_s must be unique within a run, but 0 s stands twice",
        ),
        ("input_mm,gap_mm\n" + GOOD + "\n1", "must have 2 cells like the header, but has 1"),
    ],
)
def test_a_wrong_table_is_refused_in_a_sentence(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(FingervisionError) as caught:
        read_measured_table(write(tmp_path, text))
    assert words in str(caught.value)


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "micrometres"), (1e-3, "metres")])
def test_inputs_in_another_unit_are_recognised(tmp_path: Path, factor: float, unit: str) -> None:
    rows = "\n".join(f"{0.1 * k * factor},{4.0 + 0.77 * k}" for k in range(8))
    table = read_measured_table(write(tmp_path, "input_mm,gap_mm\n" + rows))
    with pytest.raises(FingervisionError, match=f"as if in {unit}"):
        prepare(table, read_model(write(tmp_path, "input_mm,gap_mm\n-1,-3.7\n2,19.4", "sim.csv")))


def test_a_model_that_does_not_cover_the_inputs_is_refused(tmp_path: Path) -> None:
    table = read_measured_table(write(tmp_path, "input_mm,gap_mm\n" + GOOD))
    with pytest.raises(FingervisionError, match=r"must lie within the model's 0 to 0\.5 mm, but runs from 0 to 0\.7"):
        prepare(table, read_model(write(tmp_path, "input_mm,gap_mm\n0,4\n0.5,7.8", "sim.csv")))


def test_a_simulation_that_ignores_the_input_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FingervisionError, match="gap_mm must depend on the input, but is 4 in every row"):
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
