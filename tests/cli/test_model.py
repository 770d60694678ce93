import json
import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.errors import FingervisionError, InputFileError, OutputError, UsageError
from fingervision.models.answer_figures import Physics
from fingervision.models.grip import Part, first_grip_mm
from fingervision.models.kinds import build_model, kinds
from fingervision.models.lumped import LumpedGripper
from fingervision.storage.gripper_toml import read_gripper
from tests.commands import printed
from tests.csv_rows import csv_rows

NOTCH = 0.02
"""Neuber's factor and the frame's force beside finite elements."""
HELD = 0.02
"""By how much less von Mises's stress is where the width holds the hinge back: plane stress has 19.07 MPa/mm."""
GRIPPER = Path(__file__).parents[2] / "sample_frames" / "paper" / "gripper.toml"


def drive(path: Path, inputs: list[float]) -> Path:
    path.write_text("time_s,input_mm\n" + "".join(f"{i},{value}\n" for i, value in enumerate(inputs)))
    return path


run = partial(printed, "model")


def test_beam_theory_alone_is_refused_where_it_would_change_nothing(tmp_path: Path) -> None:
    stage = GRIPPER.parents[2] / "fingervision" / "models" / "mechanisms" / "parallel_leaf_stage.toml"
    with pytest.raises(UsageError, match="leave out --hinge"):
        run(stage, "--kind", "lumped", "--hinge", "beam", "--out", tmp_path)


def test_all_models_side_by_side(tmp_path: Path) -> None:
    given = drive(tmp_path / "drive.csv", [-0.5, 0.0, 1.5])
    rows = json.loads(run(GRIPPER, "--modes", "2", "--drive", given, "--out", tmp_path / "o", "--json"))
    assert list(rows) == list(kinds())
    assert rows["finite_element"]["gap_per_input"] == pytest.approx(7.7212, abs=0.01)
    assert rows["finite_element"]["input_at_yield_mm"] == pytest.approx(48.0 / 19.07, rel=HELD)
    assert rows["lumped"]["peak_stress_mpa_per_mm"] == pytest.approx(19.07, rel=NOTCH)
    assert rows["stiffness_matrix"]["peak_stress_mpa_per_mm"] == pytest.approx(19.07, rel=NOTCH)
    for kind in rows:
        table = csv_rows(tmp_path / "o" / kind / "simulation.csv")
        assert [float(row["input_mm"]) for row in table] == [-0.5, 0.0, 1.5]
        slope = (float(table[2]["gap_mm"]) - float(table[0]["gap_mm"])) / 2.0
        assert slope == pytest.approx(rows[kind]["gap_per_input"], rel=1e-6)
    modes = csv_rows(tmp_path / "o" / "modes.csv")
    assert len(modes) == 3 * 3 * 2
    found = {(row["kind"], row["family"], row["number"]): float(row["frequency_hz"]) for row in modes}
    # Plane stress has 44.6 and 357.9 Hz; the width of the hinges adds half its 2.6 % of force to the first.
    assert found["finite_element", "drive free", "1"] == pytest.approx(44.6 * 1.013, rel=0.005)
    assert found["finite_element", "drive held", "1"] == pytest.approx(357.9, rel=0.01)
    for name in ("models.png", "deformed.png", "modes.png"):
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
    output = run(GRIPPER, "--kind", "finite_element", "--mesh", "--drive", given, "--out", tmp_path)
    assert "at an input of 3 mm the stress at (35, 30) must stay below the yield of 48 MPa, but is 56.5 MPa" in output
    assert "stay within 2.55 mm" in output
    assert (tmp_path / "mesh.png").read_bytes().startswith(b"\x89PNG")


def test_the_lumped_model_warns_with_its_nominal_stress(tmp_path: Path) -> None:
    given = drive(tmp_path / "drive.csv", [0.0, 3.0])
    output = run(GRIPPER, "--kind", "lumped", "--drive", given, "--out", tmp_path)
    found = re.search(r"must stay below the yield of 48 MPa, but is (\S+) MPa, (\S+) MPa too much", output)
    assert found is not None
    # Finite elements have 18.85 MPa/mm.
    assert float(found[1]) == pytest.approx(3.0 * 18.85, rel=0.01)
    assert float(found[2]) == pytest.approx(float(found[1]) - 48.0, abs=0.05)


