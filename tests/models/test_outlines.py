"""Arcs, fillets and copies in drawings, against closed forms of areas and the same drawing written out."""

from math import atan, pi, tan
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.errors import DataError
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_bodies import bodies_of
from fingervision.models.planar_region import PlanarRegion, rounded_corner, sharp_corners_mm
from fingervision.models.plane_shapes import Ellipse, Polygon, RigidMap, box, in_arcs
from fingervision.storage.mechanism_toml import read_mechanism

HEAD = """
plate_mm = 4.0
material = { name = "m", youngs_modulus_mpa = 1000.0, poisson_ratio = 0.3, density_kg_m3 = 1000.0, yield_mpa = 40.0 }
"""
HALF = """
[[body]]
name = "foot"
box_mm = [-10, -5, 0, 6]
[[body]]
name = "arm"
box_mm = [-10, 10, 20, 26]
[[flexure]]
name = "leaf"
kind = "leaf"
at_mm = [-7.5, 13]
axis_deg = 90
thickness_mm = 0.5
half_length_mm = 8
[[fixed]]
name = "ground"
box_mm = [-10, -5, 0, 0]
[[probe]]
name = "end"
at_mm = [-10, 23]
[drive]
box_mm = [-10, -10, 20, 26]
direction = [1, 0]
across = "free"
"""
COPIED = """
[[copy]]
of = ["foot", "leaf", "ground", "end"]
mirror_x_mm = 0
suffix = " right"
"""
WRITTEN = """
[[body]]
name = "foot right"
box_mm = [5, 10, 0, 6]
[[flexure]]
name = "leaf right"
kind = "leaf"
at_mm = [7.5, 13]
axis_deg = 90
thickness_mm = 0.5
half_length_mm = 8
[[fixed]]
box_mm = [5, 10, 0, 0]
[[probe]]
name = "end right"
at_mm = [10, 23]
"""


def drawn(folder: Path, text: str) -> Mechanism:
    path = folder / "mechanism.toml"
    path.write_text(HEAD + text)
    return read_mechanism(path)


def area_mm2(region: PlanarRegion) -> float:
    return sum(loop.area_mm2 for loop in region.loops)


@pytest.mark.parametrize("bulge", [0.1, 1.0, 2.5, -0.1, -0.4])
def test_a_side_with_a_bulge_is_an_arc_of_its_angle(bulge: float) -> None:
    """The segment between an arc and its chord has the area r^2 (angle - sin angle) / 2."""
    polygon = Polygon(((0.0, 0.0), (4.0, 0.0), (4.0, 6.0), (0.0, 6.0)), (bulge, 0.0, 0.0, 0.0))
    angle = 4.0 * atan(abs(bulge))
    radius = 2.0 / np.sin(0.5 * angle)
    segment = 0.5 * radius**2 * (angle - np.sin(angle)) * np.sign(bulge)
    region = PlanarRegion(((True, polygon),))
    assert area_mm2(region) == pytest.approx(24.0 + segment, rel=1e-3)
    rng = np.random.default_rng(5)
    low, high = np.array([[-6.0], [-12.0]]), np.array([[10.0], [7.0]])
    inside = polygon.holds(low + (high - low) * rng.random((2, 200_000))).mean()
    assert inside * float(np.prod(high - low)) == pytest.approx(24.0 + segment, abs=0.6)


@pytest.mark.parametrize("angle_deg", [30.0, 90.0, 140.0])
@pytest.mark.parametrize("inward", [False, True])
def test_a_fillet_takes_or_adds_the_area_between_its_arc_and_the_corner(angle_deg: float, *, inward: bool) -> None:
    """Between two tangents of a circle and its arc lies r^2 (1/tan(a/2) - (pi - a)/2)."""
    angle, r = np.radians(angle_deg), 2.0
    far = (30.0 * np.cos(angle), 30.0 * np.sin(angle))
    corner = Polygon(((0.0, 0.0), (30.0, 0.0), far))
    steps = ((True, box(-40.0, 40.0, -40.0, 40.0)), (False, corner)) if inward else ((True, corner),)
    before = PlanarRegion(steps)
    step = rounded_corner(before, (0.1, 0.1), r)
    after = PlanarRegion((*steps, step))
    assert step[0] is inward
    change = r**2 * (1.0 / tan(0.5 * angle) - 0.5 * (pi - angle))
    assert abs(area_mm2(after) - area_mm2(before)) == pytest.approx(change, rel=2e-3)
    assert len(after.loops) == len(before.loops)


