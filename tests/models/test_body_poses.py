"""Poses of bodies, compared with rigid motions, with closed formulas, and between kinds of model."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli.model import command
from fingervision.models.answer_figures import LINEAR
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.gripper_mechanism import whole_mechanism
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.kinds import build_model, kinds
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism_bodies import bodies_of, column_name, rigid_motion
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.mechanism_toml import mechanism_from_tables, read_mechanism
from tests.benchmarks.films_of_mechanisms import DRAWINGS as FILMED

GRIPPER = Path("sample_frames/paper/gripper.toml")
DRAWINGS = Path("fingervision/models/mechanisms")

LEVER = {
    "name": "lever",
    "plate_mm": 3.0,
    "material": {
        "name": "steel",
        "youngs_modulus_mpa": 200_000.0,
        "poisson_ratio": 0.3,
        "density_kg_m3": 7800.0,
        "yield_mpa": 300.0,
    },
    "body": [{"name": "foot", "box_mm": [-6, 6, -10, 0]}, {"name": "long arm", "box_mm": [-6, 6, 0, 60]}],
    "flexure": [{"name": "pivot", "kind": "circular", "at_mm": [0, 0], "axis_deg": 90, "thickness_mm": 0.4,
                 "radius_mm": 4}],
    "fixed": [{"box_mm": [-6, 6, -10, -10]}],
    "drive": {"box_mm": [-6, 6, 60, 60], "direction": [1, 0], "across": "free"},
    "probe": [{"name": "tip", "at_mm": [6, 59]}],
}  # fmt: skip


@pytest.mark.parametrize("seed", range(4))
def test_a_rigid_motion_is_found_again(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places, weights = rng.uniform(-20.0, 20.0, (2, 30)), rng.uniform(0.1, 1.0, 30)
    angle, shift, about = rng.uniform(-3.0, 3.0), rng.uniform(-5.0, 5.0, 2), rng.uniform(-9.0, 9.0, 2)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = turn @ (places - about[:, None]) + (about + shift)[:, None] - places
    pose = rigid_motion(places, moved, weights, about, large=True)
    assert np.allclose((pose.x_mm, pose.y_mm, pose.angle_mrad), (*shift, 1e3 * angle), atol=1e-9)
    small = rigid_motion(places, 1e-7 * moved, weights, about, large=False)
    twice = rigid_motion(places, 2e-7 * moved, weights, about, large=False)
    assert np.isclose(twice.angle_mrad, 2.0 * small.angle_mrad)


def test_a_lever_turns_by_the_drive_over_its_arm() -> None:
    """A thin notch is a pivot: the arm of 60 mm rotates by u / 60 mm, and its centroid moves accordingly."""
    model = MechanismFrame(mechanism_from_tables(LEVER, "here"))
    pose = model.state(0.1).bodies["long_arm"]
    assert pose.angle_mrad == pytest.approx(-100.0 / 60.0, rel=0.01)
    centroid = next(body for body in model.bodies if body.name == "long_arm").centroid_mm
    assert pose.x_mm == pytest.approx(-1e-3 * pose.angle_mrad * centroid[1], rel=0.01)
    assert abs(pose.y_mm) < 1e-4
    turned = model.state(10.0, large_rotation=True).bodies["long_arm"]
    # In large rotation, the middle of the driven face keeps its distance from the pivot.
    assert turned.angle_mrad == pytest.approx(-1e3 * np.arcsin(10.0 / 60.0), rel=0.02)


def test_leaves_of_equal_length_keep_the_jaw_parallel() -> None:
    pose = MechanismFrame(read_mechanism(DRAWINGS / "four_bar_gripper.toml")).state(1.0).bodies["jaw"]
    assert pose.x_mm == pytest.approx(-1.0, rel=0.005)
    assert abs(pose.angle_mrad) < 0.2
    assert abs(pose.y_mm) < 1e-3


def test_a_trapezoid_turns_about_its_virtual_pivot() -> None:
    """The lever is driven 30 mm above the point where the leaves' axes meet."""
    pose = MechanismFrame(read_mechanism(DRAWINGS / "trapezoid_pivot.toml")).state(0.1).bodies["lever"]
    assert pose.angle_mrad == pytest.approx(-100.0 / 30.0, rel=0.002)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bridge_amplifier", "butterfly_pivot", "four_bar_gripper"])
