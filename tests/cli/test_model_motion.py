"""`fingervision model` in motion: --drive, --frequency, --modes, and what they refuse."""

import json
from functools import partial
from pathlib import Path

import av
import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli._model_motion import for_picture
from fingervision.cli.compare import command as compare
from fingervision.diagnosis.diagnose import diagnose
from fingervision.domain.drive import DriveHistory
from fingervision.domain.errors import DataError, FingervisionError, ModelError, UsageError
from fingervision.models.lumped import LumpedGripper
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.model_toml import read_model
from tests.commands import printed
from tests.csv_rows import csv_rows

ROOT = Path(__file__).parents[2]
GRIPPER = ROOT / "sample_frames" / "paper" / "gripper.toml"
FOUR_BAR = ROOT / "fingervision" / "models" / "mechanisms" / "four_bar_gripper.toml"


run = partial(printed, "model")


def table(path: Path) -> np.ndarray:
    return np.genfromtxt(path, delimiter=",", names=True)


def slow_drive(path: Path) -> Path:
    time_s = np.arange(0.0, 40.0, 0.1)
    inputs = np.interp(time_s, [0, 2, 12, 14, 24, 30, 38, 40], [0, 0, 1.5, 1.5, -0.3, 0.5, 1.2, 1.2])
    rows = (f"{t:.3f},{u:.6f}\n" for t, u in zip(time_s, inputs, strict=True))
    path.write_text("time_s,input_mm\n" + "".join(rows))
    return path


def test_a_drive_is_answered_over_its_time(tmp_path: Path) -> None:
    given = tmp_path / "drive.csv"
    given.write_text("time_s,input_mm\n0,0\n0.001,0.2\n0.02,0.2\n")
    output = run(GRIPPER, "--kind", "lumped", "--drive", given, "--rate-hz", "5000", "--out", tmp_path / "o")
    assert "lumped in time by 8 modes" in output
    rows = table(tmp_path / "o" / "response.csv")
    assert rows["time_s"][-1] == 0.02
    assert rows.size == 101
    still = 4.0 + 0.2 * 7.7477
    assert np.abs(rows["gap_mm"] - still)[30:].max() > 0.05
    assert np.mean(rows["gap_mm"][30:]) == pytest.approx(still, abs=0.03)
    assert rows["gap_mm"] == pytest.approx(rows["right_mm"] - rows["left_mm"], abs=3e-8)
    assert (tmp_path / "o" / "response.png").read_bytes().startswith(b"\x89PNG")


