import csv
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli.model import command
from fingervision.domain.errors import FingervisionError, UsageError

NOTCH = 0.03
"""What a notch adds to the nominal stress of its thinnest section, at t / R = 0.25 (1.03 by finite elements)."""
GRIPPER = Path(__file__).parents[2] / "sample_frames" / "paper" / "gripper.toml"


def drive(path: Path, inputs: list[float]) -> Path:
    path.write_text("time_s,input_mm\n" + "".join(f"{i},{value}\n" for i, value in enumerate(inputs)))
    return path


def run(*arguments: str | Path) -> str:
    result = CliRunner().invoke(command, [str(part) for part in arguments], catch_exceptions=False)
    assert result.exit_code == 0
    return result.output


def test_all_models_side_by_side(tmp_path: Path) -> None:
    given = drive(tmp_path / "drive.csv", [-0.5, 0.0, 1.5])
    rows = json.loads(run(GRIPPER, "--drive", given, "--out", tmp_path / "o", "--json"))
    assert list(rows) == ["finite_element", "lumped", "stiffness_matrix"]
    assert rows["finite_element"]["gap_per_input"] == pytest.approx(7.7212, abs=0.01)
    assert rows["finite_element"]["input_at_yield_mm"] == pytest.approx(48.0 / 19.07, rel=0.02)
    assert rows["lumped"]["peak_stress_mpa_per_mm"] == pytest.approx(19.07, rel=NOTCH)
    assert rows["stiffness_matrix"]["peak_stress_mpa_per_mm"] is None
    for kind in rows:
        with (tmp_path / "o" / kind / "simulation.csv").open() as file:
            table = list(csv.DictReader(file))
        assert [float(row["input_mm"]) for row in table] == [-0.5, 0.0, 1.5]
        slope = (float(table[2]["gap_mm"]) - float(table[0]["gap_mm"])) / 2.0
        assert slope == pytest.approx(rows[kind]["gap_per_input"], rel=1e-6)
    for name in ("models.png", "deformed.png"):
        assert (tmp_path / "o" / name).read_bytes().startswith(b"\x89PNG")


def test_one_model_writes_one_table(tmp_path: Path) -> None:
    run(GRIPPER, "--kind", "lumped", "--contact", "--out", tmp_path)
    table = np.genfromtxt(tmp_path / "simulation.csv", delimiter=",", names=True)
    assert table["right_mm"] == pytest.approx(-table["left_mm"])
    assert table["gap_mm"].min() > 0.0


def test_a_drive_in_metres_is_asked_about(tmp_path: Path) -> None:
    given = drive(tmp_path / "drive.csv", [-0.00057, 0.0, 0.00159])
    with pytest.raises(UsageError, match=r"must be millimetres, but the largest is 0.00159 .* are they metres"):
        run(GRIPPER, "--kind", "lumped", "--drive", given, "--out", tmp_path)


def test_a_drive_beyond_the_stress_limit_is_warned_about(tmp_path: Path) -> None:
    given = drive(tmp_path / "drive.csv", [0.0, 3.0])
    output = run(GRIPPER, "--kind", "finite_element", "--drive", given, "--out", tmp_path)
    assert "at an input of 3 mm the stress at (35, 30) must stay below the yield of 48 MPa, but is 57.2 MPa" in output
    assert "stay within 2.52 mm" in output


def test_the_lumped_model_warns_with_its_nominal_stress(tmp_path: Path) -> None:
    given = drive(tmp_path / "drive.csv", [0.0, 3.0])
    output = run(GRIPPER, "--kind", "lumped", "--drive", given, "--out", tmp_path)
    assert "at (18.05, 29.66) must stay below the yield of 48 MPa, but is 56.6 MPa, 8.57 MPa too much" in output


def test_the_stiffness_matrix_knows_small_displacements_alone(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="knows small displacements alone"):
        run(GRIPPER, "--kind", "stiffness_matrix", "--large-rotation", "--out", tmp_path)


def test_a_file_where_the_folder_should_be(tmp_path: Path) -> None:
    (tmp_path / "o").write_text("")
    with pytest.raises(
        FingervisionError, match=r"--out must be a folder that can be written, but .* is not: File exists"
    ):
        run(GRIPPER, "--kind", "lumped", "--out", tmp_path / "o")


def test_a_missing_gripper_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(FingervisionError, match="There is no gripper"):
        run(tmp_path / "none.toml")
