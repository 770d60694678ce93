"""Mechanisms drawn by bodies: what is read, and what is refused in one sentence."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli.model import command
from fingervision.domain.errors import DataError, FingervisionError, ModelError, UsageError
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism_figures import response_figures
from fingervision.models.rigid_bodies import RigidBodies
from fingervision.storage.drawing_numbers import number
from fingervision.storage.mechanism_toml import is_mechanism, mechanism_from_tables, read_drawing, read_mechanism

ROOT = Path(__file__).parents[2]
DRAWN = ROOT / "fingervision" / "models" / "mechanisms"
STAGE = (DRAWN / "parallel_leaf_stage.toml").read_text()

# What is replaced by what, and what the sentence must name.
WRONG = [
    ("plate = 0.5", "plate = -0.5", "plate_mm"),
    ("plate = 0.5", "plate = nan", "lengths.plate"),
    ("plate = 0.5", "plate = 1e300", "is 1e+300"),
    ("plate = 0.5", "plate = nan", "is nan"),
    ("plate = 0.5", f"plate = {10**400}", "is a whole number of 401 digits"),
    ("leaf = 40.0", 'leaf = "apart * 2"', "there is no apart in [lengths] above it"),
    ("leaf = 40.0", 'leaf = "1 / 0"', "lengths.leaf"),
    ("leaf = 40.0", "leaf = \"__import__('os')\"", "lengths.leaf"),
    ("leaf = 40.0", 'leaf = "9 ** 9 ** 9"', "lengths.leaf"),
    ("leaf = 40.0", "leaf = -40.0", "flexure left"),
    ("t = 0.4", "t = 0.0", "thickness_mm"),
    ("youngs_modulus_mpa = 210000.0", "youngs_modulus_mpa = 210.0", "GPa"),
    ("poisson_ratio = 0.3", "poisson_ratio = 0.5", "poisson_ratio"),
    ("poisson_ratio = 0.3", "poisson_ratio = -0.1", "poisson_ratio"),
    (
        'box_mm = ["-apart / 2 - 5", "apart / 2 + 5", "leaf", "leaf + block"]',
        "box_mm = [100, 120, 100, 120]",
        "connected piece",
    ),
    (
        'box_mm = ["-apart / 2 - 5", "apart / 2 + 5", "-block", 0.0]',
        "box_mm = [5, -5, -3, 0]",
        "[x from, x to, y from, y to]",
    ),
    ('kind = "leaf"', 'kind = "spring"', "must be one of circular, elliptic, filleted, leaf"),
    ("axis_deg = 90.0", "axis_deg = 0.0", "connected piece"),
    ('at_mm = ["-apart / 2", "leaf / 2"]', 'at_mm = ["-apart / 2"]', "list of 2 numbers"),
    ("direction = [1.0, 0.0]", "direction = [0.0, 0.0]", "drive.direction"),
    ('across = "free"', 'across = "maybe"', "drive.across"),
    ('at_mm = [0.0, "leaf + block / 2"]', "at_mm = [500.0, 0.0]", "probe stage"),
    ('of = ["ground", "stage"]', 'of = ["ground", "moon"]', "two of the probes"),
    ("[[fixed]]", "[[fixt]]", "did you mean fixed?"),
    ('name = "ground"\nbox_mm', 'name = "ground"\nwide = 3\nbox_mm', "ground.wide in m.toml is not known"),
    ('turns = "held"', 'turns = "maybe"', "drive.turns"),
    ('name = "right"', 'name = "left"', "numbers 1 and 2 are both called left"),
    ('name = "right"', 'name = "ri\\nght"', "must be one line of printable letters"),
    (
        'box_mm = ["-apart / 2 - 5", "apart / 2 + 5", "leaf", "leaf + block"]',
        "box_mm = [100, 120, 100, 120]",
        "one at x 100 to 120, y 100 to 120 mm (stage)",
    ),
]
CUT = "\n[[body]]\nname = 'slot'\ncut = true\n{shape}\n"
CUTS = [
    ("disc_mm = ['-apart / 2', 'leaf / 2', 0.1]", "filled by flexure left"),
    ("box_mm = ['apart / 2', 'apart / 2 + 0.3', 10, 12]", "filled by flexure right"),
    ("disc_mm = [0, 'leaf / 2', 2]", "at (0, 20) mm it touches no body"),
    ("box_mm = [100, 110, 0, 5]", "at (105, 2.5) mm it touches no body"),
]
"""Cuts of the stage that change nothing, and what is said."""
UNHELD = [
    ('"-block", "-block"]\n\n[drive]', "100.0, 101.0]\n\n[drive]", "must hold a part of the outline"),
    ('box_mm = ["-apart / 2 - 5", "-apart / 2 - 5", "leaf", "leaf + block"]',
     'box_mm = ["-apart / 2 - 5", "apart / 2 + 5", "-block", "-block"]', "is fixed too"),
]  # fmt: skip


def test_a_table_that_stands_twice_is_named_as_it_is_written(tmp_path: Path) -> None:
    (tmp_path / "m.toml").write_text(f"{STAGE}[drive]\nname = 'a'\n", encoding="utf-8")
    with pytest.raises(DataError, match=r"Cannot declare \[drive\] twice \(at line \d+"):
        read_drawing(tmp_path / "m.toml")


@pytest.mark.parametrize(("old", "new", "named"), WRONG, ids=[str(i) for i in range(len(WRONG))])
def test_a_wrong_mechanism_is_one_sentence(old: str, new: str, named: str) -> None:
    assert old in STAGE
    with pytest.raises(DataError) as refused:
        mechanism_from_tables(tomllib.loads(STAGE.replace(old, new, 1)), "m.toml")
    assert named in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(("shape", "named"), CUTS)
def test_a_cut_that_removes_nothing_is_refused_with_its_place(shape: str, named: str) -> None:
    with pytest.raises(DataError) as refused:
        mechanism_from_tables(tomllib.loads(STAGE + CUT.format(shape=shape)), "m.toml")
    assert "cut slot of" in str(refused.value)
    assert named in str(refused.value)


def test_a_cut_before_its_body_is_refused_and_one_that_leaves_a_leaf_its_window_is_not() -> None:
    early = STAGE.replace("[[body]]", CUT.format(shape="box_mm = [-2, 2, -4, -2]") + "[[body]]", 1)
    with pytest.raises(DataError, match=r"at \(0, -3\) mm it is filled by ground, which is added after it"):
        mechanism_from_tables(tomllib.loads(early), "m.toml")
    block = "\n[[body]]\nname = 'block'\nbox_mm = ['-apart / 2 - 5', 'apart / 2 + 5', '-block', 'leaf + block']\n"
    window = CUT.format(shape="box_mm = ['-apart / 2 - 6', 'apart / 2 + 6', 0, 'leaf']")
    again = CUT.format(shape="box_mm = [-2, 2, 10, 12]").replace("slot", "hole")
    drawn = STAGE.replace("[[flexure]]", block + window + again + "[[flexure]]", 1)
    whole = mechanism_from_tables(tomllib.loads(STAGE), "m.toml")
    assert MechanismPlate(mechanism_from_tables(tomllib.loads(drawn), "m.toml")).stiffness_n_mm == pytest.approx(
        MechanismPlate(whole).stiffness_n_mm, rel=1e-3
    )


@pytest.mark.parametrize("hole", ["disc_mm = [5.8, 15, 0.1]", "box_mm = [4.9, 5.1, 15.6, 15.8]"])
def test_a_hole_in_a_neck_is_refused(hole: str) -> None:
    text = f"""
