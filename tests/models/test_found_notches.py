"""Notches that an outline leaves, against scripts that draw them, named flexures, and wedge elements of CalculiX."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import fingervision
from fingervision.cli.model import command
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.gripper_mechanism import whole_mechanism
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Mechanism
from fingervision.models.strips import necks_of
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.outline_file import write_outline
from tests.drawings import drawing
from tests.models.coarse import coarse_elements

ezdxf = pytest.importorskip("ezdxf")
pytest.importorskip("svgelements")

MICRO = Path(fingervision.__file__).parent / "models" / "micro_gripper.toml"
HEAD = """
plate_mm = 4.0
material = { name = "m", youngs_modulus_mpa = 70000, poisson_ratio = 0.33, density_kg_m3 = 2700, yield_mpa = 300 }
"""
BEAM = (
    HEAD
    + """
[[fixed]]
box_mm = [0, 0, 0, 10]
[drive]
box_mm = [40, 40, 0, 10]
direction = [0, 1]
across = "free"
[[body]]
box_mm = [0, 40, 0, 10]
"""
)
ONE_SIDED = "[[body]]\ncut = true\ndisc_mm = [20, 4.5, 4]\n[[body]]\ncut = true\nbox_mm = [19, 21, 4.5, 12]\n"
TILTED = "".join(f"[[body]]\ncut = true\nellipse_mm = [{x}, {y}, 6, 3.6, 14.036243]\n" for x, y in ((19, 9), (21, 1)))
SHORT = """
[[flexure]]
name = "short"
kind = "filleted"
at_mm = [20, 5]
axis_deg = 0
thickness_mm = 1.0
half_length_mm = 2
depth_mm = 6
fillet_mm = 1.5
"""


def read_again(folder: Path, cuts: str, ending: str = "dxf") -> Mechanism:
    """The drawing whose body is the outline that the product exports."""
    write_outline(folder / f"part.{ending}", drawing(folder, BEAM + cuts))
    return drawing(folder, BEAM.replace("box_mm = [0, 40, 0, 10]", f'outline = "part.{ending}"'), "again")


@pytest.mark.parametrize("ending", ["dxf", "svg"])
def test_a_gripper_that_is_exported_and_read_again_has_its_hinges(tmp_path: Path, ending: str) -> None:
    gripper = read_gripper(MICRO)
    whole = whole_mechanism(gripper, gripper, "micro")
    write_outline(tmp_path / f"micro.{ending}", whole)
    left_mm = 0.0 if ending == "dxf" else -2.5  # an SVG page begins at the outline's lower left corner
    x0, x1, y, _ = gripper.links.pillar_and_root_mm
    half, at, (tip_x, tip_y) = gripper.lever.drive_face_half_width_mm, gripper.lever.drive_face_y_mm, (
        gripper.measuring_point_mm
    )  # fmt: skip
    material = gripper.material
    text = f"""
