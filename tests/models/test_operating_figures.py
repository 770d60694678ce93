"""Grip, leverage, weight, temperature and endurance, against closed formulas and independent code."""

from dataclasses import replace
from math import inf, log

import numpy as np
import pytest
from scipy.optimize import minimize

from fingervision.domain.gripper import Gripper, SNLine
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.grip import Part, first_grip_mm, gripped, mechanical_advantage
from fingervision.models.gripper_figures import endurance, operating_figures
from fingervision.models.lumped import LumpedGripper

ONE_PERCENT = 0.01


@pytest.mark.parametrize("stiffness", [inf, 50.0, 1.0])
def test_grip_is_the_least_energy(lumped: LumpedGripper, stiffness: float) -> None:
    """Compared with scipy's SLSQP on the energy of finger and part; the face's points are outside the squeezed part."""
    driven, width, input_mm = lumped.elastic.driven, 3.0, -0.3
    state = gripped(lumped, input_mm, Part(width, stiffness))
    gap, face, _ = driven.gaps[0](np.zeros(driven.unknowns))
    # The model's forces are those of both halves.
    compliance = 2.0 * face @ driven.under_load(face.toarray().T)
    K = np.linalg.inv(0.5 * (compliance + compliance.T))
    free = gap + input_mm * face @ driven.unit_displacement
    soft = min(stiffness, 1e4)

    def energy(x: np.ndarray) -> float:
        moved, squeezed = x[:-1], x[-1]
        return float(0.5 * moved @ K @ moved + 0.5 * (2.0 * soft) * squeezed**2)

    outside = {"type": "ineq", "fun": lambda x: free + x[:-1] - 0.5 * width + x[-1]}
    best = minimize(energy, np.array([0.2] * free.size + [0.0]), constraints=[outside], options={"ftol": 1e-14})
    grip = 2.0 * soft * best.x[-1]
    assert state.grip_n == pytest.approx(grip, rel=ONE_PERCENT)
    assert first_grip_mm(lumped, Part(width)) == pytest.approx(0.25 * lumped.first_touch_mm, rel=1e-9)
    assert gripped(lumped, 0.0, Part(width)).grip_n == 0.0


@pytest.mark.parametrize("cross_bar_mm", [8.0, 5.0])
def test_grip_is_that_of_finite_elements(gripper: Gripper, cross_bar_mm: float) -> None:
    drawn = replace(gripper, links=replace(gripper.links, cross_bar_width_mm=cross_bar_mm))
    part = Part(2.0, 50.0)
    grips = []
    for model in (LumpedGripper(drawn), FiniteElementGripper(drawn)):
        touch = first_grip_mm(model, part) or 0.0
        grips.append(gripped(model, touch - 0.2, part).grip_n)
    assert grips[0] == pytest.approx(grips[1], rel=0.005)


def test_mechanical_advantage_is_reciprocal(lumped: LumpedGripper) -> None:
    """By Betti's theorem, a force on the tips with the drive held acts on the drive by the ratio of gap to input.

    The ratio of grip to force is therefore (a / c) / (k + 2 a^2 / c), with the tip's motion a per input, its compliance
    c with the drive held, and the stiffness k.
    """
    driven = lumped.elastic.driven
    gap, face, _ = driven.gaps[0](np.zeros(driven.unknowns))
    place = int(np.argmin(gap - 0.5 * lumped.face_per_input))
    a = lumped.face_per_input[place]
    row = face.toarray()[place]
    c = 2.0 * row @ driven.under_load(row)
    k = lumped.force_per_input_n_mm
    assert mechanical_advantage(lumped) == pytest.approx((a / c) / (k + 2.0 * a**2 / c), rel=1e-6)