name = "post"
plate_mm = 3.0
{STAGE[STAGE.index("[material]") : STAGE.index("[lengths]")]}
[[body]]
box_mm = [0, 10, 0, 30]
{CUT.format(shape=hole.replace("5.8, 15", "5, 15.8"))}
[[flexure]]
name = "neck"
kind = "circular"
at_mm = [5, 15]
axis_deg = 90
thickness_mm = 1.0
radius_mm = 5.0
[[fixed]]
box_mm = [0, 10, 0, 0]
[drive]
box_mm = [0, 10, 30, 30]
direction = [1, 0]
"""
    with pytest.raises(DataError, match=r"flexure neck must be thinnest at its centre, but .* at \(5, 15\.[67]"):
        MechanismFrame(mechanism_from_tables(tomllib.loads(text), "post.toml"))


@pytest.mark.parametrize(("raw", "said"), [
    ("10 +", "cannot be read as arithmetic"), ("(3", "cannot be read as arithmetic"), ("1 / 0", "divides by zero"),
    ("sqrt(-2)", "no sqrt of -2"), ("1e308 * 1e308 * 0", "nan"),
])  # fmt: skip
def test_an_expression_without_a_value_is_refused_in_words_of_arithmetic(raw: str, said: str) -> None:
    with pytest.raises(DataError, match=said) as refused:
        number(raw, {}, "lengths.t in m.toml")
    assert not any(word in str(refused.value) for word in ("unknown>", "line 1", "syntax", "domain", "float"))


def test_bodies_that_are_misspelt_are_those_of_a_mechanism(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text("schema = 2\n" + STAGE.replace("schema = 1\n", ""))
    with pytest.raises(DataError, match=r"schema in .* must be 1, but is 2"):
        read_mechanism(path)
    path.write_text(STAGE.replace("[[body]]", "[[bodies]]"))
    said = CliRunner().invoke(command, [str(path), "--out", str(tmp_path / "o")]).exception
    assert "did you mean body?" in str(said)
    said = CliRunner().invoke(command, [str(tmp_path / "none.toml"), "--out", str(tmp_path / "o")]).exception
    assert "There is no drawing" in str(said)


@pytest.mark.slow
@pytest.mark.parametrize(("old", "new", "named"), UNHELD)
def test_faces_that_hold_nothing_or_too_much_are_refused(old: str, new: str, named: str) -> None:
    assert old in STAGE
    mechanism = mechanism_from_tables(tomllib.loads(STAGE.replace(old, new, 1)), "m.toml")
    with pytest.raises(FingervisionError, match=named):
        MechanismPlate(mechanism)


@pytest.mark.parametrize("kind", ["circular", "elliptic"])
def test_a_cut_that_is_a_closed_hole_is_refused(kind: str) -> None:
    """Cuts of 1 mm in a post of 10 mm leave a strip beside each: the neck is not what bends."""
    sizes = "radius_mm = 1.0" if kind == "circular" else "half_length_mm = 2.0\ndepth_mm = 1.0"
    post = f"""