plate_mm = {gripper.body.plate_mm}
[material]
name = "m"
youngs_modulus_mpa = {material.youngs_modulus_mpa}
poisson_ratio = {material.poisson_ratio}
density_kg_m3 = {material.density_kg_m3}
yield_mpa = {material.yield_mpa}
[[body]]
outline = "micro.{ending}"
[[fixed]]
box_mm = [{-x1 - left_mm}, {-x0 - left_mm}, {y}, {y}]
[[fixed]]
box_mm = [{x0 - left_mm}, {x1 - left_mm}, {y}, {y}]
[drive]
box_mm = [{-half - left_mm}, {half - left_mm}, {at}, {at}]
direction = [0, 1]
[[probe]]
name = "left"
at_mm = [{-tip_x - left_mm}, {tip_y}]
[[probe]]
name = "right"
at_mm = [{tip_x - left_mm}, {tip_y}]
[[pair]]
name = "gap"
of = ["left", "right"]
"""
    again = drawing(tmp_path, text)
    assert [flexure.name for flexure in again.strips] == [f"notch {n}" for n in range(1, 5)]
    for hinge in whole.flexures:
        own = min(again.strips, key=lambda f: np.hypot(*np.subtract(f.at_mm, np.subtract(hinge.at_mm, (left_mm, 0)))))
        assert own.at_mm == pytest.approx((hinge.at_mm[0] - left_mm, hinge.at_mm[1]), abs=1e-5)
        assert (own.kind, own.lean) == ("circular", 0.0)
        assert own.thickness_mm == pytest.approx(hinge.thickness_mm, rel=1e-4)
        assert own.half_length_mm == pytest.approx(hinge.half_length_mm, rel=1e-4)
        assert abs(np.sin(np.radians(own.axis_deg - hinge.axis_deg))) < 1e-4
    for kind in (coarse_elements, MechanismFrame) if ending == "dxf" else ():
        ours, theirs = kind(again), kind(whole)
        assert ours.stiffness_n_mm == pytest.approx(theirs.stiffness_n_mm, rel=0.002)
        ratios = [model.state(0.1).pairs_mm["gap"] - model.state(0.0).pairs_mm["gap"] for model in (ours, theirs)]
        assert ratios[0] == pytest.approx(ratios[1], rel=5e-4)
        assert ours.force_error == pytest.approx(theirs.force_error, rel=0.05)


def test_a_four_bar_that_a_script_draws_is_the_one_with_named_hinges(tmp_path: Path) -> None:
    """Two pillars with a notch at both ends, as lines and arcs; the named drawing states what the script draws."""
    t, radius, notches = 0.6, 2.0, (14.0, 26.0)
    half = 0.5 * t + radius
    document = ezdxf.new(units=4)
    space = document.modelspace()
    for x in (0.0, 30.0):
        for face, first, last in ((x + half, 90, 270), (x - half, -90, 90)):
            stops = [10.0, *(y + side * radius for y in notches for side in (-1.0, 1.0)), 30.0]
            for low, high in zip(stops[::2], stops[1::2], strict=True):
                space.add_line((face, high), (face, low))
            for y in notches:
                space.add_arc((face, y), radius, first, last)
    for y, beyond in ((10.0, 0.0), (30.0, 40.0)):
        corners = [(-half, y), (-10, y), (-10, beyond), (40, beyond), (40, y), (30 + half, y)]
        for ends in (*pairwise(corners), ((half, y), (30 - half, y))):
            space.add_line(*ends)
    document.saveas(tmp_path / "four.dxf")
    faces = """
