"""Outlines from and to DXF, SVG and STL, against drawings written by other programs' libraries and closed forms."""

import tomllib
from math import pi
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import fingervision
from fingervision.cli.model import command
from fingervision.domain.errors import DataError, FingervisionError, UsageError
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.gripper_mechanism import whole_mechanism
from fingervision.models.mechanism import Mechanism
from fingervision.models.planar_region import PlanarRegion
from fingervision.storage.gripper_toml import read_gripper
from fingervision.storage.outline_file import read_outline, write_outline
from tests.drawings import drawing

ezdxf = pytest.importorskip("ezdxf")
pytest.importorskip("svgelements")

MICRO = Path(fingervision.__file__).parent / "models" / "micro_gripper.toml"
REST = """
plate_mm = 4.0
material = { name = "m", youngs_modulus_mpa = 1000.0, poisson_ratio = 0.3, density_kg_m3 = 1000.0, yield_mpa = 40.0 }
[[fixed]]
box_mm = [0, 0, 0, 10]
[drive]
box_mm = [40, 40, 0, 10]
direction = [0, 1]
"""
SHAPES = """
[[body]]
name = "block"
box_mm = [0, 40, 0, 10]
[[body]]
cut = true
box_mm = [15, 25, 5.5, 11]
[[body]]
cut = true
box_mm = [15, 25, -1, 4.5]
[[body]]
cut = true
ellipse_mm = [32, 5, 4, 2, 30]
"""
PARTS = [(0, 0), (15, 0), (15, 4.5), (25, 4.5), (25, 0), (40, 0), (40, 10), (25, 10), (25, 5.5), (15, 5.5), (15, 10),
         (0, 10)]  # fmt: skip


def drawn(folder: Path, bodies: str) -> Mechanism:
    return drawing(folder, REST + bodies)


def area_mm2(region: PlanarRegion) -> float:
    """Area by Green's formula on fine chords."""
    total = 0.0
    for curve in (curve for loop in region.loops for curve in loop.curves):
        x, y = curve.at(np.linspace(curve.t0, curve.t1, 401))
        total += 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
    return total


def stl_volume_mm3(path: Path) -> tuple[float, bool]:
    """Volume by the divergence theorem, and whether every edge joins two triangles that run along it both ways."""
    data = path.read_bytes()
    record = np.frombuffer(data[84:], dtype=[("n", "<f4", 3), ("p", "<f4", (3, 3)), ("x", "<u2")])
    corners = record["p"].astype(float)
    volume = float(np.sum(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])))) / 6.0
    names = [[tuple(point) for point in triangle] for triangle in corners.tolist()]
    edges = [(t[i], t[(i + 1) % 3]) for t in names for i in range(3)]
    return volume, len(set(edges)) == len(edges) and {(b, a) for a, b in edges} == set(edges)


@pytest.fixture
def dxf(tmp_path: Path) -> Path:
    """A block with two slots and an elliptic hole, as lines in any order and direction, with other things beside it."""
    document = ezdxf.new(units=1)  # inches
    space = document.modelspace()
    sides = list(zip(PARTS, PARTS[1:] + PARTS[:1], strict=True))
    for place, (a, b) in enumerate(sides[::2] + sides[1::2]):
        a, b = (b, a) if place % 3 else (a, b)
        space.add_line(np.divide(a, 25.4).tolist(), np.divide(b, 25.4).tolist())
    space.add_ellipse((32 / 25.4, 5 / 25.4), (4 / 25.4 * np.cos(pi / 6), 4 / 25.4 * np.sin(pi / 6)), 0.5)
    document.layers.add("centre lines")
    space.add_line((-1, 0.2), (3, 0.2), dxfattribs={"layer": "centre lines"})
    space.add_text("hinge")
    document.saveas(tmp_path / "part.dxf")
    return tmp_path / "part.dxf"