name = "post"
plate_mm = 3.0
{STAGE[STAGE.index("[material]") : STAGE.index("[lengths]")]}
[[body]]
box_mm = [0, 10, 0, 30]
[[flexure]]
name = "neck"
kind = "{kind}"
at_mm = [5, 15]
axis_deg = 90
thickness_mm = 0.4
{sizes}
[[fixed]]
box_mm = [0, 10, 0, 0]
[drive]
box_mm = [0, 10, 30, 30]
direction = [1, 0]
"""
    with pytest.raises(DataError) as refused:
        mechanism_from_tables(tomllib.loads(post), "post.toml")
    assert "flexure neck of post" in str(refused.value)
    assert "closed hole" in str(refused.value)
    assert "\n" not in str(refused.value)
    open_cuts = post.replace("box_mm = [0, 10, 0, 30]", "box_mm = [3.8, 6.2, 0, 30]")
    assert mechanism_from_tables(tomllib.loads(open_cuts), "post.toml").flexures


def test_cuts_that_leave_nothing_are_named() -> None:
    cleared = STAGE.replace("[[flexure]]", "[[spare]]") + "\n[[body]]\ncut = true\nbox_mm = [-500, 500, -500, 500]\n"
    drawn = {key: value for key, value in tomllib.loads(cleared).items() if key != "spare"}
    with pytest.raises(DataError, match="must leave something of its bodies"):
        mechanism_from_tables(drawn, "m.toml")


def test_a_drawing_in_metres_is_asked_about() -> None:
    drawn = tomllib.loads(STAGE)
    drawn["lengths"] = {name: value * 1e-3 for name, value in drawn["lengths"].items()}
    drawn["flexure"] = []
    for body in drawn["body"]:
        body["box_mm"] = ["-apart", "apart", *body["box_mm"][2:]]
    with pytest.raises(DataError, match="are its lengths metres"):
        mechanism_from_tables(drawn, "m.toml")


def test_a_material_that_does_not_contract_is_drawn() -> None:
    cork = mechanism_from_tables(tomllib.loads(STAGE.replace("poisson_ratio = 0.3", "poisson_ratio = 0.0")), "m.toml")
    steel = mechanism_from_tables(tomllib.loads(STAGE), "m.toml")
    soft, stiff = (MechanismFrame(drawn).stiffness_n_mm for drawn in (cork, steel))
    assert soft == pytest.approx(MechanismPlate(cork).stiffness_n_mm, rel=0.005)
    assert soft < stiff  # without the restraint by its width


def test_thin_bars_are_flexures_although_they_are_drawn_as_bodies() -> None:
    drawn = tomllib.loads(STAGE)
    drawn["body"] += [{"bar_mm": [*(f"{side} * apart / 2", "-1", f"{side} * apart / 2", "leaf + 1")], "width_mm": "t"}
                      for side in ("-1", "1")]  # fmt: skip
    drawn["flexure"] = []
    found = mechanism_from_tables(drawn, "m.toml").strips
    named = mechanism_from_tables(tomllib.loads(STAGE), "m.toml").flexures
    ours, theirs = (sorted(each.at_mm for each in flexures) for flexures in (found, named))
    assert np.array(ours) == pytest.approx(np.array(theirs))
    assert [strip.thickness_mm for strip in found] == pytest.approx([leaf.thickness_mm for leaf in named])


def test_a_sharp_corner_without_a_flexure_states_no_stress() -> None:
    drawn = tomllib.loads(STAGE)
    drawn["body"] += [{"bar_mm": [0.0, "-1", 0.0, "leaf + 1"], "width_mm": "0.6 * leaf"}]
    drawn["flexure"] = []
    plate = MechanismPlate(mechanism_from_tables(drawn, "m.toml"))
    assert np.isnan(plate.state(1.0).stress_mpa)
    assert not any("stress" in name or "yield" in name for name in response_figures(plate))


def test_a_mechanism_that_nothing_holds_is_refused() -> None:
    """Held across alone: it would fly away along the drive's face."""
    loose = STAGE.replace("[[fixed]]", '[[slide]]\nholds = "x"')
    loose = loose.replace("direction = [1.0, 0.0]", "direction = [1.0, 0.0]")
    with pytest.raises(ModelError, match="must be held by its fixed faces, but can move freely"):
        _ = MechanismPlate(mechanism_from_tables(tomllib.loads(loose), "m.toml")).driven.unit_displacement


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


