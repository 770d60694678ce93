"""Formulas of effects for a drawn gripper, compared with models of the changed gripper itself."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from fingervision.diagnosis.inference.measuring_chain import MeasuringChain, obeyed
from fingervision.domain.effect import History
from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Gripper
from fingervision.domain.response import Response
from fingervision.effects import catalogue
from fingervision.models.answer_figures import Physics
from fingervision.models.gripper_mechanism import redrawn
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.kinds import kinds
from fingervision.models.lumped import LumpedGripper
from fingervision.models.physical_gripper import PhysicalGripper
from fingervision.models.small_answer import ratio_curves, small_answer
from tests.benchmarks.own_physics import longer_lever

LAWS = {"lever_ratio_error", "large_deflection", "assembly_asymmetry", "finger_contact", "hinge_stiffness_error"}
INTERPOLATED_MM, INTERPOLATED = 5e-4, 1e-4
"""Tolerances for interpolation in the formulas: at most a tenth of an edge's noise, and the same relative to the
force."""
BENT_MM, BENT = 1e-3, 5e-4
"""Tolerances for the arc: its reach and height are fitted by least squares to equilibria, whose spline has eleven
nodes."""
RATIO_MM, RATIO = 1.5e-3, 1e-3
"""Formulas scale the response of the model by that of a bar model. Compared with a changed drawing whose finger is
meshed again, the error is within 2e-4 of the travel of 7 mm and 6e-4 of the force for changes of 0.1 mm."""
ROUNDING_MM = 1e-9
SPLINE = 1e-5
"""Splines of both ratios over the change are accurate to 1e-6; a spline of one ratio over the other is accurate to ten
times that value at its ends."""
INPUT = np.linspace(-0.6, 1.8, 97)


@pytest.fixture(scope="module")
def drawn(gripper: Gripper) -> PhysicalGripper:
    return PhysicalGripper(gripper, "lumped")


def history(model: PhysicalGripper, input_mm: np.ndarray = INPUT) -> History:
    gap = model.respond(input_mm).gap_mm
    return History(
        input_mm,
        None,
        (slice(0, input_mm.size),),
        4.0,
        float(np.ptp(gap)),
        closing_mm=4.0 - float(gap.min()),
        force=True,
    )


def obeying(
    model: PhysicalGripper, settings: Mapping[str, Mapping[str, float]], input_mm: np.ndarray = INPUT
) -> Response:
    return MeasuringChain(model, history(model, input_mm), {}).respond(settings)


def agree(a: Response, b: Response, within_mm: float, within: float) -> None:
    np.testing.assert_allclose(a.left_mm, b.left_mm, atol=within_mm)
    np.testing.assert_allclose(a.right_mm, b.right_mm, atol=within_mm)
    assert a.force_n is not None
    assert b.force_n is not None
    np.testing.assert_allclose(a.force_n, b.force_n, atol=within * float(np.abs(b.force_n).max()))


def test_every_kind_obeys_the_same_laws_and_all_are_effects_of_the_catalogue(
    drawn: PhysicalGripper, gripper: Gripper
) -> None:
    assert set(catalogue()) >= LAWS
    for kind in kinds():
        if kind != "finite_element":  # the equilibria take half a minute; they are tested with the model itself
            model = drawn if kind == "lumped" else PhysicalGripper(gripper, kind)
            closes = float(model.respond(np.array([model.input_range_mm[0]])).gap_mm[0]) <= 0.0
            assert set(model.laws) == (LAWS if closes else LAWS - {"finger_contact"})


@pytest.mark.parametrize("name", sorted(LAWS))
def test_zero_parameters_change_nothing(drawn: PhysicalGripper, name: str) -> None:
    searched = obeyed(catalogue()[name], drawn.laws[name]).search(history(drawn))
    assert not isinstance(searched, str)
    zero = {p.name: float(p.starting_values()[0]) if p.neutral is None else p.neutral for p in searched}
    if name == "large_deflection":
        zero = dict.fromkeys(zero, 0.0)
    if name == "finger_contact":
        zero["floor_mm"] = -1.0
    agree(obeying(drawn, {name: zero}), drawn.respond(INPUT), ROUNDING_MM, ROUNDING_MM)


@pytest.mark.parametrize("by", [-0.1, 0.1])
def test_a_longer_lever_is_its_ratio_in_gap_and_force(drawn: PhysicalGripper, gripper: Gripper, by: float) -> None:
    changed = LumpedGripper(longer_lever(gripper, by)).respond(INPUT)
    ratio = float((changed.gap_mm[-1] - 4.0) / (drawn.respond(INPUT).gap_mm[-1] - 4.0)) - 1.0
    agree(obeying(drawn, {"lever_ratio_error": {"ratio": ratio}}), changed, RATIO_MM, RATIO)


@pytest.mark.parametrize("right", [True, False])
def test_one_half_with_another_link_is_its_share(drawn: PhysicalGripper, gripper: Gripper, right: bool) -> None:
    bare, changed = drawn.respond(INPUT), LumpedGripper(longer_lever(gripper, 0.02)).respond(INPUT)
    assert bare.force_n is not None
    assert changed.force_n is not None
    halves = (changed, bare) if right else (bare, changed)
    unequal = Response(halves[1].left_mm, halves[0].right_mm, 0.5 * (bare.force_n + changed.force_n))
    share = float((unequal.right_mm[-1] - 2.0) / (unequal.gap_mm[-1] - 4.0)) - 0.5
    settings = {"assembly_asymmetry": {"share": share, "changed_half": 1.0 if right else -1.0}}
    agree(obeying(drawn, settings), unequal, INTERPOLATED_MM, INTERPOLATED)


def test_asymmetry_without_a_changed_half_leaves_the_gap(drawn: PhysicalGripper) -> None:
    seen = obeying(drawn, {"assembly_asymmetry": {"share": 0.01}})
    np.testing.assert_allclose(seen.gap_mm, drawn.respond(INPUT).gap_mm, atol=ROUNDING_MM)


def test_thinner_hinges_are_their_ratio_in_gap_and_force(drawn: PhysicalGripper, gripper: Gripper) -> None:
    thin = LumpedGripper(redrawn(gripper, "hinge.thickness_mm", -0.1)).respond(INPUT)
    bare = drawn.respond(INPUT)
    assert thin.force_n is not None
    assert bare.force_n is not None
    ratio = float(thin.force_n[-1] / bare.force_n[-1]) - 1.0
    assert ratio == pytest.approx(-0.22, abs=0.01)  # docs/explanation/mechanics.md: -22 % of the force
    settings = {"hinge_stiffness_error": {"ratio": ratio, "thickness_share": 1.0}}
    agree(obeying(drawn, settings), thin, RATIO_MM, RATIO)


def test_a_softer_material_leaves_the_gap(drawn: PhysicalGripper, gripper: Gripper) -> None:
    soft = LumpedGripper(redrawn(gripper, "material.youngs_modulus_mpa", -165.0)).respond(INPUT)
    settings = {"hinge_stiffness_error": {"ratio": -0.1, "thickness_share": 0.0}}
    agree(obeying(drawn, settings), soft, INTERPOLATED_MM, INTERPOLATED)


def test_contact_is_the_bodys_own_with_its_force(drawn: PhysicalGripper, gripper: Gripper) -> None:
    met = LumpedGripper(gripper, Physics(contact=True))
    touch_mm = met.first_touch_mm
    assert touch_mm is not None
    at = np.array([touch_mm - 0.02, touch_mm - 0.05, touch_mm])
    gap = met.respond(at).gap_mm
    slope = float(gap[0] - gap[1]) / (0.03 * drawn.answer.gap_per_input)
    contact = {"finger_contact": {"floor_mm": float(gap[2]), "remaining_slope": slope}}
    agree(obeying(drawn, contact), met.respond(INPUT), INTERPOLATED_MM, INTERPOLATED)


def test_large_rotation_is_the_bodys_own_with_its_force(drawn: PhysicalGripper, gripper: Gripper) -> None:
    bent = LumpedGripper(gripper, Physics(large_rotation=True)).respond(INPUT)
    # The circular arc nearest to the equilibria over the valid inputs of the drawn body.
    inputs = np.linspace(*LumpedGripper(gripper).input_range_mm, 201)
    straight_mm = LumpedGripper(gripper).respond(inputs).gap_mm - 4.0
    bent_mm = LumpedGripper(gripper, Physics(large_rotation=True)).respond(inputs).gap_mm - 4.0

    def off(arc: np.ndarray) -> np.ndarray:
        angle = straight_mm / arc[0]
        return arc[0] * np.sin(angle) + arc[1] * arc[0] * (1.0 - np.cos(angle)) - bent_mm

    reach_mm, cross = least_squares(off, [120.0, 0.1], x_scale=[100.0, 0.1]).x
    arc = {"reach_mm": float(reach_mm), "cross": float(cross)}
    agree(obeying(drawn, {"large_deflection": arc}), bent, BENT_MM, BENT)


def test_a_body_twice_as_large_bends_alike_at_twice_the_size(drawn: PhysicalGripper) -> None:
    far = np.linspace(0.0, 1.2, 25)
    small = obeying(drawn, {"large_deflection": {"reach_mm": 126.4, "cross": 0.1245}}, far)
    large = obeying(drawn, {"large_deflection": {"reach_mm": 252.8, "cross": 0.1245}}, 2.0 * far)
    np.testing.assert_allclose(large.gap_mm - 4.0, 2.0 * (small.gap_mm - 4.0), atol=ROUNDING_MM)
    assert large.force_n is not None
    assert small.force_n is not None
    np.testing.assert_allclose(large.force_n, 2.0 * small.force_n, atol=ROUNDING_MM)


@pytest.mark.parametrize("name", ["lever.l1_mm", "lever.l2_mm", "lever.l3_mm", "lever.l4_mm", "body.rest_gap_mm"])
def test_a_redrawn_gripper_still_meets_and_comes_back(gripper: Gripper, name: str) -> None:
    changed = redrawn(gripper, name, 0.25)
    lever = changed.lever
    assert np.subtract(lever.hinge1_mm, lever.hinge2_mm) == pytest.approx((lever.l2_mm, lever.l1_mm))
    assert np.subtract(lever.hinge2_mm, lever.drive_mm) == pytest.approx((lever.l4_mm, lever.l3_mm))
    assert changed.links.shuttle_from_mm == pytest.approx(lever.drive_mm)
    assert lever.drive_mm[0] == 0.0
    assert 2.0 * changed.tip_corner_mm[0] == pytest.approx(changed.body.rest_gap_mm)
    back = LumpedGripper(redrawn(changed, name, -0.25)).respond(INPUT)
    np.testing.assert_allclose(back.gap_mm, LumpedGripper(gripper).respond(INPUT).gap_mm, atol=ROUNDING_MM)


def test_refitted_numbers_answer_as_the_drawing_with_them(drawn: PhysicalGripper, gripper: Gripper) -> None:
    changes = {"hinge.thickness_mm": -0.05, "body.rest_gap_mm": 0.02}
    told = drawn.redrawn(changes).respond(INPUT)
    built = replace(redrawn(gripper, "hinge.thickness_mm", -0.05))
    changed = LumpedGripper(redrawn(built, "body.rest_gap_mm", 0.02)).respond(INPUT)
    agree(told, changed, RATIO_MM, RATIO)
    agree(drawn.drawn_anew(changes).respond(INPUT), changed, ROUNDING_MM, ROUNDING_MM)


def test_a_name_that_is_no_number_of_the_drawing_is_said(gripper: Gripper) -> None:
    with pytest.raises(DataError, match=r"its name in gripper\.toml, but is named hinge\.width_mm"):
        redrawn(gripper, "hinge.width_mm", 0.1)


def test_ratios_that_turn_back_are_no_law(gripper: Gripper) -> None:
    """A change of hinge 1's height increases the force for either sign, so that the force ratio does not determine the
    change.
    """
    theory = HingeTheory.CORRECTED
    assert ratio_curves(gripper, theory, lambda by: redrawn(gripper, "lever.l1_mm", by), -2.0, 2.0) is None
    assert ratio_curves(gripper, theory, lambda by: redrawn(gripper, "lever.l2_mm", by), 0.0, 0.0) is None


@pytest.mark.parametrize(("name", "low", "high"), [("hinge.thickness_mm", -0.7, 0.4), ("lever.l2_mm", -4.6, 8.9)])
def test_curves_are_as_fine_as_they_say(gripper: Gripper, name: str, low: float, high: float) -> None:
    theory = HingeTheory.CORRECTED
    curves = ratio_curves(gripper, theory, lambda by: redrawn(gripper, name, by), low, high)
    assert curves is not None
    bare = small_answer(gripper, theory)
    for share in (0.03, 0.31, 0.5, 0.77, 0.96):
        changed = small_answer(redrawn(gripper, name, low + share * (high - low)), theory)
        gap = changed.gap_per_input / bare.gap_per_input
        force = changed.force_per_input_n_mm / bare.force_per_input_n_mm
        if name == "lever.l2_mm":  # sign of the requested change
            assert curves.force_at_gap(gap) == pytest.approx(force, abs=SPLINE)
        else:
            assert curves.gap_at_force(force) == pytest.approx(gap, abs=SPLINE)