def test_lumped_flexures_and_finite_elements_agree(name: str) -> None:
    mechanism = read_mechanism(DRAWINGS / f"{name}.toml")
    frame, plate = MechanismFrame(mechanism).state(0.1).bodies, MechanismPlate(mechanism).state(0.1).bodies
    assert frame.keys() == plate.keys()
    way = max(np.hypot(pose.x_mm, pose.y_mm) for pose in plate.values())
    for body, pose in plate.items():
        other = frame[body]
        # A parasitic motion is small; both kinds of model agree on it within some per cent.
        assert np.hypot(other.x_mm - pose.x_mm, other.y_mm - pose.y_mm) < 3e-4 * way
        assert abs(other.angle_mrad - pose.angle_mrad) < max(3e-4 * abs(pose.angle_mrad), 1e-5 * 1e3 * way)


@pytest.mark.slow
def test_every_kind_of_gripper_gives_the_same_poses() -> None:
    """Bars agree with finite elements within their stated 1 %; both models are exactly symmetric."""
    gripper = read_gripper(GRIPPER)
    answers = {kind: build_model(kind, gripper, LINEAR, HingeTheory.CORRECTED).body_poses(np.array([0.0, 1.0]))
               for kind in kinds()}  # fmt: skip
    truth = answers["finite_element"]
    assert set(truth) == {"left_finger", "right_finger", "drive"}
    for poses in answers.values():
        for name, rows in poses.items():
            assert np.allclose(rows[0], 0.0)
            assert np.allclose(rows[1], truth[name][1], rtol=0.01, atol=1e-6)
        assert np.allclose(poses["left_finger"] * [-1, 1, -1], poses["right_finger"])
    whole = MechanismFrame(whole_mechanism(gripper, gripper, "both")).state(1.0).bodies
    for name, pose in whole.items():
        assert np.allclose((pose.x_mm, pose.y_mm, pose.angle_mrad), truth[name][1], rtol=3e-4, atol=1e-4)


@pytest.mark.slow
def test_columns_stand_at_the_end_of_the_table(tmp_path: Path) -> None:
    done = CliRunner().invoke(command, [str(GRIPPER), "--kind", "lumped", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    header = (tmp_path / "simulation.csv").read_text().splitlines()[0].split(",")
    assert header[:5] == ["input_mm", "gap_mm", "left_mm", "right_mm", "force_n"]
    assert header[5:8] == ["drive.x_mm", "drive.y_mm", "drive.angle_mrad"]
    assert header[-1] == "right_finger.angle_mrad"


def test_bodies_are_named_by_the_drawing() -> None:
    mechanism = mechanism_from_tables({**LEVER, "body": [{**LEVER["body"][0], "name": ""}, LEVER["body"][1]]}, "here")
    assert sorted(body.name for body in bodies_of(mechanism)) == ["body_2", "long_arm"]
    assert column_name("hinge, 2 (left)") == "hinge_2_left"
    assert column_name("###") == "body"


def test_each_side_of_a_gap_moves_as_its_own_body_does(tmp_path: Path) -> None:
    drawing = FILMED / "lever_jaw.toml"
    done = CliRunner().invoke(command, [str(drawing), "--kind", "lumped", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    rows = np.genfromtxt(tmp_path / "simulation.csv", delimiter=",", names=True)
    assert np.allclose(rows["right_mm"] - rows["left_mm"], rows["gap_mm"], atol=2e-7)
    # The left tip belongs to the ground, and the right one to the lever: halves of the gap would move alike.
    assert np.ptp(rows["right_mm"]) > 0.5
    assert np.ptp(rows["left_mm"]) < 0.02 * np.ptp(rows["right_mm"])
