"""What a driven face may do, against structured quadrilaterals of second order that share nothing with the models."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import skfem
from scipy.sparse.linalg import spsolve
from skfem.helpers import ddot, eye, sym_grad, trace

from fingervision.domain.errors import DataError, ModelError
from fingervision.models.elastic_mechanism import ElasticMechanism
from fingervision.models.lumped import MechanismFrame
from fingervision.models.mechanism import Face, Mechanism
from fingervision.models.rigid_bodies import RigidBodies
from tests.drawings import drawing
from tests.models.coarse import coarse_elements

Kind = Callable[..., ElasticMechanism]
E, NU, PLATE_MM = 1000.0, 0.3, 2.0
ROD = 'across = "free"'
FORCE = 0.007
"""Of plane stress at a leaf's sharp roots, where the quadrilaterals are 0.25 mm large."""
LEVER = """
plate_mm = 2.0
material = {{ name = "m", youngs_modulus_mpa = 1000.0, poisson_ratio = 0.3, density_kg_m3 = 1000.0, yield_mpa = 40.0 }}
[[body]]
name = "foot"
box_mm = [0, 10, 0, 10]
[[body]]
name = "lever"
box_mm = [20, 60, 0, 10]
[[flexure]]
name = "leaf"
kind = "leaf"
at_mm = [15, 5]
axis_deg = 0
thickness_mm = 1.0
half_length_mm = 6.0
[[fixed]]
box_mm = [0, 0, 0, 10]
[drive]
box_mm = [{box}]
direction = [0, 1]
{how}
"""


def lever(folder: Path, box: str, how: str) -> Mechanism:
    return drawing(folder, LEVER.format(box=box, how=how))


def quadrilaterals_n_mm(x0: float, x1: float, *, held: bool) -> float:
    """Force per mm at the lever's top face from x0 to x1: under an even load, or with every node moved alike."""
    x = np.unique(np.concatenate([np.arange(0.0, 61.0), np.arange(9.0, 21.1, 0.25), [x0, x1]]))
    y = np.unique(np.concatenate([np.arange(0.0, 11.0), np.arange(4.0, 6.1, 0.25)]))
    mesh = skfem.MeshQuad.init_tensor(x, y)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    mesh = mesh.restrict(np.flatnonzero((middle[0] < 10) | (middle[0] > 20) | (np.abs(middle[1] - 5) < 0.5)))
    element = skfem.ElementVector(skfem.ElementQuad2())
    basis = skfem.Basis(mesh, element, intorder=4)

    @skfem.BilinearForm
    def stiffness(u, v, _):  # type: ignore[no-untyped-def]
        strain = sym_grad(u)
        stress = E / (1 + NU) * strain + E * NU / (1 - NU**2) * eye(trace(strain), 2)
        return PLATE_MM * ddot(stress, sym_grad(v))

    K = stiffness.assemble(basis)
    upward = np.zeros(basis.N, dtype=bool)
    for dofs in (basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs):
        upward[dofs[1]] = True
    at_x, at_y = basis.doflocs
    face = (np.abs(at_y - 10.0) < 1e-9) & (at_x > x0 - 1e-9) & (at_x < x1 + 1e-9) & upward
    free = np.flatnonzero(at_x > 1e-9)
    moved = np.zeros(basis.N)
    if held:
        moved[face] = 1.0
        inner = np.setdiff1d(free, np.flatnonzero(face))
        moved[inner] = spsolve(K[inner][:, inner].tocsc(), -(K @ moved)[inner])
        return float(moved @ (K @ moved))
    on = mesh.facets_satisfying(lambda p: (np.abs(p[1] - 10.0) < 1e-9) & (p[0] > x0) & (p[0] < x1))
    load = skfem.LinearForm(lambda v, _: v[1]).assemble(skfem.FacetBasis(mesh, element, facets=on, intorder=4))
    load /= load.sum()
    moved[free] = spsolve(K[free][:, free].tocsc(), load[free])
    return 1.0 / float(load @ moved)


