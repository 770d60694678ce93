"""Strips that cuts leave and accidental necks, against the same drawings with named flexures."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli.model import command
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_figures import width_effect
from fingervision.models.strips import necks_of, strips_of
from tests.drawings import drawing

HEAD = """
plate_mm = 4.0
material = { name = "m", youngs_modulus_mpa = 1000.0, poisson_ratio = 0.34, density_kg_m3 = 1000.0, yield_mpa = 40.0 }
[[fixed]]
box_mm = [0, 0, 0, 10]
[drive]
box_mm = [40, 40, 0, 10]
direction = [0, 1]
"""
CUT = """
[[body]]
name = "block"
box_mm = [0, 40, 0, 10]
[[body]]
name = "slot above"
cut = true
box_mm = [15, 25, 5.5, 11]
[[body]]
name = "slot below"
cut = true
box_mm = [15, 25, -1, 4.5]
"""
NAMED = """
[[body]]
box_mm = [0, 15, 0, 10]
[[body]]
box_mm = [25, 40, 0, 10]
[[flexure]]
name = "leaf"
kind = "leaf"
at_mm = [20, 5]
axis_deg = 0
thickness_mm = 1.0
half_length_mm = 6.0
"""


def drawn(folder: Path, bodies: str) -> Mechanism:
    return drawing(folder, HEAD + bodies)


def test_a_strip_between_two_slots_is_the_leaf_that_it_is(tmp_path: Path) -> None:
    cut, named = drawn(tmp_path, CUT), drawn(tmp_path, NAMED)
    (strip,) = cut.strips
    assert not named.strips
    assert strip.at_mm == pytest.approx((20.0, 5.0))
    assert (strip.thickness_mm, strip.half_length_mm, strip.fillet_mm) == pytest.approx((1.0, 5.0, 0.0))
    for kind in (MechanismPlate, MechanismFrame):
        ours, theirs = kind(cut), kind(named)
        # The leaf is drawn a millimetre into its bodies, which its zone of restraint covers too.
        assert ours.stiffness_n_mm == pytest.approx(theirs.stiffness_n_mm, rel=0.004)
        assert ours.force_error == pytest.approx(theirs.force_error, rel=0.05)
        assert ours.state(1.0).stress_mpa == pytest.approx(theirs.state(1.0).stress_mpa, rel=0.02)


@pytest.mark.parametrize(("turns", "stress_mpa"), [("held", 10.78), ("free", 1.227)])
def test_the_stress_beside_sharp_roots_is_within_its_stated_error(
    tmp_path: Path, turns: str, stress_mpa: float
) -> None:
    """Largest von Mises stress at any depth, half a thickness from the roots and beyond, by wedge elements of
    CalculiX.
    """
    text = HEAD.replace("0.34", "0.35") + f'across = "free"\nturns = "{turns}"\n' + NAMED
    mechanism = drawing(tmp_path, text.replace("thickness_mm = 1.0", "thickness_mm = 0.4"))
    for kind in (MechanismPlate, MechanismFrame):
        model = kind(mechanism)
        assert model.stress_error < 0.08
        assert model.state(1.0).stress_mpa == pytest.approx(stress_mpa, rel=model.stress_error)


def test_the_width_of_a_cut_strip_makes_it_stiffer(tmp_path: Path) -> None:
    """By the plate's energy, a strip as wide as 0.4 of its length is some percent stiffer than a bar."""
    cut = drawn(tmp_path, CUT)
    stiffer = MechanismPlate(cut).stiffness_n_mm / MechanismPlate(cut, width_effect=False).stiffness_n_mm
    named = width_effect(MechanismPlate(cut))["width_effect_force_percent"]
    assert named == pytest.approx(100.0 * (stiffer - 1.0))
    assert 1.02 < stiffer < 1.0 / (1.0 - 0.34**2)


