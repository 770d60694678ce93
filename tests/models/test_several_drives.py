"""Several driven faces: superposition, rigid motions, reciprocity, and agreement of the three kinds of model."""

import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli.model import command
from fingervision.domain.errors import FingervisionError
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Drive, Mechanism
from fingervision.models.mechanism_figures import MechanismModel, mechanism_figures
from fingervision.models.rigid_bodies import RigidBodies
from fingervision.storage.mechanism_toml import mechanism_from_tables, read_mechanism
from tests.csv_rows import csv_rows

ROOT = Path(__file__).parents[2]
STAGE = (ROOT / "fingervision" / "models" / "mechanisms" / "parallel_leaf_stage.toml").read_text()
ARMS_PATH = ROOT / "fingervision" / "models" / "mechanisms" / "two_driven_arms.toml"
ARMS = ARMS_PATH.read_text()
KINDS = (MechanismPlate, MechanismFrame, RigidBodies)
ROUNDING = 1e-7


def drawn(text: str) -> Mechanism:
    return mechanism_from_tables(tomllib.loads(text), "m.toml")


def moving(mechanism: Mechanism, *per_input: float) -> Mechanism:
    drives = tuple(replace(drive, per_input=by) for drive, by in zip(mechanism.drives, per_input, strict=True))
    return replace(mechanism, drives=drives)


def both_ends_driven(base: float, stage: float) -> Mechanism:
    """The packaged stage, with its ground driven too in the same direction."""
    single = drawn(STAGE)
    ground = Drive(single.fixed[0], (1.0, 0.0), "held", base)
    return replace(single, fixed=(), drives=(ground, replace(single.drives[0], per_input=stage)))


@pytest.mark.parametrize("kind", [pytest.param(MechanismPlate, marks=pytest.mark.slow), MechanismFrame, RigidBodies])
def test_two_drives_are_the_sum_of_each_alone(kind: type[MechanismModel]) -> None:
    arms = drawn(ARMS)
    lower, upper = (kind(moving(arms, *alone)).state(1.0) for alone in ((1.0, 0.0), (0.0, 1.0)))
    model = kind(moving(arms, 0.7, -0.4))
    both = model.state(1.0)
    for name in arms.probes:
        expected = 0.7 * np.array(lower.probes_mm[name]) - 0.4 * np.array(upper.probes_mm[name])
        assert both.probes_mm[name] == pytest.approx(expected, rel=ROUNDING, abs=ROUNDING)
    for name in both.drives_n:
        assert both.drives_n[name] == pytest.approx(0.7 * lower.drives_n[name] - 0.4 * upper.drives_n[name], rel=1e-6)
    # The force of the input does the work of both drives; by Betti's theorem, the effect of one drive on the other is
    # mutual.
    assert both.force_n == pytest.approx(0.7 * both.drives_n["lower"] - 0.4 * both.drives_n["upper"], rel=ROUNDING)
    assert lower.drives_n["upper"] == pytest.approx(upper.drives_n["lower"], rel=1e-6)
    for ours, alone in zip(model.drive_states(), (lower, upper), strict=True):
        assert ours.drives_n == pytest.approx(alone.drives_n, rel=1e-6)


def test_the_kinds_agree_and_rigid_arms_are_kinematics() -> None:
    """Two arms, each on one neck: ideal joints at 10 and 40 mm rotate according to the driven heights 30 and 70 mm."""
    arms = drawn(ARMS)
    plate, frame, chain = (kind(arms).state(1.0) for kind in KINDS)
    for name in plate.drives_n:
        assert frame.drives_n[name] == pytest.approx(plate.drives_n[name], rel=0.01)
        assert chain.drives_n[name] == pytest.approx(plate.drives_n[name], rel=0.05)
    for ours in (frame, chain):
        assert ours.probes_mm["tip"][0] == pytest.approx(plate.probes_mm["tip"][0], rel=0.01)
    ratios = [drive.per_input for drive in arms.drives]
    first = ratios[0] / (30.0 - 10.0)
    second = (ratios[1] - first * (40.0 - 10.0)) / (70.0 - 40.0)
    assert plate.bodies["upper_arm"].angle_mrad == pytest.approx(-1e3 * second, rel=0.02)