@pytest.mark.parametrize("path", sorted(DRAWN.glob("*.toml")), ids=lambda path: path.stem)
def test_rigid_bodies_differ_from_elastic_ones_by_their_stated_error(path: Path) -> None:
    """Closed loops, trees and chains alike; the stiffness matrix states the difference as its error."""
    mechanism = read_mechanism(path)
    rigid, elastic = RigidBodies(mechanism), MechanismFrame(mechanism)
    assert 1.0 <= rigid.stiffness_n_mm / elastic.stiffness_n_mm <= 1.0 + rigid.force_error < 1.12


def test_the_lumped_kind_answers_a_mechanism_beside_finite_elements(tmp_path: Path) -> None:
    arguments = [str(DRAWN / "bridge_amplifier.toml"), "--json", "--out", str(tmp_path)]
    table = json.loads(CliRunner().invoke(command, arguments, catch_exceptions=False).output)
    assert list(table) == ["finite_element", "lumped"]
    for figure in ("input_stiffness_n_mm", "output: y per input [mm/mm]", "mode_1_drive_free_hz"):
        assert table["lumped"][figure] == pytest.approx(table["finite_element"][figure], rel=0.005)
    assert (tmp_path / "mechanism.csv").exists()
    assert (tmp_path / "lumped" / "mechanism.csv").exists()


TEMPLATE = """name = "one finger softer"
[gripper]
file = "gripper.toml"
[gripper.left]
"hinge1.thickness_mm" = 0.9
[gripper.right.lever]
l2_mm = 18.0
"""
WRONG_TEMPLATES = [
    ('"gripper.toml"', "3", "gripper.file"),
    ('"gripper.toml"', '"nowhere.toml"', "nowhere.toml"),
    ("hinge1.thickness_mm", "hinge3.thickness_mm", "gripper.left.hinge3.thickness_mm"),
    ("hinge1.thickness_mm", "hinge1.height_mm", "thickness_mm and radius_mm"),
    ("= 0.9", "= -0.9", "must be greater than 0, but is -0.9"),
    ("= 0.9", "= nan", "must be a number"),
    ("= 0.9", '= "thin"', "arithmetic expression with names"),
    ("= 0.9", "= 9.0", "thickness of 9 mm"),
    ("l2_mm = 18.0", "l3_mm = 18.0", "the same in both halves"),
    ("[gripper.left]", "[gripper.middle]", "middle in"),
]


