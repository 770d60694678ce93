"""Mechanisms drawn by bodies: what is read, and what is refused in one sentence."""

import json
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner

from fingervision.cli.model import command
from fingervision.domain.errors import FingervisionError
from fingervision.models.mechanism_plate import MechanismPlate
from fingervision.storage.arithmetic import number
from fingervision.storage.mechanism_toml import is_mechanism, mechanism_from_tables, read_mechanism

ROOT = Path(__file__).parents[2]
DRAWN = ROOT / "fingervision" / "models" / "mechanisms"
STAGE = (DRAWN / "parallel_leaf_stage.toml").read_text()

# What is replaced by what, and what the sentence must name.
WRONG = [
    ("plate = 0.5", "plate = -0.5", "plate_mm"),
    ("plate = 0.5", "plate = nan", "lengths.plate"),
    ("plate = 0.5", "plate = 1e300", "lengths.plate"),
    ("leaf = 40.0", 'leaf = "apart * 2"', "there is no apart in [lengths] above it"),
    ("leaf = 40.0", 'leaf = "1 / 0"', "lengths.leaf"),
    ("leaf = 40.0", "leaf = \"__import__('os')\"", "lengths.leaf"),
    ("leaf = 40.0", 'leaf = "9 ** 9 ** 9"', "lengths.leaf"),
    ("leaf = 40.0", "leaf = -40.0", "flexure left"),
    ("t = 0.4", "t = 0.0", "thickness_mm"),
    ("youngs_modulus_mpa = 210000.0", "youngs_modulus_mpa = 210.0", "GPa"),
    ("poisson_ratio = 0.3", "poisson_ratio = 0.5", "poisson_ratio"),
    (
        'box_mm = ["-apart / 2 - 5", "apart / 2 + 5", "leaf", "leaf + block"]',
        "box_mm = [100, 120, 100, 120]",
        "one piece",
    ),
    ('box_mm = ["-apart / 2 - 5", "apart / 2 + 5", "-block", 0.0]', "box_mm = [5, -5, -3, 0]", "both growing"),
    ('kind = "leaf"', 'kind = "spring"', "must be one of circular, elliptic, filleted, leaf"),
    ("axis_deg = 90.0", "axis_deg = 0.0", "one piece"),
    ('at_mm = ["-apart / 2", "leaf / 2"]', 'at_mm = ["-apart / 2"]', "list of 2 numbers"),
    ("direction = [1.0, 0.0]", "direction = [0.0, 0.0]", "drive.direction"),
    ('across = "free"', 'across = "maybe"', "drive.across"),
    ('at_mm = [0.0, "leaf + block / 2"]', "at_mm = [500.0, 0.0]", "probe stage"),
    ('of = ["ground", "stage"]', 'of = ["ground", "moon"]', "two of the probes"),
    ("[[fixed]]", "[[fixt]]", "did you mean fixed?"),
    ('name = "ground"\nbox_mm', 'name = "ground"\nwide = 3\nbox_mm', "unknown key, wide"),
]
UNHELD = [
    ('"-block", "-block"]\n\n[drive]', "100.0, 101.0]\n\n[drive]", "must hold a part of the outline"),
    ('box_mm = ["-apart / 2 - 5", "-apart / 2 - 5", "leaf", "leaf + block"]',
     'box_mm = ["-apart / 2 - 5", "apart / 2 + 5", "-block", "-block"]', "is fixed too"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "named"), WRONG, ids=[str(i) for i in range(len(WRONG))])
def test_a_wrong_mechanism_is_one_sentence(old: str, new: str, named: str) -> None:
    assert old in STAGE
    with pytest.raises(FingervisionError) as refused:
        mechanism_from_tables(tomllib.loads(STAGE.replace(old, new, 1)), "m.toml")
    assert named in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.slow
@pytest.mark.parametrize(("old", "new", "named"), UNHELD)
def test_faces_that_hold_nothing_or_too_much_are_refused(old: str, new: str, named: str) -> None:
    assert old in STAGE
    mechanism = mechanism_from_tables(tomllib.loads(STAGE.replace(old, new, 1)), "m.toml")
    with pytest.raises(FingervisionError, match=named):
        MechanismPlate(mechanism)


def test_a_mechanism_that_nothing_holds_is_refused() -> None:
    """Held across alone: it would fly away along the drive's face."""
    loose = STAGE.replace("[[fixed]]", '[[slide]]\nholds = "x"')
    loose = loose.replace("direction = [1.0, 0.0]", "direction = [1.0, 0.0]")
    with pytest.raises(FingervisionError, match="must be held by its fixed faces, but can move freely"):
        _ = MechanismPlate(mechanism_from_tables(tomllib.loads(loose), "m.toml")).unit_displacement_mm


def test_arithmetic_with_names() -> None:
    assert number("2 * (a + 1) / 4 - sqrt(a) + sin_deg(30)", {"a": 9.0}, "x") == pytest.approx(2.5)


@pytest.mark.parametrize("path", sorted(DRAWN.glob("*.toml")), ids=lambda path: path.stem)
def test_every_packaged_mechanism_is_read(path: Path) -> None:
    assert is_mechanism(path)
    assert read_mechanism(path).flexures


def test_a_gripper_is_no_mechanism_of_bodies() -> None:
    assert not is_mechanism(ROOT / "sample_frames" / "paper" / "gripper.toml")


@pytest.mark.slow
def test_the_command_answers_a_mechanism(tmp_path: Path) -> None:
    arguments = [str(DRAWN / "four_bar_gripper.toml"), "--mesh", "--json", "--out", str(tmp_path)]
    result = CliRunner().invoke(command, arguments, catch_exceptions=False)
    figures = json.loads(result.output)["finite_element"]
    assert figures["input_stiffness_n_mm"] > 0.0
    assert figures["tip: x per input [mm/mm]"] == pytest.approx(-1.0, rel=0.01)
    for name in ("deformed.png", "mesh.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")
    header = (tmp_path / "mechanism.csv").read_text().splitlines()[0]
    assert header.startswith("input_mm,force_n,tip_x_mm,tip_y_mm")


def test_kinds_that_know_grippers_alone_say_so(tmp_path: Path) -> None:
    arguments = [str(DRAWN / "four_bar_gripper.toml"), "--kind", "stiffness_matrix", "--out", str(tmp_path / "o")]
    with pytest.raises(FingervisionError, match="must be finite_element for a mechanism drawn by bodies"):
        CliRunner().invoke(command, arguments, catch_exceptions=False)
    assert not (tmp_path / "o").exists()