@pytest.mark.parametrize("kind", [pytest.param(MechanismPlate, marks=pytest.mark.slow), MechanismFrame])
def test_ends_driven_apart_are_one_driven_twice_as_far(kind: type[MechanismPlate | MechanismFrame]) -> None:
    """The driven ground is guided, so that no fixed face is needed, also in large rotation."""
    alone, apart = kind(drawn(STAGE)), kind(both_ends_driven(-1.0, 1.0))
    assert apart.stiffness_n_mm == pytest.approx(4.0 * alone.stiffness_n_mm, rel=1e-5)
    for large in (False, True):
        single, double = (model.state(way, large_rotation=large) for model, way in ((alone, 6.0), (apart, 3.0)))
        ground, stage = double.drives_n.values()
        assert stage == pytest.approx(single.force_n, rel=1e-4)
        assert ground == pytest.approx(-single.force_n, rel=1e-4)
        assert double.pairs_mm == pytest.approx(single.pairs_mm, rel=1e-6)
        assert double.stress_mpa == pytest.approx(single.stress_mpa, rel=1e-3)


@pytest.mark.parametrize("kind", [MechanismPlate, MechanismFrame])
def test_drives_that_move_it_as_one_piece_are_refused(kind: type[MechanismPlate | MechanismFrame]) -> None:
    with pytest.raises(FingervisionError, match="must deform it, but move it as one rigid body; change per_input"):
        _ = kind(both_ends_driven(1.0, 1.0)).stiffness_n_mm


@pytest.mark.slow
def test_the_command_says_what_every_drive_does(tmp_path: Path) -> None:
    arguments = [str(ARMS_PATH), "--json", "--out", str(tmp_path)]
    table = json.loads(CliRunner().invoke(command, arguments, catch_exceptions=False).output)
    for figures in table.values():
        assert figures["upper: force per mm of lower [N/mm]"] == pytest.approx(
            figures["lower: force per mm of upper [N/mm]"], rel=1e-5
        )
        assert figures["input_stiffness_n_mm"] == pytest.approx(
            figures["lower: force per input [N/mm]"] - 0.5 * figures["upper: force per input [N/mm]"], rel=1e-5
        )
    last = csv_rows(tmp_path / "mechanism.csv")[-1]
    whole = float(last["lower_force_n"]) - 0.5 * float(last["upper_force_n"])
    assert float(last["force_n"]) == pytest.approx(whole, rel=1e-5)
    assert (tmp_path / "models.png").read_bytes().startswith(b"\x89PNG")


def test_figures_of_a_single_drive_name_no_drives() -> None:
    assert not any(" per mm of " in name for name in mechanism_figures(MechanismFrame(drawn(STAGE))))


LOWER = 'name = "lower"\nbox_mm = [7, 14, 30, 30]\ndirection = [1.0, 0.0]\nacross = "free"\n'
# Replaced text, its replacement, and the word that the message must contain.
WRONG = [
    ("per_input = -0.5", "per_input = nan", "drive upper.per_input"),
    ("per_input = -0.5", "per_input = true", "drive upper.per_input"),
    ("per_input = -0.5", 'per_input = "stroke"', "drive upper.per_input"),
    ("per_input = -0.5", "per_input = 1e300", "drive upper.per_input"),
    ("per_input = -0.5", "per_inputs = -0.5", "did you mean per_input?"),
    ("per_input = -0.5", "per_input = [1, 2]", "drive upper.per_input"),
    ('name = "upper"', 'name = "lower"', "numbers 1 and 2 are both called lower"),
    (LOWER, LOWER + "[[drive]]\n" + LOWER.replace('"lower"', '"third"'), "must be apart, but share a part"),
    ("box_mm = [7, 14, 30, 30]", "box_mm = [7, 14, 31, 31]", "must hold a part of the outline"),
    ("box_mm = [7, 14, 30, 30]", "box_mm = [-6, 6, 0, 0]", "is fixed too"),
    ("box_mm = [7, 14, 30, 30]", "box_mm = [14, 7, 30, 30]", "from the smaller to the larger"),
    ("direction = [1.0, 0.0]", "direction = [0.0, 0.0]", "drive lower.direction"),
    ("direction = [1.0, 0.0]", "direction = [1.0]", "drive lower.direction"),
    ('across = "free"', 'across = "guided"', "drive lower.across"),
    ("direction = [1.0, 0.0]", "direction = [1.0, 1.0]", "drive lower.across in"),
]