def test_a_corner_that_is_rounded_is_not_sharp(tmp_path: Path) -> None:
    shape = "[[body]]\npolygon_mm = [[0,0],[30,0],[30,10],[10,10],[10,30],[0,30]]\n"
    rest = "[[fixed]]\nbox_mm = [0, 30, 0, 0]\n[drive]\nbox_mm = [0, 10, 30, 30]\ndirection = [1, 0]\n"
    sharp, fillet = drawn(tmp_path, shape + rest), "[[fillet]]\nat_mm = [10.5, 10]\nradius_mm = 3\n"
    rounded = drawn(tmp_path, shape + fillet + rest)
    assert len(sharp_corners_mm(sharp.region)) == 1
    assert not sharp_corners_mm(rounded.region)
    assert np.isfinite(MechanismPlate(rounded).state(0.1).stress_mpa)
    for at, radius, said in (("[16, 16]", 3, "(10, 10)"), ("[10, 10]", 25, "20 mm")):
        with pytest.raises(DataError) as error:
            drawn(tmp_path, shape + fillet.replace("[10.5, 10]", at).replace("= 3", f"= {radius}") + rest)
        assert said in str(error.value)


def test_a_mirrored_half_is_the_whole_that_is_written_out(tmp_path: Path) -> None:
    copied, written = drawn(tmp_path, HALF + COPIED), drawn(tmp_path, HALF + WRITTEN)
    points = np.random.default_rng(2).uniform((-12.0, -1.0), (12.0, 27.0), (5000, 2)).T
    assert np.array_equal(copied.region.holds(points), written.region.holds(points))
    assert area_mm2(copied.region) == pytest.approx(area_mm2(written.region))
    assert [body.name for body in bodies_of(copied)] == [body.name for body in bodies_of(written)]
    assert copied.probes == written.probes
    assert [face.box_mm for face in copied.fixed] == [face.box_mm for face in written.fixed]


def test_copies_turn_and_move_and_name_what_is_wrong(tmp_path: Path) -> None:
    turned = COPIED.replace("mirror_x_mm = 0", "turn_deg = 180\nabout_mm = [0, 23]")
    point = drawn(tmp_path, HALF + turned.replace('"foot", "leaf", "ground", ', "")).probes["end right"]
    assert point == pytest.approx((10.0, 23.0))
    moved = COPIED.replace("mirror_x_mm = 0", "by_mm = [15, 0]")
    assert drawn(tmp_path, HALF + moved).region.steps == drawn(tmp_path, HALF + WRITTEN).region.steps
    wrong = (
        (COPIED.replace('"foot"', '"foto"'), "foto"),
        (COPIED.replace(" right", ""), "suffix"),
        (COPIED.replace("mirror_x_mm = 0", "turn_deg = 45"), "ground"),
        (COPIED + COPIED.lstrip(), "end right"),
        (COPIED.replace("mirror_x_mm = 0", "mirror_x_mm = 0\nmirror_y_mm = 0"), "mirror_y_mm"),
    )
    for text, said in wrong:
        with pytest.raises(DataError, match=said):
            drawn(tmp_path, HALF + text)


def test_a_map_keeps_inside_and_outside() -> None:
    shapes = (Polygon(((0.0, 0.0), (4.0, 0.0), (3.0, 5.0)), (0.3, -0.2, 0.0)), Ellipse((1.0, 2.0), (3.0, 1.0), 20.0))
    points = np.random.default_rng(3).uniform(-6.0, 6.0, (2, 3000))
    for place in (RigidMap(30.0, (1.0, 2.0)), RigidMap(-75.0, (0.5, 0.0), mirrored=True), RigidMap(90.0)):
        there = np.array([place.point((float(x), float(y))) for x, y in points.T]).T
        for shape in shapes:
            assert np.array_equal(shape.holds(points), place.shape(shape).holds(there))


def test_an_ellipse_in_arcs_is_within_the_tolerance() -> None:
    u, v = np.array([7.0, 0.0]), np.array([0.0, 2.0])
    arcs = in_arcs(lambda t: np.outer(u, np.cos(t)) + np.outer(v, np.sin(t)), 0.0, 2.0 * pi, 1e-3)
    polygon = Polygon(tuple(at for at, _ in arcs), tuple(bulge for _, bulge in arcs))
    points = np.concatenate([c.at(np.linspace(c.t0, c.t1, 40)) for c in polygon.curves()], axis=1)
    x, y = points[0] / 7.0, points[1] / 2.0
    # Distance from the ellipse to first order: level over slope.
    off = (x**2 + y**2 - 1.0) / (2.0 * np.hypot(x / 7.0, y / 2.0))
    assert np.abs(off).max() < 2e-3
    assert len(arcs) < 80
    circle = in_arcs(lambda t: np.stack([np.cos(t), np.sin(t)]), 0.0, 1.5, 1e-9)
    assert [bulge for _, bulge in circle] == pytest.approx([tan(1.5 / 4.0)])
