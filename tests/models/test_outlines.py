"""Arcs, fillets and copies in drawings, against closed forms of areas and the same drawing written out."""

from math import atan, pi, tan
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.errors import FingervisionError
from fingervision.models.finite_element import MechanismPlate
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_bodies import bodies_of
from fingervision.models.planar_region import PlanarRegion, rounded_corner, sharp_corners_mm
from fingervision.models.plane_shapes import Ellipse, Polygon, RigidMap, box, in_arcs
from tests.drawings import drawing

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
    return drawing(folder, HEAD + text)


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


def test_a_mirrored_half_is_the_whole_that_is_written_out(tmp_path: Path) -> None:
    copied, written = drawn(tmp_path, HALF + COPIED), drawn(tmp_path, HALF + WRITTEN)
    points = np.random.default_rng(2).uniform((-12.0, -1.0), (12.0, 27.0), (5000, 2)).T
    assert np.array_equal(copied.region.holds(points), written.region.holds(points))
    assert area_mm2(copied.region) == pytest.approx(area_mm2(written.region))
    assert [body.name for body in bodies_of(copied)] == [body.name for body in bodies_of(written)]
    assert copied.probes == written.probes
    assert [face.box_mm for face in copied.fixed] == [face.box_mm for face in written.fixed]


def test_copies_turn_and_move(tmp_path: Path) -> None:
    turned = COPIED.replace("mirror_x_mm = 0", "turn_deg = 180\nabout_mm = [0, 23]")
    point = drawn(tmp_path, HALF + turned.replace('"foot", "leaf", "ground", ', "")).probes["end right"]
    assert point == pytest.approx((10.0, 23.0))
    moved = COPIED.replace("mirror_x_mm = 0", "by_mm = [15, 0]")
    assert drawn(tmp_path, HALF + moved).region.steps == drawn(tmp_path, HALF + WRITTEN).region.steps


FILLET, BODY, MORE = "[[fillet]]\nat_mm = ", "[[body]]\n", "[[copy]]\nof = "
WRONG = [
    (FILLET + "[0, 0]\nradius_mm = 1", "fillet.at_mm", "(-5, 0) mm"),
    (FILLET + "[-10, 26]\nradius_mm = 30", "fillet.at_mm", "(-10, 26) mm"),
    (FILLET + "[-10, 26]\nradius_mm = -1", "fillet.radius_mm", "is -1"),
    (FILLET + "[-10, 26]", "[fillet]", "radius_mm"),
    (FILLET + "[-10]\nradius_mm = 1", "fillet.at_mm", "[-10]"),
    (MORE + '["nobody"]', "copy 2.of", "no nobody"),
    (MORE + '"leaf"', "copy 2.of", "'leaf'"),
    (MORE + '["leaf"]\nsuffix = ""', "copy 2.suffix", "empty"),
    (MORE + '["leaf"]\nsuffix = " right"', "copy 2.suffix", "leaf right"),
    (MORE + '["leaf"]\nmirror_x = 0', "copy 2.mirror_x", "mirror_x_mm"),
    (MORE + '["leaf"]\nmirror_x_mm = 0\nmirror_y_mm = 0', "copy 2.mirror_y_mm", "180"),
    (MORE + '["ground"]\nturn_deg = 30', "copy 2.turn_deg", "ground"),
    (MORE + '["end"]\nby_mm = [100, 0]\nsuffix = " far"', "probe end far", "(90, 23) mm"),
    (MORE + '["foot"]\nby_mm = [100, 0]\nsuffix = " far"', "x 90 to 95", "foot far"),
    (MORE + '["leaf"]\nby_mm = [0.1, 0]\nsuffix = " near"', "flexure leaf", "(-7.5, 13) mm"),
    (BODY + "polygon_mm = [[0, 0], [5, 5], [5, 0], [0, 5]]", "body 3.polygon_mm", "crossing"),
    (BODY + "polygon_mm = [[0, 22], [5, 22], [5, 24]]\nbulges = [0.5]", "body 3.bulges", "are 1"),
    (BODY + "box_mm = [0, 5, 22, 24]\nbulges = [1]", "body 3.bulges", "box_mm"),
    (BODY + 'outline = "missing.dxf"', "missing.dxf", "no drawing"),
    (BODY + 'outline = "mechanism.toml"', "mechanism.toml", ".dxf or .svg"),
    (BODY + 'outline = "a.dxf"\nbox_mm = [0, 1, 0, 1]', "body 3", "box_mm and outline"),
    (BODY + 'outline = "a.svg"\nunit_mm = 0', "body 3.unit_mm", "is 0"),
]
CHANGED = [
    ("half_length_mm = 8", "half_length_mm = 3", ["x 5 to 10, y 0 to 6 mm (foot right)"]),
    ("thickness_mm = 0.5", "thickness_mm = 0", ["flexure.thickness_mm"]),
    ("thickness_mm = 0.5", "thickness_mm = 20", ["flexure leaf"]),
    ("axis_deg = 90", "axis_deg = 0", ["y 0 to 6 mm (foot)"]),
    ('kind = "leaf"', 'kind = "blade"', ["flexure.kind"]),
    ("at_mm = [-7.5, 13]", 'at_mm = [-7.5, "l / 2"]', ["no l in [lengths]"]),
    ("at_mm = [-10, 23]", "at_mm = [-30, 23]", ["probe end"]),
    ("box_mm = [-10, 10, 20, 26]", "box_mm = [10, -10, 20, 26]", ["body arm.box_mm"]),
    ("direction = [1, 0]", "direction = [0, 0]", ["drive.direction"]),
    ('across = "free"', 'across = "loose"', ["drive.across"]),
    ('across = "free"', 'across = "free"\nforce_n_per_input = 0', ["drive.force_n_per_input"]),
    ('across = "free"', 'across = "free"\nstiffness_n_mm = -2', ["drive.stiffness_n_mm"]),
    ('name = "foot"\nbox_mm', 'name = "foot"\nbox', ["body foot.box"]),
    ("[[probe]]", "[[prob]]", ["did you mean probe?"]),
    ("plate_mm = 4.0", "plate = 4.0", ["did you mean plate_mm?"]),
    ("plate_mm = 4.0", "plate_mm = 0.0", ["plate_mm"]),
    ("poisson_ratio = 0.3", "poisson_ratio = 0.6", ["material.poisson_ratio"]),
    ("youngs_modulus_mpa = 1000.0", 'youngs_modulus_mpa = "soft"', ["material.youngs_modulus_mpa"]),
]


@pytest.mark.parametrize(("old", "new", "said"), [*(("", text, said) for text, *said in WRONG), *CHANGED])
def test_a_wrong_drawing_is_one_sentence_with_its_place(tmp_path: Path, old: str, new: str, said: list[str]) -> None:
    right = HALF + COPIED
    assert old in HEAD + right
    with pytest.raises(FingervisionError) as refused:
        drawing(tmp_path, (HEAD + right).replace(old, new, 1) if old else HEAD + right + new)
    assert all(part in str(refused.value) for part in said)
    assert "\n" not in str(refused.value)


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