def test_the_response_is_a_measured_table(tmp_path: Path) -> None:
    run(GRIPPER, "--kind", "stiffness_matrix", "--drive", slow_drive(tmp_path / "drive.csv"), "--out", tmp_path / "o")
    measured, simulated = tmp_path / "o" / "response.csv", tmp_path / "o" / "simulation.csv"
    arguments = [str(measured), "--model", str(simulated), "--out", str(tmp_path / "c"), "--json"]
    result = CliRunner().invoke(compare, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    assert json.loads(result.stdout)["rms_mm"] < 1e-5


@pytest.mark.slow
def test_the_force_channel_of_diagnose_works_from_a_model(tmp_path: Path) -> None:
    """Hinges of 1.1 mm in place of 1.0: a quarter more force by finite elements, 0.25 % less gap."""
    thick = tmp_path / "thick.toml"
    thick.write_text(GRIPPER.read_text().replace("\nthickness_mm = 1.0", "\nthickness_mm = 1.1"))
    given = slow_drive(tmp_path / "drive.csv")
    run(thick, "--kind", "lumped", "--drive", given, "--out", tmp_path / "true")
    run(GRIPPER, "--kind", "lumped", "--drive", given, "--out", tmp_path / "drawn")
    rng = np.random.default_rng(17)
    rows = table(tmp_path / "true" / "response.csv")
    left, right, force = (
        rows[name] + rng.normal(0.0, noise, rows.size)
        for name, noise in (("left_mm", 0.002), ("right_mm", 0.002), ("force_n", 0.01))
    )
    columns = (rows["time_s"], rows["input_mm"], right - left, left, right, force)
    measured = tmp_path / "measured.csv"
    header = "time_s,input_mm,gap_mm,left_mm,right_mm,force_n"
    np.savetxt(measured, np.column_stack(columns), "%.6f", ",", header=header, comments="")
    model = read_model(tmp_path / "drawn" / "simulation.csv")
    report = diagnose(read_measured_table(measured), model, seed=1).report
    found = {effect.name: effect.parameters for effect in report.effects}
    assert found["hinge_stiffness_error"]["ratio"].value == pytest.approx(2.513 / 2.004 - 1.0, abs=0.01)


def test_frequency_response_peaks_at_the_modes(tmp_path: Path) -> None:
    output = run(GRIPPER, "--kind", "lumped", "--frequency", "1:500", "--damping", "modal:0.01", "--out", tmp_path)
    rows = csv_rows(tmp_path / "frequency.csv")
    f = np.array([float(row["frequency_hz"]) for row in rows])
    columns = ("gap_per_input_mm_mm", "gap_per_force_mm_n")
    by_input, by_force = (np.array([float(row[column]) for row in rows]) for column in columns)
    lumped = LumpedGripper(read_gripper(GRIPPER))
    assert f[by_input.argmax()] == pytest.approx(lumped.modes_hz(drive_held=True)[0], rel=0.001)
    assert f[by_force.argmax()] == pytest.approx(lumped.modes_hz(drive_held=False)[0], rel=0.001)
    # At 1 Hz as at rest; at the peak 1 / (2 zeta) times.
    assert by_input[0] == pytest.approx(lumped.figures().gap_per_input, rel=1e-3)
    assert by_force.max() / by_force[0] == pytest.approx(50.0, rel=0.02)
    assert "gap per force:" in output
    assert (tmp_path / "frequency.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_modes_up_to_a_frequency_and_their_film(tmp_path: Path) -> None:
    run(GRIPPER, "--kind", "lumped", "--modes", "1500Hz", "--film", "--out", tmp_path)
    rows = csv_rows(tmp_path / "modes.csv")
    values = [float(row["frequency_hz"]) for row in rows]
    assert max(values) < 1500.0
    assert [row["family"] for row in rows].count("drive held") == 2
    with av.open(str(tmp_path / "modes.mp4")) as film:
        frames = [frame.to_ndarray(format="gray") for frame in film.decode(video=0)]
    assert len(frames) == 96
    # Half a period apart the bodies stand elsewhere, a period apart at the same place.
    assert np.abs(frames[0].astype(float) - frames[12]).max() > 50.0
    assert np.abs(frames[0].astype(float) - frames[24]).mean() < 2.0


@pytest.mark.slow
def test_a_mechanism_moves_too(tmp_path: Path) -> None:
    given = tmp_path / "drive.csv"
    given.write_text("time_s,input_mm\n" + "".join(f"{0.05 * i},{0.1 * i / 4:.4f}\n" for i in range(5)))
    run(FOUR_BAR, "--drive", given, "--frequency", "1:200", "--modes", "2", "--large-rotation", "--out", tmp_path)
    rows, at = table(tmp_path / "response.csv"), table(tmp_path / "mechanism.csv")
    assert rows["time_s"].size == 5
    assert rows["tip_x_mm"][-1] == pytest.approx(at["tip_x_mm"][-1], rel=0.01)
    assert rows["force_n"][-1] == pytest.approx(at["force_n"][-1], rel=0.05)
    for name in ("response.png", "frequency.png", "modes.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--frequency", "500:1"), r"--frequency must be A:B, two positive frequencies"),
        (("--frequency", "0:10"), r"--frequency must be A:B"),
        (("--frequency", "1"), r"--frequency must be A:B"),
        (("--frequency", "nan:inf"), r"--frequency must be A:B"),
        (("--frequency", "1:1e9"), r"must end within the first \d+ modes, below .* Hz, but ends at 1e\+09 Hz"),
        (("--frequency", "1:500", "--damping", "modal:2"), r"must give a damping ratio below 0.3"),
        (
            ("--frequency", "1:1e4", "--damping", "paper"),
            r"is valid for modes up to 3\d\d.* Hz only .* end the band below",
        ),
        (("--modes", "0"), r"--modes must be a number from 1 to 40, or a positive frequency"),
        (("--modes", "-5Hz"), r"--modes must be"),
        (("--modes", "many"), r"--modes must be"),
        (("--modes", "1e9Hz"), r"--modes must end within"),
        (("--film",), r"--film needs --modes"),
        (("--rate-hz", "100"), r"--rate-hz sets the rows a second of response.csv"),
        (("--damping", "wood"), r"--damping must be modal"),
    ],
)
def test_wrong_motion_is_refused(tmp_path: Path, options: tuple[str, ...], sentence: str) -> None:
    with pytest.raises(UsageError, match=sentence):
        run(GRIPPER, "--kind", "stiffness_matrix", "--out", tmp_path, *options)
    assert not list(tmp_path.glob("frequency.*"))
    assert not list(tmp_path.glob("modes.*"))


