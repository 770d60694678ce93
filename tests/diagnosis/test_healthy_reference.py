"""What changed since a healthy recording: sizes and places against a plant of other elements, and its pictures."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli.diagnose import command
from fingervision.diagnosis.bodies.body_evidence import drawing_of
from fingervision.diagnosis.bodies.healthy_reference import HealthyReference, Recording
from fingervision.diagnosis.bodies.reference_report import Compared, change_words, drawing_svg, gap_changes
from fingervision.domain.body_poses import FlexureOutline
from fingervision.domain.errors import DataError
from fingervision.models.mechanism_bodies import column_name
from fingervision.models.place_answers import PARTS, PlaceAnswers, PlaceChanges
from fingervision.storage.bodies_csv import flexures_beside, write_flexures
from fingervision.storage.mechanism_toml import read_mechanism
from fingervision.storage.model_toml import read_model
from tests.benchmarks.healthy_reference import DRAWINGS, Plant, changed, filmed, inputs_of

SAMPLES = Path(__file__).parents[2] / "sample_frames"
UM = 1e-3
U_OUTLINE_MM = 2.0 * UM
"""Uncertainty of a thickness at 10 px/mm (`tests.benchmarks.healthy_reference`)."""


@pytest.fixture(scope="module")
def answers() -> PlaceAnswers:
    return PlaceAnswers(read_mechanism(DRAWINGS / "three_leaves.toml"))


def outlines(answers, rng, **thinner):
    """Flexures at rest as a camera that is set up anew sees them, with some of them thinner (mm)."""
    found, laid, wider = {}, rng.normal(0.0, 5.0 * UM, 2), rng.normal(0.0, 3.0 * UM)
    for flexure in answers.mechanism.flexures:
        angle = np.deg2rad(flexure.axis_deg)
        across = float(laid @ (-np.sin(angle), np.cos(angle))) + rng.normal(0.0, U_OUTLINE_MM)
        thickness = flexure.thickness_mm + wider + rng.normal(0.0, U_OUTLINE_MM) - thinner.get(flexure.name, 0.0)
        found[flexure.name] = FlexureOutline(flexure.name, 5, (thickness, U_OUTLINE_MM), None, (across, U_OUTLINE_MM))
    return found


def motion(mechanism, rng, gain=0.0, sd=(1e-3, 1e-3, 0.03)):
    """Poses of the stage as the plant moves it, with noise."""
    plant, inputs = Plant.of(mechanism), inputs_of(0.4, 36, rng)
    moving = [n for n, body in enumerate(plant.bodies) if not body.is_fixed]
    poses = plant.poses(inputs)[:, moving] * np.array([1.0, 1.0, 1e3])
    values = poses.reshape(inputs.size, -1)
    floors = np.tile(sd, len(moving))
    values = values + rng.normal(size=values.shape) * floors
    channels = tuple(f"{plant.bodies[n].name}.{part}" for n in moving for part in PARTS)
    return channels, Recording.of(inputs * (1.0 + gain), values, (slice(0, inputs.size),), floors, timed=True)


def test_a_thinner_leaf_is_named_by_its_outline(answers: PlaceAnswers) -> None:
    rng = np.random.default_rng(4)
    seen = outlines(answers, rng), outlines(answers, rng, right=35.0 * UM)
    found = HealthyReference(answers, (), None, None, seen).run()
    assert found.places == ("right",)
    best = found.members[0]
    assert best.change.kind == "thickness"
    assert best.size == pytest.approx(-35.0 * UM, abs=3.0 * best.u)
    assert "35" in change_words(best, answers) or "thinner" in change_words(best, answers)


def test_sound_outlines_are_seldom_accused(answers: PlaceAnswers) -> None:
    """One false claim in a thousand is allowed; in 20 pairs none is expected."""
    rng = np.random.default_rng(9)
    claims = sum(
        HealthyReference(answers, (), None, None, (outlines(answers, rng), outlines(answers, rng))).run().changed
        for _ in range(20)
    )
    assert claims == 0


def test_the_smallest_change_seen_is_claimed_about_half_the_time(answers: PlaceAnswers) -> None:
    rng = np.random.default_rng(3)
    sound = HealthyReference(answers, (), None, None, (outlines(answers, rng), outlines(answers, rng))).run()
    size = sound.smallest["left"].size
    claims = [
        HealthyReference(answers, (), None, None, (outlines(answers, rng), outlines(answers, rng, left=size))).run()
        for _ in range(20)
    ]
    assert 5 <= sum(found.changed for found in claims) <= 15


def test_a_gauge_that_was_set_up_anew_is_no_fault(answers: PlaceAnswers) -> None:
    rng = np.random.default_rng(2)
    channels, healthy = motion(answers.mechanism, rng)
    _, again = motion(answers.mechanism, rng, gain=0.003)
    found = HealthyReference(answers, channels, healthy, again, ({}, {})).run()
    assert not found.told


def test_a_leaf_that_is_much_softer_changes_the_motion(answers: PlaceAnswers) -> None:
    """The plant's own leaf is a quarter thinner: the stage turns otherwise, and the leaf is among the places told."""
    rng = np.random.default_rng(6)
    channels, healthy = motion(answers.mechanism, rng)
    _, faulty = motion(changed(answers.mechanism, "left", "thickness", -0.25), rng)
    found = HealthyReference(answers, channels, healthy, faulty, ({}, {})).run()
    assert found.changed
    assert not found.places or "left" in found.places