@pytest.mark.parametrize("turns", ["free", "held"])
@pytest.mark.parametrize(("box", "x0"), [("40, 50, 9, 11", 40.0), ("41.3, 50, 10, 10", 41.3)])
def test_a_face_across_its_drive(tmp_path: Path, turns: str, box: str, x0: float) -> None:
    drawn = lever(tmp_path, box, f'across = "free"\nturns = "{turns}"')
    expected = quadrilaterals_n_mm(x0, 50.0, held=turns == "held")
    for kind in (coarse_elements, MechanismFrame):
        assert kind(drawn, width_effect=False).stiffness_n_mm == pytest.approx(expected, rel=FORCE)


def test_a_rod_that_pushes_does_not_clamp_whichever_way_the_face_lies(tmp_path: Path) -> None:
    """By statics: a leaf under a force at the end of a rigid lever."""
    stiffer = []
    for box in ("40, 50, 10, 10", "60, 60, 0, 10"):
        free = lever(tmp_path, box, 'across = "free"')
        plate, chain = coarse_elements(free, width_effect=False), RigidBodies(free)
        arms = {"40, 50, 10, 10": 45.0, "60, 60, 0, 10": 60.0}[box]
        inertia = PLATE_MM / 12.0
        # Deflection at the arm by the moment P (arm - x) along the leaf from 10 to 20 mm.
        compliance = ((arms - 10.0) ** 3 - (arms - 20.0) ** 3) / (3.0 * E * inertia)
        # The leaf is twice as wide as thick: stiffer than a beam, and less so than a plate, 1 / (1 - nu^2).
        stiffer.append(chain.stiffness_n_mm * compliance)
        assert 1.0 < stiffer[-1] < 1.0 / (1.0 - NU**2)
        # The leaf's roots and the lever yield too.
        assert 0.9 / compliance < plate.stiffness_n_mm < 1.0 / compliance
        assert 'turns = "free"' in free.drives[0].words
    assert stiffer[0] == pytest.approx(stiffer[1], rel=1e-3)


def test_the_ends_of_a_face_do_not_make_the_frame_jump(tmp_path: Path) -> None:
    forces = [
        MechanismFrame(lever(tmp_path, f"{x0}, 50, 9, 11", 'across = "free"\nturns = "held"')).stiffness_n_mm
        for x0 in (40.0, 40.7, 41.4)
    ]
    assert forces[0] > forces[1] > forces[2] > 0.96 * forces[0]


def test_what_a_drive_cannot_do_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"turns in .* but is 'often'"):
        lever(tmp_path, "40, 50, 10, 10", 'turns = "often"')


@pytest.mark.parametrize("kind", [coarse_elements, MechanismFrame, RigidBodies])
@pytest.mark.parametrize(("box", "more"), [
    ("5, 10, 10, 10", ""),  # the foot, which is clamped
    ("40, 50, 10, 10", "[[slide]]\nname = 'rail'\nbox_mm = [59, 60, 0, 0]\nholds = 'y'\n"
                       "[[slide]]\nbox_mm = [20, 21, 10, 10]\nholds = 'y'"),
])  # fmt: skip
def test_a_drive_whose_body_is_held_is_refused_with_its_place(tmp_path: Path, kind: Kind, box: str, more: str) -> None:
    stuck = lever(tmp_path, box, f"{ROD}\n{more}")
    with pytest.raises((DataError, ModelError), match=r"drive of .* must be able to move its body") as refused:
        kind(stuck).state(1.0)
    if kind is not RigidBodies:
        assert ("(7.5, 10) mm" if not more else "(45, 10) mm") in str(refused.value)
        assert ("rail" if more else "fixed 1") in str(refused.value)


@pytest.mark.parametrize("kind", [coarse_elements, MechanismFrame, RigidBodies])
def test_a_drive_that_moves_everything_is_refused(tmp_path: Path, kind: Kind) -> None:
    """A rail in place of the clamp: the drive pushes the whole mechanism along it."""
    free = lever(tmp_path, "60, 60, 0, 10", 'across = "held"').drives[0]
    drawn = lever(tmp_path, "60, 60, 0, 10", 'across = "held"')
    railed = replace(drawn, fixed=(), slides=((drawn.fixed[0], "x"),), drives=(free,))
    with pytest.raises(ModelError, match="without bending anything"):
        _ = kind(railed).stiffness_n_mm