def test_the_stiffness_matrix_knows_small_displacements_alone(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="handles small displacements only"):
        run(GRIPPER, "--kind", "stiffness_matrix", "--large-rotation", "--out", tmp_path)


def test_a_file_where_the_folder_should_be(tmp_path: Path) -> None:
    (tmp_path / "o").write_text("")
    with pytest.raises(OutputError, match=r"--out must be a folder, but .* is a file"):
        run(GRIPPER, "--kind", "lumped", "--out", tmp_path / "o")


def test_a_missing_gripper_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputFileError, match="There is no drawing"):
        run(tmp_path / "none.toml")


def test_contact_reaches_stress_warning_and_a_table_without_a_line_through_the_touch(tmp_path: Path) -> None:
    """At -2 mm pressed together: a hinge beyond its yield of 48 MPa, which the free gripper (38 MPa) is not."""
    given = drive(tmp_path / "drive.csv", [-2.0, 0.0])
    output = run(GRIPPER, "--kind", "lumped", "--contact", "--drive", given, "--out", tmp_path)
    assert "at an input of -2 mm the stress at" in output
    # Finite elements yield at -1.56 mm; the frame's fingers, pressed together, bend its hinges 5 % less.
    within = float(output.split("stay within ")[1].split(" mm")[0])
    assert within == pytest.approx(-1.56, rel=0.07)
    # A simulation is read as straight between its rows: halfway from rest to -2 mm the fingers have long touched.
    rows = np.genfromtxt(tmp_path / "simulation.csv", delimiter=",", names=True)
    between = np.array([-1.37, -0.53, -0.5, -0.23])
    expected = LumpedGripper(read_gripper(GRIPPER), Physics(contact=True)).respond(between).gap_mm
    assert np.interp(between, rows["input_mm"], rows["gap_mm"]) == pytest.approx(expected, abs=1e-3)
    free = run(GRIPPER, "--kind", "lumped", "--drive", given, "--out", tmp_path)
    assert "must stay below the yield" not in free
    assert "the fingers touch at an input of -0.516" in free
    assert "add --contact" in free


def test_large_rotation_reaches_stress_and_onset(tmp_path: Path) -> None:
    given = drive(tmp_path / "drive.csv", [-0.4, 0.0, 1.8])
    small, large = (
        json.loads(run(GRIPPER, "--kind", "lumped", *more, "--drive", given, "--json", "--out", tmp_path))["lumped"]
        for more in ((), ("--large-rotation",))
    )
    # Bricks: 6 % more force and 0.06 mm more gap at 1.8 mm, and the touch at -0.517 for -0.516.
    assert large["highest_force_n"] / small["highest_force_n"] == pytest.approx(1.06, abs=0.02)
    assert large["highest_gap_mm"] - small["highest_gap_mm"] == pytest.approx(0.06, abs=0.02)
    assert large["contact_input_mm"] / small["contact_input_mm"] == pytest.approx(0.517 / 0.516, abs=0.002)
    assert large["highest_stress_mpa"] != small["highest_stress_mpa"]
    assert large["input_at_yield_mm"] != small["input_at_yield_mm"]


@pytest.mark.slow
def test_the_picture_shows_the_physics_asked_for(tmp_path: Path) -> None:
    given = drive(tmp_path / "drive.csv", [-1.0, 0.0])
    pictures = []
    for more in ((), ("--contact",)):
        run(GRIPPER, "--kind", "finite_element", *more, "--drive", given, "--out", tmp_path)
        pictures.append((tmp_path / "deformed.png").read_bytes())
    assert pictures[0] != pictures[1]


def test_one_kinds_failure_leaves_the_others_their_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from fingervision.models import finite_element

    def refuse(*_: object, **__: object) -> None:
        raise FingervisionError("The outline could not be meshed.")

    monkeypatch.setattr(finite_element, "mesh_of", refuse)
    monkeypatch.setattr("fingervision.interface.prediction.build_model", build_model)  # and not an earlier one's model
    given = drive(tmp_path / "drive.csv", [0.0, 1.0])
    output = run(GRIPPER, "--drive", given, "--out", tmp_path / "o")
    assert "finite_element could not be computed: The outline could not be meshed." in output
    assert (tmp_path / "o" / "lumped" / "simulation.csv").exists()
    assert not (tmp_path / "o" / "finite_element").exists()
    assert "lumped" in (tmp_path / "o" / "models.csv").read_text()