[[fixed]]
box_mm = [-10, 40, 0, 0]
[drive]
box_mm = [-10, -10, 30, 40]
direction = [1, 0]
across = "free"
"""
    found = drawing(tmp_path, HEAD + faces + '[[body]]\noutline = "four.dxf"\n')
    assert sorted((round(f.at_mm[0], 9) + 0.0, round(f.at_mm[1], 9)) for f in found.strips) == [
        (x, y) for x in (0.0, 30.0) for y in notches
    ]
    for flexure in found.strips:
        assert flexure.kind == "circular"
        assert (flexure.thickness_mm, flexure.half_length_mm) == pytest.approx((t, radius), rel=1e-9)
    named = "".join(f"[[body]]\nbox_mm = {box}\n" for box in ([-10, 40, 0, 10], [-10, 40, 30, 40]))
    for x in (0, 30):
        named += f"[[body]]\nbox_mm = [{x - half}, {x + half}, 9, 31]\n" + "".join(
            f'[[flexure]]\nname = "{x} {y}"\nkind = "circular"\nat_mm = [{x}, {y}]\naxis_deg = 90\n'
            f"thickness_mm = {t}\nradius_mm = {radius}\n"
            for y in notches
        )
    other = drawing(tmp_path, HEAD + faces + named)
    for kind in (MechanismPlate, MechanismFrame):
        ours, theirs = kind(found), kind(other)
        assert ours.stiffness_n_mm == pytest.approx(theirs.stiffness_n_mm, rel=3e-4)
        assert ours.state(1.0).stress_mpa == pytest.approx(theirs.state(1.0).stress_mpa, rel=2e-3)
        assert ours.modes_hz(drive_held=False) == pytest.approx(theirs.modes_hz(drive_held=False), rel=2e-3)


def test_a_tilted_elliptic_notch_in_arcs_is_that_ellipse(tmp_path: Path) -> None:
    """The neck of two equal ellipses whose axes go through their middle lies on their small axes."""
    (notch,) = read_again(tmp_path, TILTED).strips
    assert (notch.kind, notch.at_mm) == ("elliptic", pytest.approx((20.0, 5.0), abs=1e-4))
    assert (notch.half_length_mm, notch.depth_mm) == pytest.approx((6.0, 3.6), rel=1e-3)
    assert notch.thickness_mm == pytest.approx(2.0 * (np.hypot(4.0, 1.0) - 3.6), rel=1e-3)
    assert notch.axis_deg % 180.0 == pytest.approx(14.0362, abs=1e-2)
    again, cut = (MechanismFrame(read_again(tmp_path, TILTED)), MechanismFrame(drawing(tmp_path, BEAM + TILTED)))
    assert again.stiffness_n_mm == pytest.approx(cut.stiffness_n_mm, rel=1e-3)


def test_a_short_neck_between_fillets_is_a_flexure(tmp_path: Path) -> None:
    """It is as long as thick between its fillets, which is less than two thicknesses without them."""
    again, named = read_again(tmp_path, SHORT), drawing(tmp_path, BEAM + SHORT)
    (strip,) = again.strips
    assert (strip.thickness_mm, strip.half_length_mm, strip.fillet_mm) == pytest.approx((1.0, 2.0, 1.5))
    for kind in (coarse_elements, MechanismFrame):
        assert kind(again).stiffness_n_mm == pytest.approx(kind(named).stiffness_n_mm, rel=1e-3)


@pytest.mark.parametrize(
    ("cuts", "plate_mm", "force_n", "stress_mpa"),
    [(ONE_SIDED, 4.0, 3.13711, 390.52), (ONE_SIDED, 1.0, 0.745903, 367.65)],
)
def test_a_notch_from_one_side_is_within_its_stated_errors(
    tmp_path: Path, cuts: str, plate_mm: float, force_n: float, stress_mpa: float
) -> None:
    """Force and largest von Mises stress per 1 mm at any depth, by wedge elements of CalculiX."""
    mechanism = drawing(tmp_path, BEAM.replace("plate_mm = 4.0", f"plate_mm = {plate_mm}") + cuts)
    (notch,) = mechanism.strips
    assert (notch.kind, notch.at_mm) == ("elliptic", pytest.approx((20.0, 0.25)))
    assert (notch.thickness_mm, notch.half_length_mm, notch.depth_mm) == pytest.approx((0.5, 4.0, 2.0))
    for kind in (MechanismPlate, MechanismFrame):
        model = kind(mechanism)
        assert model.stiffness_n_mm == pytest.approx(force_n, rel=model.force_error)
        assert model.state(1.0).stress_mpa == pytest.approx(stress_mpa, rel=model.stress_error)
    assert MechanismPlate(mechanism).stiffness_n_mm == pytest.approx(force_n, rel=0.002)


@pytest.mark.parametrize(
    ("cut", "place", "thickness"),
    [
        ("disc_mm = [30, 6, 3.5]", (30.0, 9.75), 0.5),  # a bolt hole near the edge
        ("disc_mm = [30, 5, 3]\n[[body]]\ncut = true\ndisc_mm = [30, 10, 1.5]", (30.0, 8.25), 0.5),  # unlike arcs
    ],
)
def test_a_neck_that_is_no_flexure_is_warned_of(
    tmp_path: Path, cut: str, place: tuple[float, float], thickness: float
) -> None:
    mechanism = drawing(
        tmp_path, BEAM + TILTED.replace("19, 9", "13, 9").replace("21, 1", "15, 1") + f"[[body]]\ncut = true\n{cut}\n"
    )
    assert [flexure.name for flexure in mechanism.strips] == ["notch 1"]
    found = necks_of(mechanism.region, mechanism.flexures)
    assert any(np.hypot(*np.subtract(at, place)) < 0.2 and t == pytest.approx(thickness, abs=0.05) for at, t in found)


@pytest.mark.slow
def test_the_command_says_which_notches_it_took_for_flexures(tmp_path: Path) -> None:
    drawing(tmp_path, BEAM + ONE_SIDED)
    asked = [str(tmp_path / "mechanism.toml"), "--kind", "lumped", "--out", str(tmp_path / "out")]
    said = CliRunner().invoke(command, asked, catch_exceptions=False)
    assert "notch 1 at (20, 0.25) mm, 0.5 mm thick and 8 mm long, is treated as a flexure" in said.output