@pytest.mark.parametrize("kind", [coarse_elements, MechanismFrame])
def test_a_clamp_on_a_flexure_is_refused_with_its_place(tmp_path: Path, kind: Kind) -> None:
    drawn = lever(tmp_path, "60, 60, 0, 10", ROD)
    held = replace(drawn, fixed=(Face("jaws", (0.0, 13.0, 0.0, 10.0)),))
    with pytest.raises(DataError, match=r"fixed face jaws of .* holds flexure leaf at \(1[12]\.?\d*, [45]\.5\) mm"):
        kind(held)
    kind(replace(drawn, fixed=(Face("jaws", (0.0, 10.0, 0.0, 10.0)),)))


def test_drives_and_rails_that_agree_with_a_rigid_motion_are_computed(tmp_path: Path) -> None:
    """A rail across the drive, and a second drive that moves the body the same way, hold nothing."""
    beside = "[[slide]]\nbox_mm = [60, 60, 5, 5.5]\nholds = 'x'"
    assert coarse_elements(lever(tmp_path, "40, 50, 10, 10", f"{ROD}\n{beside}")).stiffness_n_mm > 0.0
    both = f"{ROD}\nname = 'left'\n[[drive]]\nname = 'right'\nbox_mm = [52, 58, 10, 10]\ndirection = [0, 1]\n{ROD}"
    together = drawing(tmp_path, LEVER.replace("[drive]", "[[drive]]").format(box="40, 50, 10, 10", how=both))
    assert coarse_elements(together).stiffness_n_mm > 0.0


def test_a_body_that_bends_at_a_part_without_a_name_is_not_held(tmp_path: Path) -> None:
    """A curved spring is no strip, but as thin as the leaf beside it."""
    ring = "[[body]]\nname='ring'\ndisc_mm=[35,-19,{r}]\ncut={cut}\n"
    bodies = "[[body]]\nname='foot'\nbox_mm=[0,10,-30,10]\n" + ring.format(r=20.5, cut="false")
    bodies += ring.format(r=19.5, cut="true") + "[[body]]\nname='stem'\nbox_mm=[5,16,-22,-16]\n"
    text = LEVER.replace('[[body]]\nname = "foot"\nbox_mm = [0, 10, 0, 10]\n', bodies)
    curved = coarse_elements(drawing(tmp_path, text.format(box="35.5, 40, -40, -39", how=ROD)))
    assert 0.0 < curved.stiffness_n_mm < 10.0


@pytest.mark.parametrize(("plate_mm", "wedges_n_mm", "narrower"), [(5.0, 0.0198431, 0.02), (20.0, 0.0834405, 0.07)])
def test_the_stated_error_holds_wedges_of_a_wide_plate(
    tmp_path: Path, plate_mm: float, wedges_n_mm: float, narrower: float
) -> None:
    """Force of CalculiX's quadratic wedges, three layers through half the plate; plane stress alone is too soft."""
    drawn = replace(lever(tmp_path, "59, 60, 10, 10", ROD), plate_mm=plate_mm)
    for kind in (coarse_elements, MechanismFrame):
        model = kind(drawn)
        assert model.stiffness_n_mm == pytest.approx(wedges_n_mm, rel=model.force_error)
        assert model.in_plane_stress.stiffness_n_mm < (1.0 - narrower) * wedges_n_mm


SOFT_N_MM = 0.5
KINDS = (coarse_elements, MechanismFrame, RigidBodies)


@pytest.mark.parametrize("kind", KINDS)
def test_an_actuator_with_a_stiffness_is_a_spring_in_series(tmp_path: Path, kind: Kind) -> None:
    stage = kind(lever(tmp_path, "40, 50, 10, 10", ROD))
    soft = kind(lever(tmp_path, "40, 50, 10, 10", f"{ROD}\nstiffness_n_mm = {SOFT_N_MM}")).state(2.0)
    own = stage.stiffness_n_mm
    moved = 2.0 * SOFT_N_MM / (SOFT_N_MM + own)
    assert soft.force_n == pytest.approx(own * moved, rel=1e-6)
    assert soft.faces_mm["drive"] == pytest.approx(moved, rel=1e-6)
    pushed = kind(lever(tmp_path, "40, 50, 10, 10", f"{ROD}\nforce_n_per_input = 0.3")).state(2.0)
    assert pushed.force_n == pytest.approx(0.6)
    assert pushed.faces_mm["drive"] == pytest.approx(0.6 / own, rel=1e-6)
    assert pushed.stress_mpa == pytest.approx(stage.state(0.6 / own).stress_mpa, rel=1e-6)