@pytest.mark.parametrize(
    ("text", "options", "sentence"),
    [
        ("time_s,input_mm\n0,0\n1,x\n", (), "input_mm must be a finite number, but is 'x' in line 3 of"),
        ("time_s,input_mm\n0,0\n0,1\n", (), "time_s must increase from row to row"),
        ("time_s,input_mm\n0,0\n1,0\n", (), "must hold at least two different inputs"),
        ("time_s,input_mm\n0,0\n1,1500\n", (), "are they micrometres"),
        ("input_mm\n0\n1\n", (), "must hold rows of two numbers or more"),
        ("time_s,input_mm\n0,0\n1,1\n", ("--rate-hz", "-5"), "--rate-hz must be a positive number"),
        ("time_s,input_mm\n0,0\n1,1\n", ("--rate-hz", "1e9"), "--rate-hz must give at most 2000000 rows"),
        ("time_s,input_mm\n0,0\n1,1\n", ("--rate-hz", "nan"), "--rate-hz must be a number"),
    ],
)
def test_wrong_drives_are_refused(tmp_path: Path, text: str, options: tuple[str, ...], sentence: str) -> None:
    given = tmp_path / "drive.csv"
    given.write_text(text)
    with pytest.raises(FingervisionError, match=sentence):
        run(GRIPPER, "--kind", "lumped", "--drive", given, "--out", tmp_path / "o", *options)
    assert not (tmp_path / "o" / "response.csv").exists()


def test_a_mechanism_is_varied(tmp_path: Path) -> None:
    rows = json.loads(run(FOUR_BAR, "--vary", "lengths.t=0.7:0.9:2", "--out", tmp_path, "--json"))
    ratio = rows[1]["input_stiffness_n_mm"] / rows[0]["input_stiffness_n_mm"]
    # Guided leaves, t^3, on roots that turn by 16.67 M / (pi E b t^2) (O'Donnell): softer by 2.653 t / L.
    roots = (1.0 + 2.653 * 0.9 / 30.0) / (1.0 + 2.653 * 0.7 / 30.0)
    assert ratio == pytest.approx((0.9 / 0.7) ** 3 / roots, rel=0.005)
    assert (tmp_path / "vary.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("lengths.x=1:2:3", "no number called lengths.x"),
        ("lengths.t=-1:2:3", "The variant lengths.t = -1 could not be computed"),
        ("lengths.t=0.5:1:900", "must give at most 400 drawings, but gives 900"),
    ],
)
def test_a_mechanism_that_cannot_be_varied_so(tmp_path: Path, text: str, sentence: str) -> None:
    with pytest.raises(FingervisionError, match=sentence):
        run(FOUR_BAR, "--vary", text, "--out", tmp_path)
    assert not (tmp_path / "vary.csv").exists()


