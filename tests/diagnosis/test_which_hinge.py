"""Which hinge, link or pivot: responses to changes of each, tables with poses, and the place or set that is named."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli.diagnose import command
from fingervision.diagnosis.bodies.body_prediction import slip_mm
from fingervision.domain.errors import DataError, FingervisionError
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.lumped import MechanismFrame
from fingervision.models.place_answers import PlaceAnswers, PlaceChanges
from fingervision.storage.measured_table import read_measured_table
from fingervision.storage.mechanism_toml import mechanism_from_tables
from fingervision.tables.read import read_measured_table as read_any_table
from fingervision.tables.read import read_model
from tests.diagnosis.lever_drawing import TABLES, changed, write_toml

POSES = tuple(f"{body}.{part}" for body in ("finger", "shuttle") for part in ("x_mm", "y_mm", "angle_mrad"))
U_MM, U_MRAD = 0.0005, 0.02


@pytest.fixture(scope="module")
def answers() -> PlaceAnswers:
    return PlaceAnswers(mechanism_from_tables(TABLES, "lever"))


def truth(tables: dict, kind: type = MechanismPlate) -> dict[str, float]:
    """Poses about the drawn reference points, gap and force at 1 mm of input, by a model with a different mesh."""
    drawn = {body.name: body.centroid_mm for body in MechanismFrame(mechanism_from_tables(TABLES, "drawn")).bodies}
    state = kind(mechanism_from_tables(tables, "truth"))
    bodies = {body.name: body.centroid_mm for body in state.bodies}
    unit = state.state(1.0)
    found = {"gap_mm": unit.pairs_mm["gap"], "force_n": unit.force_n}
    for name, pose in unit.bodies.items():
        arm, turn = drawn[name] - bodies[name], 1e-3 * pose.angle_mrad
        found |= {f"{name}.x_mm": pose.x_mm - turn * arm[1], f"{name}.y_mm": pose.y_mm + turn * arm[0],
                  f"{name}.angle_mrad": pose.angle_mrad}  # fmt: skip
    return found


def by_name(answers: PlaceAnswers, changes: PlaceChanges | None = None) -> dict[str, float]:
    answer = answers.answer() if changes is None else answers.answer(changes)
    return dict(zip(answers.channels, answer.by_input.tolist(), strict=True))


def test_the_drawn_answer_is_the_frame_s_own(answers: PlaceAnswers) -> None:
    state, own = MechanismFrame(mechanism_from_tables(TABLES, "lever")).state(1.0), by_name(answers)
    for name, pose in state.bodies.items():
        got = (own[f"{name}.x_mm"], own[f"{name}.y_mm"], own[f"{name}.angle_mrad"])
        assert got == pytest.approx((pose.x_mm, pose.y_mm, pose.angle_mrad), rel=1e-6, abs=1e-7)
    assert own["force_n"] == pytest.approx(state.force_n, rel=1e-6)
    assert own["gap_mm"] == pytest.approx(state.pairs_mm["gap"] - np.hypot(21, 84), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("hinge", [0, 1])
def test_another_thickness_answers_as_a_drawing_of_it(answers: PlaceAnswers, hinge: int) -> None:
    thickness = answers.thickness_for(hinge, 0.2)
    assert 0.8 * 1.2 ** (1 / 3) < thickness < 0.8 * 1.2 ** (1 / 2)
    rebuilt = by_name(PlaceAnswers(mechanism_from_tables(changed(**{f"hinge_{hinge + 1}": {"thickness_mm": thickness}}),
                                                         "lever")))  # fmt: skip
    drawn, ours = by_name(answers), by_name(answers, PlaceChanges({hinge: 0.2}, {}, {}))
    for name in (*POSES, "force_n"):
        # Bodies that are meshed again differ by 1e-5 of a slope.
        scale = max(abs(rebuilt[n] - drawn[n]) + 2e-4 * abs(drawn[n]) for n in drawn if n[-4:] == name[-4:])
        assert ours[name] - drawn[name] == pytest.approx(rebuilt[name] - drawn[name], abs=0.05 * scale)


@pytest.mark.slow
def test_a_hinge_that_sits_elsewhere_turns_the_finger_by_the_lever_s_law(answers: PlaceAnswers) -> None:
    drawn, ours = by_name(answers), by_name(answers, PlaceChanges({}, {0: (0.17, 0.0)}, {}))
    fe = truth(changed(hinge_1={"at_mm": [35.17, 34]}))
    plain = truth(TABLES)
    assert ours["finger.angle_mrad"] / drawn["finger.angle_mrad"] == pytest.approx(17.0 / 17.17, abs=0.002)
    for name in ("finger.angle_mrad", "finger.x_mm"):
        assert ours[name] - drawn[name] == pytest.approx(fe[name] - plain[name], rel=0.1)


def test_a_pin_follows_its_load_and_stops_at_the_side_of_its_hole(answers: PlaceAnswers) -> None:
    answer, u = answers.answer(), np.array([-1.0, -1e-5, 0.0, 1e-5, 1.0])
    slip = slip_mm(answer, 0, u, 0.02)
    assert np.hypot(*slip[[0, -1]].T) == pytest.approx(0.01, rel=1e-3)
    assert slip[2] == pytest.approx(0.0)
    assert slip[0] == pytest.approx(-slip[-1])
    free = np.linalg.solve(answer.slip_stiffness[0], answer.load_by_input[0]) * 1e-5
    assert slip[3] == pytest.approx(free, rel=1e-2)
    # No other position of the pin within the clearance of the hole has less energy.
    force, stiffness = answer.load_by_input[0] * u[-1], answer.slip_stiffness[0]
    angle = np.linspace(0.0, 2.0 * np.pi, 721)
    rim = 0.01 * np.stack([np.cos(angle), np.sin(angle)])
    energy = 0.5 * np.einsum("in,ij,jn->n", rim, stiffness, rim) - force @ rim
    assert 0.5 * slip[-1] @ stiffness @ slip[-1] - force @ slip[-1] <= energy.min() * (1 - 1e-4)


def write_table(path: Path, slopes: dict[str, float], seed: int, rows: int = 120) -> Path:
    rng = np.random.default_rng(seed)
    half = np.linspace(-0.4, 0.8, rows // 2)
    u = np.concatenate([half, half[::-1]])
    gap = np.hypot(21, 84) + (slopes["gap_mm"] - np.hypot(21, 84)) * u + 0.0005 * rng.normal(size=u.size)
    with path.open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["input_mm", "gap_mm", "time_s", *POSES, *(f"u_{name}" for name in POSES), "note_mm"])
        for row, value in enumerate(u.tolist()):
            u_own = [U_MRAD if name.endswith("mrad") else U_MM for name in POSES]
            read = [slopes[name] * value + sd * rng.normal() for name, sd in zip(POSES, u_own, strict=True)]
            out.writerow([value, gap[row], 0.1 * row, *read, *u_own, "free text"])
    return path


def ask(table: Path, model: Path, out: Path) -> dict:
    done = CliRunner().invoke(command, [str(table), "--model", str(model), "--out", str(out), "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.output)


def test_channels_are_read_and_a_column_of_words_is_left_out(tmp_path: Path) -> None:
    slopes = dict.fromkeys(POSES, 1.0) | {"gap_mm": 90.0}
    table = read_measured_table(write_table(tmp_path / "a.csv", slopes, 1))
    assert set(table.channels) == set(POSES)
    assert table.channels["finger.x_mm"].u == pytest.approx(U_MM)
    assert any("note_mm" in note for note in table.notes)


def test_poses_and_gauges_row_by_row_are_refused_with_what_to_give(tmp_path: Path) -> None:
    rows = "".join(f"{k},{0.1 * k},finger,ok,0,0,0\n" for k in range(30))
    for header, name in (
        ("frame,time_s,body,status,x_mm,y_mm,angle_mrad", "bodies.csv"),
        ("frame,time_s,gauge,quantity,value,u,unit", "gauges.csv"),
    ):
        path = tmp_path / "table.csv"
        path.write_text(f"{header}\n{rows}")
        with pytest.raises(DataError, match=rf"{name}.*gaps\.csv"):
            read_any_table(path)


def check_sketch(page: str, slopes: dict[str, float]) -> None:
    """Check that the sketch on the page follows the recording over time and shows the magnified difference from the
    drawing.
    """
    data = json.loads(re.search(r'id="mechanism-data">(.*?)</script>', page).group(1))
    magnified = float(re.search(r"magnified ([\d.e+]+) times", page).group(1))
    frames, finger = data["frames"], data["names"].index("finger")
    times = [float(frame["at"].split(" s,")[0]) for frame in frames]
    assert times == sorted(times)
    assert len(times) == 24
    inputs = np.array([frame["input"] for frame in frames])
    assert inputs.argmax() in (11, 12), "there and back"
    drawn = truth(TABLES)
    for k, part in enumerate(("x_mm", "y_mm", "angle_mrad")):
        own = [frame["bodies"][finger] for frame in frames]
        seen = np.array([body["measured"][k] - body["predicted"][k] for body in own]) / magnified
        found = np.polyfit(inputs, seen, 1)[0]
        noise = (U_MRAD if k == 2 else U_MM) / np.sqrt(120.0) / np.std(inputs)
        assert found == pytest.approx(slopes[f"finger.{part}"] - drawn[f"finger.{part}"], abs=5.0 * noise + 2e-3)
    worst = max(frames, key=lambda frame: frame["bodies"][finger]["sigma"])["bodies"]
    assert "mrad" in worst[finger]["off"]
    assert [body["measured"] is None for body in worst] == [name == "pillar" for name in data["names"]]
    assert page.count('class="hinge told"') == 2
    assert 'type="range"' in page


@pytest.mark.slow
def test_the_place_is_named_and_the_corrected_model_agrees(tmp_path: Path) -> None:
    model = write_toml(tmp_path / "mechanism.toml")
    nothing = ask(write_table(tmp_path / "n.csv", truth(TABLES), 2), model, tmp_path / "n")
    assert nothing["verdict"] == "agrees", nothing["sentence"]
    assert "hinge_stiffness_error@hinge 1" in nothing["smallest_seen"]
    table = write_table(tmp_path / "l.csv", truth(changed(hinge_1={"at_mm": [35.3, 34]})), 3)
    found = ask(table, model, tmp_path / "l")
    first = found["effects"][0]
    assert first["name"] == "link_length_error"
    assert first["place"] == "finger, hinge 1 to hinge 2"
    assert first["parameters"]["ratio"]["value"] == pytest.approx(0.3 / 17.0, rel=0.1)
    assert any(place["channel"].startswith("finger.") and "hinge 1" in place["words"] for place in found["where"])
    check_sketch((tmp_path / "l" / "report.html").read_text(), truth(changed(hinge_1={"at_mm": [35.3, 34]})))
    again = ask(table, tmp_path / "l" / "model.toml", tmp_path / "again")
    assert not any("place" in effect for effect in again["effects"]), again["sentence"]


@pytest.mark.slow
def test_without_a_drawing_channels_are_not_compared_and_that_is_said(tmp_path: Path) -> None:
    slopes = truth(TABLES, MechanismFrame)
    table = write_table(tmp_path / "a.csv", slopes, 4)
    simulation = tmp_path / "s.csv"
    rest = np.hypot(21, 84)
    simulation.write_text("input_mm,gap_mm\n" + "\n".join(
        f"{u},{rest + (slopes['gap_mm'] - rest) * u}" for u in (-1.0, 0.0, 1.0)))  # fmt: skip
    found = ask(table, simulation, tmp_path / "o")
    assert any("has no bodies" in note for note in found["notes"])


@pytest.mark.slow
def test_a_place_that_the_drawing_has_not_is_refused(tmp_path: Path) -> None:
    write_toml(tmp_path / "mechanism.toml")
    path = tmp_path / "model.toml"
    path.write_text(
        'schema = 1\nbase = "mechanism.toml"\n[[effect]]\nname = "hinge_stiffness_error"\nplace = "hinge 7"\n'
        "[effect.parameters]\nratio = { value = 0.1, u = 0.01 }\n"
    )
    table = write_table(tmp_path / "a.csv", dict.fromkeys(POSES, 1.0) | {"gap_mm": 90.0}, 5)
    from fingervision.diagnosis.bodies.place_diagnosis import without_places

    with pytest.raises(FingervisionError, match="hinge 7"):
        without_places(read_measured_table(table), read_model(path))