def test_fillets_belong_to_a_strip_and_thick_bars_are_none(tmp_path: Path) -> None:
    rounded = CUT.replace("5.5, 11]", "6.0, 11]").replace("-1, 4.5]", "-1, 4.0]")
    for low, middle in ((5.5, 6.0), (3.5, 4.0)):
        cuts = [f"box_mm = [15.5, 24.5, {low}, {low + 1}]", *(f"disc_mm = [{x}, {middle}, 0.5]" for x in (15.5, 24.5))]
        rounded += "".join(f"[[body]]\ncut = true\n{cut}\n" for cut in cuts)
    (strip,) = drawn(tmp_path, rounded).strips
    assert (strip.thickness_mm, strip.half_length_mm, strip.fillet_mm) == pytest.approx((1.0, 5.0, 0.5))
    thick = CUT.replace("5.5, 11]", "6.5, 11]").replace("-1, 4.5]", "-1, 3.5]")
    assert not drawn(tmp_path, thick).strips


def test_a_strip_at_the_edge_has_fillets_on_one_side(tmp_path: Path) -> None:
    """A window with rounded corners leaves a leaf on either side; the outer sides of the leaves go on straight."""
    window = """
[[body]]
box_mm = [0, 40, 0, 10]
[[body]]
cut = true
polygon_mm = [[11, 0.6], [29, 0.6], [30, 1.6], [30, 8.4], [29, 9.4], [11, 9.4], [10, 8.4], [10, 1.6]]
bulges = [0, 0.41421356, 0, 0.41421356, 0, 0.41421356, 0, 0.41421356]
"""
    mechanism = drawn(tmp_path, window)
    assert [(*s.at_mm, s.thickness_mm, s.fillet_mm) for s in mechanism.strips] == [
        pytest.approx((20.0, y, 0.6, 1.0), abs=1e-6) for y in (0.3, 9.7)
    ]
    ours, theirs = MechanismFrame(mechanism), MechanismPlate(mechanism)
    assert ours.stiffness_n_mm == pytest.approx(theirs.stiffness_n_mm, rel=ours.force_error)
    stress = theirs.state(1.0).stress_mpa
    assert ours.state(1.0).stress_mpa == pytest.approx(stress, rel=ours.stress_error)
    assert MechanismPlate(mechanism, refine=1.6).state(1.0).stress_mpa == pytest.approx(stress, rel=0.01)


def test_an_accidental_neck_is_found_at_its_place(tmp_path: Path) -> None:
    hole = (
        NAMED
        + """
[[body]]
cut = true
disc_mm = [32, 7, 2.5]
"""
    )
    mechanism = drawn(tmp_path, hole)
    ((x, y), thickness), *_ = necks_of(mechanism.region, mechanism.flexures)
    assert (x, y) == pytest.approx((32.0, 9.75), abs=0.1)
    assert thickness == pytest.approx(0.5, abs=0.02)
    assert not necks_of(drawn(tmp_path, NAMED).region, mechanism.flexures)
    assert not strips_of(mechanism.region, mechanism.flexures)


def test_sides_that_the_box_of_a_face_divides_are_no_strip(tmp_path: Path) -> None:
    """The box of a face that crosses a bar puts a corner on both its sides, beyond which the bar goes on."""
    bar = '[[body]]\nbox_mm = [0, 40, 0, 2]\n[[slide]]\nbox_mm = [18, 22, -1, 3]\nholds = "x"\n'
    assert not drawn(tmp_path, bar).strips


@pytest.mark.slow
def test_the_command_says_what_it_took_for_a_flexure(tmp_path: Path) -> None:
    drawn(tmp_path, CUT)
    asked = [str(tmp_path / "mechanism.toml"), "--kind", "finite_element", "--out", str(tmp_path / "out")]
    said = CliRunner().invoke(command, asked, catch_exceptions=False)
    assert "strip 1 at (20, 5) mm, 1 mm thick and 10 mm long, is treated as a flexure" in said.output
    header, row = (tmp_path / "out" / "models.csv").read_text().splitlines()
    figures = dict(zip(header.split(","), row.split(","), strict=True))
    assert np.isfinite(float(figures["peak_stress_mpa_per_mm"]))
    assert 0.5 < float(figures["model_error_modes_percent"]) < 5.0