def test_a_dxf_is_the_drawing_that_its_shapes_make(dxf: Path) -> None:
    read = drawn(dxf.parent, '[[body]]\nname = "block"\noutline = "part.dxf"\nlayer = "0"\n')
    written = drawn(dxf.parent, SHAPES)
    assert area_mm2(read.region) == pytest.approx(area_mm2(written.region), rel=1e-6)
    assert area_mm2(read.region) == pytest.approx(400.0 - 2.0 * 45.0 - 8.0 * pi, rel=1e-4)
    (strip,) = read.strips
    assert (*strip.at_mm, strip.thickness_mm) == pytest.approx((20.0, 5.0, 1.0), abs=1e-6)
    ours, theirs = MechanismPlate(read), MechanismPlate(written)
    assert ours.stiffness_n_mm == pytest.approx(theirs.stiffness_n_mm, rel=2e-4)


def test_lines_that_do_not_close_are_refused_with_their_place(dxf: Path) -> None:
    with pytest.raises(DataError) as error:
        read_outline(dxf)
    assert any(f"({x:g}, 5.08)" in str(error.value) for x in (-25.4, 76.2))
    with pytest.raises(DataError, match="centre lines"):
        read_outline(dxf, "outlines")
    for name, kind in (("none.dxf", "There is no"), ("part.step", "dxf")):
        (dxf.parent / "part.step").touch()
        with pytest.raises(FingervisionError, match=kind):
            read_outline(dxf.parent / name)
    (dxf.parent / "text.dxf").write_text("no drawing")
    with pytest.raises(DataError, match=r"text\.dxf"):
        read_outline(dxf.parent / "text.dxf")


@pytest.mark.parametrize(("unit", "factor", "said"), [
    (0, 1e-3, r"0\.041\d* mm across: are its lengths metres\? State unit_mm = 1000"),
    (1, 1.0, r"states inches, with which it is 10\d\d\.?\d* mm across: are its lengths mm\? State unit_mm = 1 "),
    (0, 1e3, r"are its lengths micrometres\? State unit_mm = 0\.001"),
    (21, 1.0, "must state a unit of length"),
])  # fmt: skip
def test_a_unit_that_makes_no_mechanism_is_asked_about(unit: int, factor: float, said: str, tmp_path: Path) -> None:
    path = tmp_path / "part.dxf"
    document = ezdxf.new(units=unit)
    document.modelspace().add_lwpolyline(factor * np.array(PARTS), close=True)
    document.saveas(path)
    begun = CliRunner().invoke(command, [str(path), "--out", str(tmp_path / "begun")])
    assert begun.exit_code == 1
    with pytest.raises(DataError, match=said):
        read_outline(path)
    stated = read_outline(path, unit_mm=1.0 / factor)
    assert area_mm2(PlanarRegion(stated.steps)) == pytest.approx(310.0)
    assert not stated.unit_words


def test_a_drawing_is_begun_from_one_layer_and_says_its_unit(dxf: Path) -> None:
    out = dxf.parent / "begun"
    refused = CliRunner().invoke(command, [str(dxf), "--out", str(out)])
    assert "--layer" in str(refused.exception)
    begun = CliRunner().invoke(command, [str(dxf), "--layer", "0", "--out", str(out)])
    assert begun.exit_code == 0
    assert "part.dxf: its header states inches, with which it is 41.23 mm across" in begun.output
    text = (out / "part.toml").read_text()
    body = tomllib.loads(text)["body"][0]
    assert body["layer"] == "0"
    path = out / "mechanism.toml"
    path.write_text(REST + "[[body]]\n" + text[text.index("outline =") :].partition("\n\n")[0])
    said = CliRunner().invoke(command, [str(path), "--kind", "lumped", "--out", str(out / "o")])
    assert "its header states inches" in said.output
    assert CliRunner().invoke(command, [str(path), "--layer", "0"]).exit_code != 0


