"""Drawings with layers, against the theory of crossed leaves and the same parts beside each other."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli.model import command
from fingervision.domain.errors import DataError, FingervisionError, ModelError, UsageError
from fingervision.models.elastic_mechanism import ElasticMechanism
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Mechanism
from fingervision.models.rigid_bodies import RigidBodies
from fingervision.storage.outline_file import write_outline
from tests.drawings import drawing

HEAD = """
plate_mm = 4.0
material = { name = "m", youngs_modulus_mpa = 70000, poisson_ratio = 0.3, density_kg_m3 = 2700, yield_mpa = 300 }
"""
STAGE = """
[[body]]
name = "table NUMBER"
in_layers = [NUMBER]
box_mm = [X0, X1, 26, 32]
[[flexure]]
name = "left NUMBER"
kind = "leaf"
layer = NUMBER
at_mm = [X0 + 3, 16]
axis_deg = 90
thickness_mm = 0.5
half_length_mm = 11
[[flexure]]
name = "right NUMBER"
kind = "leaf"
layer = NUMBER
at_mm = [X1 - 3, 16]
axis_deg = 90
thickness_mm = 0.5
half_length_mm = 11
[[drive]]
name = "drive NUMBER"
box_mm = [X0, X0, 27, 31]
direction = [1, 0]
across = "free"
turns = "held"
"""
GROUND = """
[[body]]
name = "ground"
in_layers = [1, 2]
box_mm = [-2, 44, 0, 6]
[[fixed]]
box_mm = [-2, 44, 0, 0]
"""


def drawn(folder: Path, text: str) -> Mechanism:
    return drawing(folder, HEAD + text)


def stage(number: int, x0: float) -> str:
    text = STAGE.replace("NUMBER", str(number)).replace("[X0 + 3", f"[{x0 + 3}").replace("[X1 - 3", f"[{x0 + 37}")
    return text.replace("X0", str(x0)).replace("X1", str(x0 + 40))


def pivot(folder: Path, top_mm: float, more: str = "") -> Mechanism:
    """Two leaves at 45 degrees that cross at (0, 20) mm in two layers, between bodies that lie in both."""
    leaves = "".join(
        f'[[flexure]]\nname = "leaf {layer}"\nkind = "leaf"\nlayer = {layer}\nat_mm = [{sign * (top_mm / 2 - 20)}, '
        f"{top_mm / 2}]\naxis_deg = {angle}\nthickness_mm = 0.5\nhalf_length_mm = {top_mm / 2**0.5 + 1.5}\n"
        for layer, angle, sign in ((1, 45, 1), (2, 135, -1))
    )
    bodies = "".join(
        f'[[body]]\nname = "{name}"\nin_layers = [1, 2]\nbox_mm = [-30, 30, {low}, {low + 10}]\n'
        for name, low in (("foot", -10), ("head", top_mm))
    )
    rest = f'[drive]\npin_mm = [0, {top_mm + 8}, 2]\ndirection = [1, 0]\nacross = "free"\n'
    rest += f"[[fixed]]\nbox_mm = [-30, 30, -10, -10]\n[[probe]]\nname = 'end'\nat_mm = [25, {top_mm + 5}]\n"
    return drawn(folder, bodies + leaves + rest + more)


@pytest.mark.parametrize("kind", [MechanismFrame, RigidBodies])
@pytest.mark.parametrize("top_mm", [40.0, 30.0])
def test_leaves_that_cross_in_two_layers_are_wittricks_pivot(
    tmp_path: Path, kind: type[MechanismFrame | RigidBodies], top_mm: float
) -> None:
    """Stiffness 8 E I / L (3 l^2 - 3 l + 1) about the crossing, at the share l of the leaves' length L.

    Source: Wittrick, The properties of crossed flexure pivots, Aeronautical Quarterly 2 (1951) 272. The leaves stretch
    by less than 1e-4 of the motion.
    """
    model = kind(pivot(tmp_path, top_mm))
    length, share, arm = top_mm * 2.0**0.5, 20.0 / top_mm, top_mm - 12.0
    turning = 8.0 * 70000.0 * 4.0 * 0.5**3 / 12.0 / length * (3.0 * share**2 - 3.0 * share + 1.0)
    assert model.stiffness_n_mm == pytest.approx(turning / arm**2, rel=model.force_error)
    moved = model.state(1.0)
    assert moved.bodies["head"].angle_mrad == pytest.approx(-1e3 / arm, rel=1e-3)
    assert moved.probes_mm["end"] == pytest.approx((1.0 - 3.0 / arm, -25.0 / arm), abs=2e-3)
    if isinstance(model, MechanismFrame):
        mass_t = 2700e-12 * 60.0 * 10.0 * 8.0  # of a head as thick as both layers
        inertia = mass_t * ((60.0**2 + 10.0**2) / 12.0 + (top_mm - 15.0) ** 2)
        first_hz = np.sqrt(turning / inertia) / (2.0 * np.pi)
        assert model.modes_hz(drive_held=False)[0] == pytest.approx(first_hz, rel=0.015)


@pytest.mark.parametrize("kind", [MechanismFrame, RigidBodies])
def test_tables_over_each_other_are_not_fused(tmp_path: Path, kind: type[ElasticMechanism]) -> None:
    """Two stages on one ground, a millimetre and a half apart in two layers, move like each alone."""
    alone = kind(drawn(tmp_path, GROUND.replace("in_layers = [1, 2]\n", "") + stage(1, 0.0)))
    both = kind(drawn(tmp_path, GROUND + stage(1, 0.0) + stage(2, 1.5)))
    assert {body.name for body in both.bodies} == {"ground", "table_1", "table_2"}
    held = 0.6 * 0.5 / 20.0 if kind is MechanismFrame else 0.0  # the ground is thicker than the leaves are wide
    assert both.stiffness_n_mm == pytest.approx(2.0 * alone.stiffness_n_mm, rel=held + 2e-3)
    assert both.force_error > held
    first, second = both.drive_states()
    for name, state in (("drive 1", first), ("drive 2", second)):
        assert state.drives_n[name] == pytest.approx(alone.stiffness_n_mm, rel=held + 2e-3)
        assert sum(map(abs, state.drives_n.values())) == pytest.approx(state.drives_n[name], rel=1e-3)
    moving, still = first.bodies["table_1"], first.bodies["table_2"]
    assert moving.x_mm == pytest.approx(1.0, rel=1e-3)
    assert abs(still.x_mm) < 1e-4


def test_a_drawing_in_one_layer_is_the_same_with_its_number(tmp_path: Path) -> None:
    plain, numbered = (
        drawn(tmp_path, (GROUND + stage(1, 0.0)).replace("in_layers = [1, 2]\n", "").replace(*change))
        for change in (("layer = 1\n", ""), ("layer = 1\n", "layer = 1\n"))
    )
    assert not numbered.layers
    assert plain.region.steps == numbered.region.steps
    assert MechanismFrame(plain).stiffness_n_mm == MechanismFrame(numbered).stiffness_n_mm


def test_what_has_no_layers_says_so(tmp_path: Path) -> None:
    mechanism = pivot(tmp_path, 40.0)
    with pytest.raises(ModelError, match=r"several layers.*--kind lumped"):
        MechanismPlate(mechanism)
    with pytest.raises(UsageError, match="one layer"):
        write_outline(tmp_path / "pivot.stl", mechanism)


WRONG = [
    ("[[body]]\nname = 'x'\nin_layers = []\nbox_mm = [0, 1, 0, 1]\n", "body x.in_layers"),
    ("[[body]]\nname = 'x'\nin_layers = [1, 1]\nbox_mm = [0, 1, 0, 1]\n", "[1, 1]"),
    ("[[body]]\nname = 'x'\nin_layers = [0]\nbox_mm = [0, 1, 0, 1]\n", "[0]"),
    ("[[body]]\nname = 'x'\nin_layers = [3]\nbox_mm = [100, 101, 0, 1]\n", "x 100 to 101"),
    (
        "[[body]]\nname = 'x'\nin_layers = [3]\nbox_mm = [-30, 30, 41, 42]\n",
        "in layer 3 at x -30 to 30, y 41 to 42 mm (x); ",
    ),
]


@pytest.mark.parametrize(("more", "said"), WRONG)
def test_wrong_layers_are_one_sentence_with_their_place(tmp_path: Path, more: str, said: str) -> None:
    with pytest.raises(FingervisionError) as refused:
        pivot(tmp_path, 40.0, more)
    assert said in str(refused.value)


def test_what_lies_over_itself_is_refused_with_its_place(tmp_path: Path) -> None:
    """A probe where two tables lie over each other, and arms of one body that no flexure joins."""
    text = GROUND + stage(1, 0.0) + stage(2, 1.5)
    with pytest.raises(DataError, match=r"probe p .*\(20, 29\) mm.*layers 1, 2"):
        drawn(tmp_path, text + "[[probe]]\nname = 'p'\nat_mm = [20, 29]\n")
    arms = "".join(f"[[body]]\nin_layers = [{layer}]\nbox_mm = [43, 60, 2, 5]\n" for layer in (1, 2))
    with pytest.raises(DataError, match=r"in layers 1 and 2 must not lie over each other"):
        MechanismFrame(drawn(tmp_path, text + arms))


@pytest.mark.slow
def test_the_command_computes_a_drawing_with_layers(tmp_path: Path) -> None:
    pivot(tmp_path, 40.0)
    asked = [str(tmp_path / "mechanism.toml"), "--out", str(tmp_path / "out"), "--modes", "2"]
    said = CliRunner().invoke(command, asked, catch_exceptions=False)
    assert said.exit_code == 0
    assert "The layers 1, 2, each 4 mm thick, are joined only by foot, head." in said.output