def test_tip_moves_and_turns_as_a_lever(lumped: LumpedGripper) -> None:
    """Rigid links rotate by 1 / l2 per input about hinge 1: the motion of the tip along the finger is its distance from
    hinge 1 across the finger times this angle.
    """
    own, lever = operating_figures(lumped), lumped.gripper.lever
    turn = 1.0 / lever.l2_mm
    assert np.radians(own.tip_turn_deg_per_mm) == pytest.approx(turn, rel=0.03)
    assert own.tip_along_per_input == pytest.approx(turn * (lever.hinge1_mm[0] - 2.0), rel=0.03)


def test_weight_is_that_of_the_density_and_kinds_agree(
    gripper: Gripper, lumped: LumpedGripper, finite_element: FiniteElementGripper
) -> None:
    heavy = replace(gripper, material=replace(gripper.material, density_kg_m3=2 * 930.0))
    once, twice, solid = (operating_figures(model) for model in (lumped, LumpedGripper(heavy), finite_element))
    assert twice.gap_by_weight_mm == pytest.approx(2.0 * once.gap_by_weight_mm, rel=1e-9)
    assert once.gap_by_weight_mm == pytest.approx(solid.gap_by_weight_mm, rel=0.01)
    assert once.midline_by_weight_mm == pytest.approx(solid.midline_by_weight_mm, rel=0.01)
    # By Rayleigh's quotient, a single swaying mode dominates, so that the shift is about g / w^2.
    (first,) = lumped.swaying_modes_hz()
    assert once.midline_by_weight_mm == pytest.approx(9806.65 / (2 * np.pi * first) ** 2, rel=0.6)


def test_thermal_growth_by_a_second_way(gripper: Gripper, finite_element: FiniteElementGripper) -> None:
    """Clamp and drive face stay in place: the body first expands freely; then clamp and drive face are moved back."""
    warm = replace(gripper, material=replace(gripper.material, thermal_expansion_per_k=1e-4))
    own = operating_figures(FiniteElementGripper(warm))
    # Expansion about the middle of the clamp moves the drive face by 2.57 mm, and both pillars by 35.5 mm, times the
    # strain. Moving them back changes the gap by the slope along the drive, and directly across the pillars.
    slope = 7.7196
    expected = 1e-4 * (4.0 - 2.57 * slope)
    pillars_mm = 1e-4 * 2.0 * 35.5
    assert own.gap_per_kelvin_mm is not None
    assert abs(own.gap_per_kelvin_mm - expected) < pillars_mm
    assert operating_figures(finite_element).gap_per_kelvin_mm is None


@pytest.mark.parametrize("low", [-20.0, -5.0, 0.0])
def test_endurance_on_the_line(gripper: Gripper, low: float) -> None:
    """Basquin's line through two points, with Soderberg's correction for the mean stress, computed by hand."""
    material = replace(gripper.material, sn_line=SNLine((1e3, 1e6), (40.0, 10.0)))
    found = endurance(material, low, 25.0)
    amplitude, mean = (25.0 - low) / 2, (25.0 + low) / 2
    same = amplitude / (1 - mean / 48.0)
    slope = log(1e6 / 1e3) / log(10.0 / 40.0)
    assert found is not None
    assert found.cycles == pytest.approx(1e3 * (same / 40.0) ** slope)


def test_endurance_beyond_the_line_is_a_limit(gripper: Gripper) -> None:
    material = replace(gripper.material, sn_line=SNLine((1e3, 1e6), (40.0, 10.0), 0.0))
    # The points of the line for pulsating stress give the stated numbers of cycles.
    end = endurance(material, 0.0, 20.0)
    assert end is not None
    assert end.cycles == pytest.approx(1e6)
    little, much = endurance(material, 0.0, 5.0), endurance(material, -47.0, 47.0)
    assert little is not None
    assert much is not None
    assert (little.cycles, little.at_least) == (None, 1e6)
    assert "more than 1e+06 cycles" in little.words
    # Pulsating stress up to 80 MPa exceeds the yield stress, so that no amplitude lies before the start of this line.
    assert much.cycles is not None
    assert endurance(gripper.material, 0.0, 5.0) is None