def test_polylines_splines_and_blocks_are_read(tmp_path: Path) -> None:
    document = ezdxf.new(units=0)
    block = document.blocks.new("slot")
    block.add_lwpolyline([(0, 0, 0), (4, 0, 1), (4, 2, 0), (0, 2, 1)], format="xyb", close=True)
    space = document.modelspace()
    space.add_blockref("slot", (5, 4))
    space.add_blockref("slot", (20, 4), dxfattribs={"rotation": 90})
    space.add_circle((25, 12), 3)
    angles = np.linspace(0, 2 * pi, 40)
    space.add_spline([(15 + 22 * np.cos(a), 8 + 14 * np.sin(a)) for a in angles]).closed = False
    document.saveas(tmp_path / "part.dxf")
    steps, _ = read_outline(tmp_path / "part.dxf")
    assert [added for added, _ in steps] == [True, False, False, False]
    expected = pi * 22 * 14 - 2 * (8 + pi) - 9 * pi
    assert area_mm2(PlanarRegion(steps)) == pytest.approx(expected, rel=1e-4)
    assert area_mm2(PlanarRegion(read_outline(tmp_path / "part.dxf", unit_mm=10.0).steps)) == pytest.approx(
        100.0 * expected, rel=1e-4
    )


def test_an_svg_page_is_read_in_its_unit_with_y_upwards(tmp_path: Path) -> None:
    path = tmp_path / "part.svg"
    text = (
        '<svg xmlns="http://www.w3.org/2000/svg" width="10cm" height="50mm" viewBox="0 0 200 100">'
        '<g transform="translate(10, 0)"><rect width="100" height="40" rx="5"/><circle cx="50" cy="20" r="10"/></g>'
        "</svg>"
    )
    path.write_text(text)
    steps, _ = read_outline(path)
    region = PlanarRegion(steps)
    assert [added for added, _ in steps] == [True, False]
    assert area_mm2(region) == pytest.approx(50 * 20 - (4 - pi) * 2.5**2 - 25 * pi, rel=1e-5)
    assert region.holds(np.array([[20.0, 30.0, 54.0], [45.0, 40.0, 32.0]])).tolist() == [True, False, True]
    path.write_text(text.replace('width="10cm" height="50mm" ', ""))
    with pytest.raises(DataError, match="unit_mm"):
        read_outline(path)
    assert area_mm2(PlanarRegion(read_outline(path, unit_mm=0.5).steps)) == pytest.approx(area_mm2(region), rel=1e-5)


@pytest.mark.parametrize("ending", [".dxf", ".svg"])
def test_what_is_written_is_read_again(ending: str, tmp_path: Path) -> None:
    mechanism = drawn(tmp_path, SHAPES)
    write_outline(tmp_path / f"out{ending}", mechanism)
    again = PlanarRegion(read_outline(tmp_path / f"out{ending}").steps)
    assert area_mm2(again) == pytest.approx(area_mm2(mechanism.region), rel=1e-5)
    points = np.random.default_rng(4).uniform((-1.0, -1.0), (41.0, 11.0), (4000, 2)).T
    assert np.mean(again.holds(points) != mechanism.region.holds(points)) < 1e-3


def test_sides_shorter_than_ends_may_be_apart_are_read(tmp_path: Path) -> None:
    """The union of the gripper's shapes leaves sides of 25 nm, which is less than CAD programs round to."""
    gripper = read_gripper(MICRO)
    mechanism = whole_mechanism(gripper, gripper, "gripper")
    write_outline(tmp_path / "gripper.dxf", mechanism)
    again = PlanarRegion(read_outline(tmp_path / "gripper.dxf").steps)
    assert area_mm2(again) == pytest.approx(area_mm2(mechanism.region), rel=1e-4)  # corners move by 80 nm at most


def test_a_printed_plate_has_its_area_times_its_thickness(tmp_path: Path) -> None:
    mechanism = drawn(tmp_path, SHAPES)
    said = write_outline(tmp_path / "out.stl", mechanism)
    volume, closed = stl_volume_mm3(tmp_path / "out.stl")
    assert "4 mm thick" in said
    assert closed
    assert volume == pytest.approx(4.0 * area_mm2(mechanism.region), rel=3e-4)
    with pytest.raises(UsageError, match="step"):
        write_outline(tmp_path / "out.step", mechanism)