def with_sample(folder: Path, text: str) -> Path:
    (folder / "gripper.toml").write_bytes((ROOT / "sample_frames" / "paper" / "gripper.toml").read_bytes())
    (folder / "m.toml").write_text(text)
    return folder / "m.toml"


def test_a_gripper_is_a_template_of_a_mechanism(tmp_path: Path) -> None:
    path = with_sample(tmp_path, TEMPLATE)
    assert is_mechanism(path)
    mechanism = read_mechanism(path)
    thickness = {flexure.name: flexure.thickness_mm for flexure in mechanism.flexures}
    assert thickness == {"left hinge 1": 0.9, "left hinge 2": 1.0, "right hinge 1": 1.0, "right hinge 2": 1.0}
    places = {flexure.name: flexure.at_mm[0] for flexure in mechanism.flexures}
    assert places["right hinge 1"] + places["left hinge 1"] == pytest.approx(18.0 - 17.82)


@pytest.mark.parametrize(("old", "new", "named"), WRONG_TEMPLATES, ids=[named for *_, named in WRONG_TEMPLATES])
def test_a_wrong_template_is_one_sentence(tmp_path: Path, old: str, new: str, named: str) -> None:
    assert old in TEMPLATE
    with pytest.raises(FingervisionError) as refused:
        read_mechanism(with_sample(tmp_path, TEMPLATE.replace(old, new, 1)))
    assert named in str(refused.value)
    assert "\n" not in str(refused.value)


CONTACT = """
[[contact]]
name = "stop"
box_mm = ["apart / 2 + 5", "apart / 2 + 5", "leaf", "leaf + block"]
wall_mm = [22, 0, 22, 100]
"""
WRONG_CONTACTS = [
    ("wall_mm = [22, 0, 22, 100]", "", "wall_mm (two points"),
    ("wall_mm = [22, 0, 22, 100]", "wall_mm = [22, 0, 22, 0]", "two different points"),
    ("wall_mm = [22, 0, 22, 100]", "wall_mm = [22, 0, 22]", "list of 4 numbers"),
    ("wall_mm = [22, 0, 22, 100]", "wall = [22, 0, 22, 100]", "did you mean wall_mm?"),
    ("wall_mm = [22, 0, 22, 100]", "against_box_mm = [5, 1, 0, 1]", "[x from, x to, y from, y to]"),
]


@pytest.mark.parametrize(("old", "new", "named"), WRONG_CONTACTS, ids=[named for *_, named in WRONG_CONTACTS])
def test_a_wrong_contact_is_one_sentence(old: str, new: str, named: str) -> None:
    with pytest.raises(DataError) as refused:
        mechanism_from_tables(tomllib.loads(STAGE + CONTACT.replace(old, new, 1)), "m.toml")
    assert named in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_stop_holds_the_stage() -> None:
    """The wall is 2 mm from the stage: of 3 mm of input the leaves' other end has 2, and the block is pressed by 1."""
    mechanism = mechanism_from_tables(tomllib.loads(STAGE + CONTACT), "m.toml")
    model = MechanismPlate(mechanism)
    assert model.touch_input_mm() == pytest.approx({"stop": 2.0}, rel=1e-4)
    assert model.state(1.9, contact=True).contact_n == {"stop": 0.0}
    held = model.state(2.01, contact=True)
    assert held.contact_n["stop"] > 0.0
    # A bar of 40 by 12 by 0.5 mm pressed by 0.01 mm between two flat faces: E A / L times 0.01 mm, and the leaves'.
    assert held.contact_n["stop"] == pytest.approx(210e3 * 12 * 0.5 / 40 * 0.01, rel=0.03)
    assert held.force_n == pytest.approx(held.contact_n["stop"] + 2.0 * model.stiffness_n_mm, rel=0.02)


def test_contact_without_a_contact_is_wrong_usage(tmp_path: Path) -> None:
    arguments = [str(DRAWN / "parallel_leaf_stage.toml"), "--contact", "--out", str(tmp_path / "o")]
    with pytest.raises(UsageError, match=r"--contact needs a \[\[contact\]\] section"):
        CliRunner().invoke(command, arguments, catch_exceptions=False)
    assert not (tmp_path / "o").exists()
