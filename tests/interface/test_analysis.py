"""`compare`, `diagnose`, `simulate` and `read_table`: the commands' results, from files and from memory."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import fingervision as fv
from fingervision.cli import cli
from fingervision.domain.errors import ArgumentError, ArgumentTypeError, UnknownNameError
from fingervision.interface.prediction import figures_text
from tests.commands import printed

PAPER = Path(__file__).parents[2] / "sample_frames/paper_run"
MEASURED, MODEL = PAPER / "measured.csv", PAPER / "gripper.csv"
SIMULATION = {"input_mm": [0.0, 1.0], "gap_mm": [1.0, 3.0]}


def table(offset_mm: float = 0.0, **more: object) -> dict[str, object]:
    inputs = np.linspace(0.0, 1.0, 60)
    noise = np.random.default_rng(1).normal(0.0, 1e-3, 60)
    return {"input_mm": inputs, "gap_mm": 1.0 + offset_mm + 2.0 * inputs + noise, **more}


def without_call(path: Path) -> dict[str, object]:
    document = json.loads(path.read_text())
    for key in ("command", "made_at"):
        document["provenance"].pop(key)
    document.pop("seconds", None)
    return document


def test_compare_saves_what_the_command_writes(tmp_path: Path) -> None:
    said = printed("compare", MEASURED, "--model", MODEL, "--out", tmp_path / "command")
    found = fv.compare(MEASURED, MODEL)
    found.save(tmp_path / "function")
    assert said.startswith(found.report())
    of_both = [sorted(each.name for each in (tmp_path / side).iterdir()) for side in ("command", "function")]
    assert of_both[0] == of_both[1]
    assert without_call(tmp_path / "command/compare.json") == without_call(tmp_path / "function/compare.json")
    same = "compare.png"
    assert (tmp_path / "command" / same).read_bytes() == (tmp_path / "function" / same).read_bytes()
    assert "in Python" in json.loads((tmp_path / "function/compare.json").read_text())["provenance"]["command"]


@pytest.mark.slow
def test_diagnose_saves_what_the_command_writes(tmp_path: Path) -> None:
    said = printed("diagnose", MEASURED, "--model", MODEL, "--out", tmp_path / "command")
    found = fv.diagnose(MEASURED, MODEL)
    found.save(tmp_path / "function")
    assert said.startswith(found.sentences())
    of_both = [sorted(each.name for each in (tmp_path / side).iterdir()) for side in ("command", "function")]
    assert of_both[0] == of_both[1]
    assert without_call(tmp_path / "command/report.json") == without_call(tmp_path / "function/report.json")
    assert (tmp_path / "command/model.toml").read_bytes() == (tmp_path / "function/model.toml").read_bytes()


def test_several_models_are_told_apart_by_name() -> None:
    found = fv.compare(table(), {"right": SIMULATION, "wrong": {"input_mm": [0, 1], "gap_mm": [1.5, 3.5]}})
    assert list(found) == ["right", "wrong"]
    assert not found["right"].places
    assert found["wrong"].rms_mm == pytest.approx(0.5, abs=0.01)
    with pytest.raises(fv.UsageError):
        fv.compare(MEASURED, [MODEL, MODEL])
    with pytest.raises(ArgumentTypeError):
        fv.compare(MEASURED, [])


def test_a_required_effect_that_is_hardly_there_is_measured_beside_two_that_are() -> None:
    """A play of 0.05 mm and an offset of 0.05 mm; a scale of the input that is asked for is zero within its U."""
    rng, play_mm, slope = np.random.default_rng(4), 0.05, 5.0
    input_mm = 0.4 - 0.4 * np.cos(np.linspace(0.0, 4.0 * np.pi, 240))
    passed_on, at_mm = [], input_mm[0] + 0.5 * play_mm
    for place_mm in input_mm:
        at_mm = min(max(at_mm, place_mm - 0.5 * play_mm), place_mm + 0.5 * play_mm)
        passed_on.append(at_mm)
    gap_mm = 2.05 + slope * np.array(passed_on) + rng.normal(0.0, 0.001, input_mm.size)
    measured = {"input_mm": input_mm, "gap_mm": gap_mm, "time_s": 0.04 * np.arange(input_mm.size)}
    model = {"input_mm": [-1.0, 0.0, 2.0], "gap_mm": [2.0 - slope, 2.0, 2.0 + 2.0 * slope]}
    found = fv.diagnose(measured, model, with_effects=["input_scale"])
    by_name = {effect.name: effect.parameters for effect in found.effects}
    assert by_name.keys() >= {"input_scale", "backlash"}
    (ratio,), (play,) = by_name["input_scale"].values(), by_name["backlash"].values()
    assert abs(ratio.value) < 3.0 * ratio.u
    assert play.value == pytest.approx(play_mm, abs=3.0 * play.u)
    assert np.std(found.residual_after_mm["gap"]) < 0.002


def test_a_required_effect_that_the_data_do_not_show_is_refuted_in_words() -> None:
    sound = fv.diagnose(table(0.0), SIMULATION, with_effects=["rest_gap_error"])
    assert sound.verdict == "agrees"
    assert any("rest_gap_error was required" in note and "20 to 1" in note for note in sound.report.notes)
    beside = fv.diagnose(table(0.02), SIMULATION, with_effects=["end_stop"])
    assert {effect.name for effect in beside.effects} >= {"end_stop"}
    assert any("end_stop was required" in note and "20 to 1" in note for note in beside.report.notes)


def test_the_corrected_model_answers_and_is_written(tmp_path: Path) -> None:
    found = fv.diagnose(table(0.02), SIMULATION, with_effects=["rest_gap_error"])
    assert {effect.name for effect in found.effects} == {"rest_gap_error"}
    before, after = found.residual_before_mm["gap"], found.residual_after_mm["gap"]
    assert np.mean(before) == pytest.approx(0.02, abs=1e-3)
    assert abs(np.mean(after)) < 1e-3
    inputs = [0.0, 0.5, 1.0]
    own = fv.simulate(found.corrected_model, inputs).gap_mm
    assert own == pytest.approx([1.02, 2.02, 3.02], abs=1e-3)
    written = fv.simulate(found.save(tmp_path / "out") / "model.toml", inputs).gap_mm
    assert written == pytest.approx(own, abs=1e-8)
    assert fv.compare(table(0.02), found).rms_mm < 1.2e-3
    assert "<img" in found._repr_html_()
    assert "\n" not in repr(found)


def test_a_data_frame_is_the_table_of_its_file(tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.read_csv(MEASURED, comment="#")
    of_file, of_frame = fv.read_table(MEASURED), fv.compare(frame, MODEL).first.data.table
    assert np.array_equal(of_file.gap_mm, of_frame.gap_mm)
    assert np.array_equal(of_file.input_mm, of_frame.input_mm)
    frame.to_csv(tmp_path / "table.csv", index=False)
    assert fv.compare(frame, MODEL).rms_mm == fv.compare(tmp_path / "table.csv", MODEL).rms_mm


def test_simulate_takes_any_drive(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text("time_s,input_mm\n0,0\n1,0.5\n2,1\n")
    bare = fv.simulate(SIMULATION, np.array([0.0, 0.5, 1.0]))
    for drive in (path, fv.read_table(path, "drive"), {"time_s": [0, 1, 2], "input_mm": [0, 0.5, 1]}):
        timed = fv.simulate(SIMULATION, drive)
        assert timed.gap_mm.tolist() == bare.gap_mm.tolist() == [1.0, 2.0, 3.0]
        assert timed.time_s is not None
    assert bare.right_mm.tolist() == [0.5, 1.0, 1.5]
    again = fv.read_table(bare.save(tmp_path / "simulation.csv"), "simulation")
    assert again.input_mm.tolist() == [0.0, 0.5, 1.0]
    assert "<img" in bare._repr_html_()


@pytest.mark.slow
def test_a_gripper_answers_as_the_model_command(tmp_path: Path) -> None:
    gripper = PAPER.parent / "paper/gripper.toml"
    printed("model", gripper, "--kind", "lumped", "--out", tmp_path / "model")
    simulated = fv.read_table(tmp_path / "model/simulation.csv", "simulation")
    inside = simulated.input_mm[(simulated.input_mm > -0.05) & (simulated.input_mm < 0.2)]
    answer = fv.simulate(gripper, inside, kind="lumped")
    assert answer.gap_mm == pytest.approx(simulated.respond(inside).gap_mm, rel=1e-7)


@pytest.mark.parametrize(
    ("call", "argument"),
    [
        (lambda: fv.compare(np.zeros((4, 4)), MODEL), "measured"),
        (lambda: fv.compare([1, 2, 3], MODEL), "measured"),
        (lambda: fv.compare({"input_mm": [1, 2]}, MODEL), "measured"),
        (lambda: fv.compare({"input_mm": [1, 2], "gap_mm": [1]}, MODEL), "measured"),
        (lambda: fv.compare({"input_mm": [1, 2], "gap_mm": ["a", 1]}, MODEL), "measured"),
        (lambda: fv.compare(MEASURED, None), "model"),
        (lambda: fv.compare(MEASURED, np.zeros(3)), "model"),
        (lambda: fv.compare(MEASURED, {"input_mm": [0, 1]}), "model"),
        (lambda: fv.compare(MEASURED, MODEL, seed=-1), "seed"),
        (lambda: fv.compare(MEASURED, MODEL, kind="lumpd"), "kind"),
        (lambda: fv.diagnose(MEASURED, MODEL, with_effects="backlahs"), "with_effects"),
        (lambda: fv.diagnose(MEASURED, MODEL, with_effects=["backlash"], without_effects=["backlash"]), "with_effects"),
        (lambda: fv.diagnose(MEASURED, MODEL, effects=["backlash"]), "effects"),
        (lambda: fv.simulate(SIMULATION, [0.0, 2.0]), "drive"),
        (lambda: fv.simulate(SIMULATION, []), "drive"),
        (lambda: fv.simulate(SIMULATION, [0.0, float("nan")]), "drive"),
        (lambda: fv.simulate(SIMULATION, ["a", "b"]), "drive"),
        (lambda: fv.simulate(SIMULATION, {"time_s": [0, 1]}), "drive"),
        (lambda: fv.read_table(MEASURED, "mesured"), "kind"),
        (lambda: fv.read_table(None), "path"),
        (lambda: fv.read_table(""), "path"),
        (lambda: fv.read_model(3), "path"),
    ],
)
def test_names_the_argument_that_cannot_be_meant(call, argument: str) -> None:
    with pytest.raises(ArgumentError) as refused:
        call()
    assert refused.value.argument == argument
    assert str(refused.value).startswith(argument)
    assert "--" not in str(refused.value).replace("`fingervision", "")


def test_tells_the_nearest_effect_in_either_world() -> None:
    with pytest.raises(UnknownNameError) as refused:
        fv.diagnose(MEASURED, MODEL, without_effects=["backlahs"])
    assert refused.value.nearest == "backlash"
    ended = CliRunner().invoke(cli, ["diagnose", str(MEASURED), "--model", str(MODEL), "--without", "backlahs"])
    assert isinstance(ended.exception, UnknownNameError)
    assert str(ended.exception).startswith("--without must")


def test_a_measurement_without_a_drive_is_no_table() -> None:
    measured = fv.measure(np.zeros((480, 640), np.uint8), px_per_mm=34)
    with pytest.raises(fv.UsageError) as refused:
        fv.compare(measured, MODEL)
    assert "drive" in str(refused.value)


@pytest.mark.slow
def test_a_measurement_is_the_table_of_its_file(tmp_path: Path) -> None:
    samples = PAPER.parent / "table1"
    rates = [row.split(",") for row in (samples / "expected_gaps.csv").read_text().splitlines()[1:]]
    inputs = np.linspace(0.0, 1.0, len(rates))
    drive = {"time_s": np.arange(len(rates)) / 10.0, "input_mm": inputs}
    measured = fv.measure(
        samples, calibration=samples / "calibration.json", rate_hz=10.0, drive=drive, drive_offset_s=0.0
    )
    of_memory = measured.measured_table()
    of_file = fv.read_table(measured.save(tmp_path / "out") / "gaps.csv")
    for name in ("input_mm", "gap_mm", "midline_mm", "time_s", "u_random_mm"):
        assert np.array_equal(getattr(of_memory, name), getattr(of_file, name)), name
    assert of_memory.run_names == of_file.run_names
    assert of_memory.notes == of_file.notes


def test_a_ratio_has_no_unit_in_a_table_of_figures() -> None:
    words = figures_text("", {"frame": {"gap_mm": 8.5, "safety_factor": 2.0, "tip_mm [mm/N]": 0.1}})
    assert [line.split()[:-1] for line in words.splitlines()[1:]] == [
        ["gap_mm", "[mm]"],
        ["safety_factor"],
        ["tip_mm", "[mm/N]"],
    ]