@pytest.mark.parametrize(("old", "new", "named"), WRONG, ids=[str(i) for i in range(len(WRONG))])
def test_a_wrong_drive_is_one_sentence(old: str, new: str, named: str) -> None:
    assert old in ARMS
    with pytest.raises(FingervisionError) as refused:
        _ = MechanismFrame(drawn(ARMS.replace(old, new, 1))).stiffness_n_mm
    assert named in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_drawing_without_a_drive_is_refused() -> None:
    tables = tomllib.loads(ARMS)
    for wrong in ({}, {"drive": []}, {"drive": 3}, {"drive": [3]}):
        with pytest.raises(FingervisionError, match=r"drive"):
            mechanism_from_tables({key: part for key, part in tables.items() if key != "drive"} | wrong, "m.toml")


@pytest.mark.parametrize("kind", [pytest.param(MechanismPlate, marks=pytest.mark.slow), MechanismFrame])
def test_drives_that_do_not_hold_it_are_refused(kind: type[MechanismPlate | MechanismFrame]) -> None:
    """Two faces whose mean is driven along x leave the mechanism free along y."""
    loose = ARMS.replace('[[fixed]]\nname = "foot"\nbox_mm = [-6, 6, 0, 0]\n', "")
    with pytest.raises(FingervisionError, match="must be held by its fixed faces, but can move freely"):
        _ = kind(drawn(loose)).stiffness_n_mm


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_a_drawing_in_metres_or_micrometres_is_asked_about(scale: float) -> None:
    lengths = re.compile(r"(?m)^(plate|box|at|thickness|radius|half_length|depth)_mm =.*$")
    other = lengths.sub(
        lambda line: re.sub(r"-?\d+\.?\d*", lambda n: repr(scale * float(n.group())), line.group()), ARMS
    )
    with pytest.raises(FingervisionError, match=r"must be 0.3 to 5000 mm large, but .* are its lengths (micro)?metres"):
        drawn(other)


def test_drives_that_all_stand_still_are_refused() -> None:
    with pytest.raises(FingervisionError, match="must move with the input, but per_input is 0 for all of them"):
        drawn(
            ARMS.replace("per_input = -0.5", "per_input = 0").replace(
                'across = "free"\n', 'across = "free"\nper_input = 0\n', 1
            )
        )


def test_the_chain_takes_one_drive_a_body() -> None:
    second = '[[drive]]\nname = "side"\nbox_mm = [14, 14, 20, 30]\ndirection = [1.0, 0.0]\nacross = "free"\n'
    ears = ARMS.replace("box_mm = [7, 14, 30, 30]", "box_mm = [7, 12, 30, 30]").replace(
        "[[probe]]", second + "[[probe]]", 1
    )
    with pytest.raises(FingervisionError, match="drives one body at several faces; take --kind lumped"):
        RigidBodies(drawn(ears))


def test_the_packaged_drawing_is_read() -> None:
    assert [drive.face.name for drive in read_mechanism(ARMS_PATH).drives] == ["lower", "upper"]