def test_uncertain_numbers_give_every_figure_its_own(tmp_path: Path) -> None:
    modulus = "youngs_modulus_mpa = { value = 1650.0, u = 33.0 }"
    stated = GRIPPER.read_text().replace("youngs_modulus_mpa = 1650.0", modulus)
    (tmp_path / "g.toml").write_text(stated.replace("l2_mm = 17.82", "l2_mm = { value = 17.82, u = 0.1 }"))
    output = run(tmp_path / "g.toml", "--kind", "lumped", "--out", tmp_path)
    rows = {row["figure"]: row for row in csv_rows(tmp_path / "uncertainty.csv")}
    # The slope goes with the lever alone (5.3 % a mm), stress with the modulus, frequency with its root.
    assert float(rows["gap_per_input"]["u"]) == pytest.approx(0.0053 * 7.75, rel=0.05)
    assert rows["gap_per_input"]["first"] == "lever.l2_mm"
    assert rows["peak_stress_mpa_per_mm"]["first"] == "material.youngs_modulus_mpa"
    assert float(rows["first_mode_drive_held_hz"]["u"]) == pytest.approx(0.01 * 359.2, rel=0.05)
    assert {row["method"] for row in rows.values()} == {"linear"}
    assert "gap_per_input" in output
    assert "lever.l2_mm 100 %" in output


def test_an_uncertain_list_is_refused(tmp_path: Path) -> None:
    stated = GRIPPER.read_text().replace("hinge1_mm = [35.5, 30.0]", "hinge1_mm = { value = [35.5, 30.0], u = 0.1 }")
    (tmp_path / "g.toml").write_text(stated)
    with pytest.raises(DataError, match=r"lever.hinge1_mm in .* is a list and can have no uncertainty"):
        run(tmp_path / "g.toml", "--kind", "lumped", "--out", tmp_path / "o")


def test_an_uncertainty_beyond_sense_leaves_no_results(tmp_path: Path) -> None:
    stated = GRIPPER.read_text().replace("\nthickness_mm = 1.0", "\nthickness_mm = { value = 1.0, u = 2.0 }")
    (tmp_path / "g.toml").write_text(stated)
    with pytest.raises(ModelError, match=r"The uncertainty of hinge.thickness_mm is too large: .* positive"):
        run(tmp_path / "g.toml", "--kind", "lumped", "--out", tmp_path / "o")
    assert not (tmp_path / "o").exists()


def test_the_plot_of_three_rows_shows_the_first_touch_and_the_vibration() -> None:
    """Rows between the drive's own, in each run; the drive's stay, and a dense drive is left alone."""
    drive = DriveHistory(np.array([0.0, 1.0, 2.0, 0.0, 4.0]), np.array([0.0, -1.0, 0.5, 0.0, 1.0]),
                         ("a", "a", "a", "b", "b"))  # fmt: skip
    finer = for_picture(drive, 359.0)
    runs = np.array(finer.run)
    for name, own in (("a", [0.0, 1.0, 2.0]), ("b", [0.0, 4.0])):
        times = finer.time_s[runs == name]
        assert set(own) <= set(times)
        assert np.all(np.diff(times) > 0.0)
        assert np.diff(times).max() < 0.002 * np.ptp(times)
        assert np.diff(times)[:200].max() < 0.1 / 359.0
    assert np.allclose(finer.input_mm[runs == "a"], np.interp(finer.time_s[runs == "a"], [0, 1, 2], [0, -1, 0.5]))
    dense = DriveHistory(np.arange(700.0), np.zeros(700))
    assert for_picture(dense, 359.0) is dense