def test_a_force_and_a_motion_give_the_same_deformed_shape(tmp_path: Path) -> None:
    """The equilibrium with the force of a stage at 4 mm has its face at 4 mm, by both kinds in large rotation."""
    for kind in (coarse_elements, MechanismFrame):
        stage = kind(lever(tmp_path, "40, 50, 10, 10", ROD)).state(4.0, large_rotation=True)
        force = kind(lever(tmp_path, "40, 50, 10, 10", f"{ROD}\nforce_n_per_input = 1.0"))
        pushed = force.state(stage.force_n, large_rotation=True)
        assert pushed.faces_mm["drive"] == pytest.approx(4.0, rel=1e-6)
        assert pushed.drives_n["drive"] == pytest.approx(stage.force_n)


def test_modes_with_an_actuator_lie_between_a_free_and_a_held_drive(tmp_path: Path) -> None:
    """For a stiffness that is soft beside the body's own modes, the square of the first frequency rises by k."""
    box = "40, 50, 10, 10"
    free = MechanismFrame(lever(tmp_path, box, f"{ROD}\nforce_n_per_input = 1.0"))
    by_rod, own = free.modes_hz(drive_held=True, count=1)[0], 1.0 / free.state(1.0).faces_mm["drive"]
    weak = 0.02 * own
    spring = MechanismFrame(lever(tmp_path, box, f"{ROD}\nstiffness_n_mm = {weak}")).modes_hz(drive_held=True, count=1)
    assert by_rod == pytest.approx(free.modes_hz(drive_held=False, count=1)[0])
    assert (spring[0] / by_rod) ** 2 - 1.0 == pytest.approx(weak / own, rel=0.05)
    stiff = MechanismFrame(lever(tmp_path, box, f"{ROD}\nstiffness_n_mm = 1e5")).modes_hz(drive_held=True, count=1)[0]
    held = MechanismFrame(lever(tmp_path, box, ROD)).modes_hz(drive_held=True, count=1)[0]
    assert stiff == pytest.approx(held, rel=0.02)


def test_inputs_that_differ_in_their_last_digits_do_not_spoil_the_next_one(tmp_path: Path) -> None:
    """Equilibria are extrapolated from the last ones; two at the same input would multiply their rounding errors."""
    fresh = MechanismFrame(lever(tmp_path, "40, 50, 10, 10", ROD))
    spoilt = MechanismFrame(lever(tmp_path, "40, 50, 10, 10", ROD))
    for value in (2.0, 4.0, np.nextafter(4.0, 5.0)):
        spoilt.state(float(value), large_rotation=True)
    expected = fresh.state(4.1, large_rotation=True)
    assert spoilt.state(4.1, large_rotation=True).force_n == pytest.approx(expected.force_n, rel=1e-7)


def pinned(folder: Path, how: str) -> Mechanism:
    return drawing(folder, LEVER.replace("box_mm = [{box}]\n", "").format(how=how))


@pytest.mark.parametrize("kind", KINDS)
def test_a_pin_turns_the_lever_as_a_rod_at_its_arm_does(tmp_path: Path, kind: Kind) -> None:
    """On the leaf's axis, a pin that cannot slide does not hold the lever either."""
    rod = kind(lever(tmp_path, "40, 50, 10, 10", ROD)).stiffness_n_mm
    for across in ("free", "held"):
        drawn = pinned(tmp_path, f'pin_mm = [45, 5, 2]\nacross = "{across}"')
        assert kind(drawn).stiffness_n_mm == pytest.approx(rod, rel=0.003)
        assert "1 mm radius" in drawn.drives[0].words


