"""Nominal stress in the hinges: against the stress of a bar, finite elements, and scaling laws of elasticity."""

import numpy as np
import pytest

from fingervision.domain.gripper import Gripper
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.flexure_span import FlexureSpan
from fingervision.models.flexure_stress import nominal_stress
from fingervision.models.gripper_mechanism import half_mechanism, redrawn
from fingervision.models.hinge_correction import HingeTheory, notches_of
from fingervision.models.lumped import LumpedGripper
from fingervision.models.stiffness_matrix import StiffnessMatrixGripper

NOTCH = 0.02
"""Tolerance of Neuber's factor for a deep notch at t / R = 0.25, and of the frame's force, against finite elements."""


def test_the_thinnest_section_carries_what_finite_elements_find(
    lumped: LumpedGripper, finite_element: FiniteElementGripper
) -> None:
    peak, refined = lumped.peak_stress(), finite_element.peak_stress()
    assert peak.mpa_per_mm == pytest.approx(refined.mpa_per_mm, rel=NOTCH)
    middles = [np.array(lumped.gripper.lever.hinge1_mm), np.array(lumped.gripper.lever.hinge2_mm)]
    off = min(float(np.hypot(*(np.array(peak.place_mm) - middle))) for middle in middles)
    # The largest stress is beside the neck, because the moment grows along the hinge while the section hardly grows.
    assert off == pytest.approx(0.5 * lumped.gripper.hinge.thickness_mm, rel=0.03)


def test_bars_load_their_hinges_as_elastic_bodies_do(gripper: Gripper, lumped: LumpedGripper) -> None:
    assert StiffnessMatrixGripper(gripper).peak_stress().mpa_per_mm == pytest.approx(
        lumped.peak_stress().mpa_per_mm, rel=NOTCH
    )


def test_stress_goes_with_the_modulus_and_not_with_the_plate_of_a_beam(gripper: Gripper) -> None:
    bare = LumpedGripper(gripper, theory=HingeTheory.BEAM).peak_stress().mpa_per_mm
    stiff = LumpedGripper(redrawn(gripper, "material.youngs_modulus_mpa", 1650.0), theory=HingeTheory.BEAM)
    assert stiff.peak_stress().mpa_per_mm == pytest.approx(2.0 * bare)
    thick = LumpedGripper(redrawn(gripper, "body.plate_mm", 3.0), theory=HingeTheory.BEAM)
    assert thick.peak_stress().mpa_per_mm == pytest.approx(bare)


def test_a_pure_moment_is_carried_by_the_neck(gripper: Gripper) -> None:
    half, notch, moment = half_mechanism(gripper), notches_of(gripper)[0], 20.0
    span = FlexureSpan(half.flexures[0], (-notch.reach_mm, notch.reach_mm), (-4.0, 4.0), (9.0, 9.0))
    rows = np.tile([0.0, -moment, moment], (40, 1))
    peak = nominal_stress(span, rows, half, HingeTheory.BEAM, stations_mm=notch.stations_mm(40))
    assert peak.mpa == pytest.approx(6.0 * moment / (notch.plate_mm * notch.thickness_mm**2), rel=1e-6)