def test_rendered_leaves_differ_by_what_was_taken_off() -> None:
    rng = np.random.default_rng(7)
    drawn = read_mechanism(DRAWINGS / "three_leaves.toml")
    still = np.zeros(3)
    healthy = filmed(drawn, Plant.of(drawn), still, rng).flexures
    faulty = filmed(drawn, Plant.of(changed(drawn, "right", "thickness", -0.05)), still, rng).flexures
    by = {name: faulty[name].thickness_mm[0] - healthy[name].thickness_mm[0] for name in healthy}
    u = float(np.hypot(healthy["right"].thickness_mm[1], faulty["right"].thickness_mm[1]))
    assert by["right"] - 0.5 * (by["left"] + by["leaning"]) == pytest.approx(-35.0 * UM, abs=4.0 * u)


def gap_recording(rng, rest_mm=0.0, ratio=0.0, reversal_mm=0.0):
    way = np.linspace(-0.3, 1.2, 80)
    inputs = np.concatenate([way, way[::-1]])
    sign = np.repeat([1.0, -1.0], 80)
    gap = 1.02 + rest_mm + (7.7 + ratio) * inputs + 0.05 * inputs**2 + 0.5 * reversal_mm * sign
    values = (gap + rng.normal(0.0, 1e-3, inputs.size))[:, None]
    return Recording.of(inputs, values, (slice(0, inputs.size),), np.array([1e-3]), timed=True)


def test_two_days_of_the_gap_alone() -> None:
    rng = np.random.default_rng(5)
    healthy, sound = gap_recording(rng), gap_recording(rng)
    assert not any(one.is_significant for one in gap_changes(healthy, sound))
    worn = {one.name: one for one in gap_changes(healthy, gap_recording(rng, 0.01, 0.1, 0.006))}
    assert worn["ratio of gap to input"].change == pytest.approx(0.1, abs=3.0 * worn["ratio of gap to input"].u)
    assert worn["reversal"].change == pytest.approx(0.006, abs=3.0 * worn["reversal"].u)
    assert all(worn[name].is_significant for name in ("rest gap", "ratio of gap to input", "reversal"))
    assert not worn["bend"].is_significant
    # A zero of the input that is off by 1.3 um would change the rest gap as much, but would not change the reversal.
    assert not worn["rest gap"].is_of_the_part
    assert worn["reversal"].is_of_the_part


def test_flexures_are_written_and_read(tmp_path: Path) -> None:
    seen = [FlexureOutline("a", 3, (0.5, 0.001), (0.01, 0.002), (0.0, 0.001)),
            FlexureOutline("leaf b", 3, (0.6, 0.001), None, (-0.02, 0.001))]  # fmt: skip
    write_flexures(tmp_path / "flexures.csv", seen)
    assert flexures_beside(tmp_path / "gaps.csv") == {one.flexure: one for one in seen}
    assert flexures_beside(tmp_path / "elsewhere" / "gaps.csv") == {}
    (tmp_path / "flexures.csv").write_text("flexure\nx\n")
    with pytest.raises(DataError, match=r"flexures\.csv"):
        flexures_beside(tmp_path / "gaps.csv")


def test_the_drawing_is_coloured_by_the_evidence(answers: PlaceAnswers) -> None:
    rng = np.random.default_rng(4)
    seen = outlines(answers, rng), outlines(answers, rng, right=35.0 * UM)
    found = HealthyReference(answers, (), None, None, seen).run()
    told = Compared(found, (), answers, True, (), ())
    assert told.verdict == "changed"
    assert drawing_svg(told).count('stroke="#111"') == 1
    nothing = replace(told, found=replace(found, changed=False, members=()))
    assert nothing.verdict == "unchanged"
    assert nothing.document()["places"] == []
    assert "do not differ" in nothing.sentences()[0]