def test_a_pin_must_lie_on_a_body(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"pin drive .* must lie on the body, but \(45, 30\)"):
        pinned(tmp_path, "pin_mm = [45, 30, 2]")
    with pytest.raises(DataError, match="must have either box_mm"):
        lever(tmp_path, "40, 50, 10, 10", "pin_mm = [45, 5, 2]")
    with pytest.raises(ModelError, match="lies on flexure leaf"):
        MechanismFrame(pinned(tmp_path, 'pin_mm = [15, 5, 0.4]\nacross = "free"'))


def test_a_body_that_bends_may_be_driven_beside_its_clamp(tmp_path: Path) -> None:
    """A beam of 19.5 by 1 mm, clamped at one end and pushed at the other, is a cantilever with 3 E I / L^3."""
    text = """
plate_mm = 5.0
material = { name = "m", youngs_modulus_mpa = 70000, poisson_ratio = 0.33, density_kg_m3 = 2700, yield_mpa = 300 }
fixed = [{ box_mm = [0, 0, -1, 1] }]
body = [{ box_mm = [0, 20.2, -0.5, 0.5] }, { box_mm = [21.8, 30, -3, 3] }]
drive = { box_mm = [19, 20, 0.5, 0.5], direction = [0, 1], across = "free" }
flexure = [{ name = "h", kind = "leaf", at_mm = [21, 0], axis_deg = 0, thickness_mm = 0.3, half_length_mm = 1 }]
"""
    mechanism = drawing(tmp_path, text, "beam")
    for kind in (MechanismFrame, coarse_elements):
        plane = kind(mechanism, width_effect=False)
        assert plane.stiffness_n_mm == pytest.approx(3.0 * 70000.0 * 5.0 / 12.0 / 19.5**3, rel=0.02)


HELD = """
plate_mm = 5.0
material = {{ name = "m", youngs_modulus_mpa = 70000, poisson_ratio = 0.33, density_kg_m3 = 2700, yield_mpa = 300 }}
fixed = [{{ box_mm = {foot} }}]
body = [{bodies}, {{ box_mm = ["{x} + 1.6", "{x} + 10", "{y} - 3", "{y} + 3"] }}]
drive = {{ box_mm = {face}, direction = [0, 1], across = "free" }}
[[flexure]]
name = "h"
kind = "leaf"
at_mm = ["{x} + 0.8", "{y}"]
axis_deg = 0
thickness_mm = 0.3
half_length_mm = 1
"""


def held_body(folder: Path, arm_mm: float, across_mm: float) -> Mechanism:
    """An upright strip of 2 mm, clamped at its foot, with a cross arm that is driven at its end; or the arm alone."""
    y = arm_mm - 1.0
    bodies = f"{{ box_mm = [0, {across_mm}, {arm_mm - 2.0}, {arm_mm}] }}"
    foot = [0.0, 0.0, arm_mm - 2.0, arm_mm]
    if arm_mm > 2.0:
        bodies, foot = f"{{ box_mm = [0, 2, 0, {arm_mm}] }}, {bodies}", [0.0, 2.0, 0.0, 0.0]
    face = [across_mm - 1.0, across_mm, arm_mm, arm_mm]
    return drawing(folder, HELD.format(foot=foot, bodies=bodies, x=f"{across_mm}", y=f"{y}", face=face), "held")


@pytest.mark.parametrize("kind", [coarse_elements, MechanismFrame])
def test_a_bent_strip_is_as_slender_as_a_straight_one(tmp_path: Path, kind: Kind) -> None:
    """An L of 8 by 8 mm is a beam of 14 by 2 mm: of both arms' bending, 3 E I / (b^3 + 3 a b^2)."""
    a, b = 7.0, 6.5
    beam_n_mm = 3.0 * 70000.0 * 5.0 * 2.0**3 / 12.0 / (b**3 + 3.0 * a * b**2)
    plane = kind(held_body(tmp_path, 8.0, 8.0), width_effect=False)
    assert plane.stiffness_n_mm == pytest.approx(beam_n_mm, rel=0.08)
    assert kind(held_body(tmp_path, 2.0, 14.0)).stiffness_n_mm > 0.0
    for stubby in ((2.0, 6.0), (4.0, 4.0)):
        with pytest.raises(DataError, match="must be able to move its body"):
            kind(held_body(tmp_path, *stubby))