def test_a_sweep_follows_the_thickness(tmp_path: Path) -> None:
    rows = json.loads(run(GRIPPER, "--vary", "hinge.thickness_mm=0.9:1.1:3", "--out", tmp_path, "--json"))
    # Finite elements of other outlines: 1.561, 2.004 and 2.513 N/mm.
    forces = [row["input_stiffness_n_mm"] for row in rows]
    assert forces[0] / forces[1] == pytest.approx(1.561 / 2.004, rel=0.01)
    assert forces[2] / forces[1] == pytest.approx(2.513 / 2.004, rel=0.01)
    assert (tmp_path / "vary.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("hinge.thickness_mm=1:2", "must be NAME=A:B:N"),
        ("hinge.thick=1:2:3", "must name a number of the drawing"),
        ("hinge.thickness_mm=1:2:100000", "must be NAME=A:B:N"),
        ("hinge.radius_mm=1:4:3", "is a closed hole"),
    ],
)
def test_what_cannot_be_swept_is_refused(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(FingervisionError, match=sentence):
        run(GRIPPER, "--vary", text, "--out", tmp_path)
    assert not (tmp_path / "vary.csv").exists()


def test_a_part_is_gripped(tmp_path: Path) -> None:
    output = run(GRIPPER, "--kind", "lumped", "--object-mm", "3", "--object-n-mm", "50", "--out", tmp_path)
    model = LumpedGripper(read_gripper(GRIPPER))
    touch = first_grip_mm(model, Part(3.0))
    assert touch is not None
    assert f"lumped: a part of 3 mm (50 N/mm) is touched at {touch:.4g} mm of input" in output
    rows = csv_rows(tmp_path / "grip.csv")
    held = [row for row in rows if row["held_width_mm"]]
    assert held
    for row in held:
        # The part gives way by its grip over its stiffness.
        assert float(row["held_width_mm"]) == pytest.approx(3.0 - float(row["grip_n"]) / 50.0, abs=1e-6)
    assert all(float(row["grip_n"]) == 0.0 for row in rows if float(row["input_mm"]) > touch + 1e-6)
    assert (tmp_path / "grip.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--object-mm", "-1"), "--object-mm must be the positive width"),
        (("--object-mm", "nan"), "--object-mm must be a number"),
        (("--object-mm", "3000"), "is it in micrometres"),
        (("--object-mm", "3", "--object-n-mm", "0"), "--object-n-mm must be a positive stiffness"),
        (("--object-n-mm", "5"), "--object-n-mm, the stiffness of the part, needs its width too: add --object-mm"),
    ],
)
def test_what_cannot_be_gripped_is_refused(tmp_path: Path, options: tuple[str, ...], sentence: str) -> None:
    with pytest.raises(UsageError, match=sentence):
        run(GRIPPER, "--kind", "lumped", "--out", tmp_path, *options)
    assert not (tmp_path / "grip.csv").exists()


def test_endurance_and_warmth_where_the_material_states_them(tmp_path: Path) -> None:
    stated = (
        "yield_mpa = 48.0\nthermal_expansion_per_k = 1e-4\nsn_line = { cycles = [1e3, 1e6], amplitude_mpa = [30, 12] }"
    )
    (tmp_path / "g.toml").write_text(GRIPPER.read_text().replace("yield_mpa = 48.0", stated))
    given = drive(tmp_path / "drive.csv", [-0.5, 1.5])
    output = run(tmp_path / "g.toml", "--kind", "lumped", "--drive", given, "--out", tmp_path)
    assert "Endurance between -0.5 and 1.5 mm (lumped, the material's S-N line, no scatter): about" in output
    (row,) = csv_rows(tmp_path / "models.csv")
    # From -0.5 to 1.5 mm: as much up and down as by 1 mm, about half of that; some 24 MPa fully reversed.
    by_mm = float(row["peak_stress_mpa_per_mm"])
    assert by_mm == pytest.approx(19.07, rel=NOTCH)
    expected = 1e3 * (by_mm / (1 - 0.5 * by_mm / 48) / 30) ** (np.log(1e3) / np.log(12 / 30))
    assert float(row["endurance_cycles"]) == pytest.approx(expected, rel=0.02)
    assert row["gap_per_kelvin_mm"] == ""
    # Three-dimensional elements: 2.06 N/mm, in plane stress 2.0014 N/mm.
    assert float(row["width_effect_force_percent"]) == pytest.approx(2.9, abs=0.5)
    assert "The plate's width of 3 mm restrains the flexures" in output