def test_what_a_gauge_would_change_is_not_called_no_difference() -> None:
    rng = np.random.default_rng(5)
    moved = gap_changes(gap_recording(rng), gap_recording(rng, 0.02))
    answer = Compared(None, moved, None, False, (), ())
    assert answer.verdict == "unchanged"
    assert "gauge of the input" in answer.sentences()[0]


@pytest.fixture
def two_days(tmp_path: Path) -> tuple[Path, Path, Path]:
    rng, paths = np.random.default_rng(8), []
    for name, ratio in (("faulty", 2.03), ("healthy", 2.0)):
        inputs = np.linspace(0.0, 1.0, 60)
        gaps = 1.0 + ratio * inputs + rng.normal(0.0, 1e-3, 60)
        path = tmp_path / name / "gaps.csv"
        path.parent.mkdir()
        path.write_text("input_mm,gap_mm\n" + "".join(f"{u:.6f},{g:.6f}\n" for u, g in zip(inputs, gaps, strict=True)))
        paths.append(path)
    model = tmp_path / "simulation.csv"
    model.write_text("input_mm,gap_mm\n0,1\n1,3\n")
    return paths[0], paths[1], model


def test_command_without_a_drawing_compares_two_days(two_days: tuple[Path, Path, Path], tmp_path: Path) -> None:
    faulty, healthy, model = two_days
    out = tmp_path / "out"
    arguments = [str(faulty), "--reference", str(healthy), "--model", str(model), "--out", str(out)]
    done = CliRunner().invoke(command, arguments)
    assert done.exit_code == 0, done.output
    document = json.loads((out / "changes.json").read_text())
    ratio = next(one for one in document["gap"] if one["name"].startswith("ratio"))
    assert document["verdict"] == "place_not_told"
    assert ratio["change"] == pytest.approx(0.03, abs=4.0 * ratio["u"])
    assert "drawing" in document["next_look"]
    assert not (out / "changes.svg").exists()


def test_effects_cannot_be_demanded_beside_a_reference(two_days: tuple[Path, Path, Path]) -> None:
    faulty, healthy, model = two_days
    arguments = [str(faulty), "--reference", str(healthy), "--model", str(model), "--with", "backlash"]
    assert CliRunner().invoke(command, arguments).exit_code == 2


def test_command_with_a_drawing_names_the_hinge(tmp_path: Path) -> None:
    """Poses by the drawing's own linear answers: what is tested is the way from two tables to the files."""
    drawing, rng = SAMPLES / "paper" / "gripper.toml", np.random.default_rng(12)
    answers = drawing_of(read_model(drawing, "lumped"))
    bodies = [f"{body}.{part}" for body in answers.moving_bodies for part in PARTS]
    thin = answers.mechanism.flexures[0]
    for day, ratio in (("healthy", 0.0), ("faulty", -0.3)):
        slopes = answers.answer(PlaceChanges({0: ratio}, {}, {})).by_input
        inputs = np.concatenate([np.linspace(-0.2, 0.4, 40), np.linspace(0.4, -0.2, 40)])
        columns = {"input_mm": inputs, "time_s": 0.1 * np.arange(80.0)}
        columns["gap_mm"] = 2.0 + inputs * slopes[answers.channels.index("gap_mm")] + rng.normal(0.0, 1e-3, 80)
        for name in bodies:
            sd = 0.03 if name.endswith("mrad") else 1e-3
            columns[column_name(name)] = inputs * slopes[answers.channels.index(name)] + rng.normal(0.0, sd, 80)
        folder = tmp_path / day
        folder.mkdir()
        rows = np.stack(list(columns.values()), axis=1)
        lines = [",".join(columns), *(",".join(f"{value:.6f}" for value in row) for row in rows)]
        (folder / "gaps.csv").write_text("\n".join(lines) + "\n")
        off = {thin.name: 0.04 if day == "faulty" else 0.0}
        seen = []
        for flexure in answers.mechanism.flexures:
            thickness = flexure.thickness_mm - off.get(flexure.name, 0.0)
            seen.append(FlexureOutline(flexure.name, 5, (thickness, U_OUTLINE_MM), None, (0.0, U_OUTLINE_MM)))
        write_flexures(folder / "flexures.csv", seen)
    out = tmp_path / "out"
    arguments = [str(tmp_path / "faulty" / "gaps.csv"), "--reference", str(tmp_path / "healthy" / "gaps.csv")]
    done = CliRunner().invoke(command, [*arguments, "--model", str(drawing), "--out", str(out)])
    assert done.exit_code == 0, done.output
    document = json.loads((out / "changes.json").read_text())
    assert document["verdict"] == "changed"
    assert document["places"][0]["place"] == thin.name
    assert thin.name in done.output
    assert thin.name in (out / "changes.svg").read_text()
