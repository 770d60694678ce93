"""Thin necks: the lumped notch against closed formulas and quadrature that share no code with it."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Gripper, Material
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.gripper_mechanism import redrawn
from fingervision.models.hinge_correction import HingeTheory, Notch, beam_compliance, planes_ratio
from fingervision.models.lumped import LumpedGripper
from fingervision.models.skeleton import skeleton_of
from fingervision.models.width_effect import force_uncertainty, held_moduli
from tests.benchmarks.hinge_solid import solid_compliance
from tests.models import hinge_closed_forms as closed

PA2200 = Material("PA2200", 1650.0, 0.34, 930.0, 48.0)
ROUNDING = 1e-10
COARSE = 0.005  # of the brick elements: two elements across the neck are too stiff by as much


def series(notch: Notch, segments: int) -> float:
    """Rotation per moment of segments in series: equal to that of the whole notch if each segment is correct."""
    parts = [beam_compliance(notch, PA2200, span)[2, 2] for span in pairwise(notch.stations_mm(segments).tolist())]
    return float(np.sum(parts))


@pytest.mark.parametrize("ratio", [0.0025, 0.01, 0.0125, 0.02, 0.05, 0.25, 1.0])
@pytest.mark.parametrize("segments", [2, 10])
def test_segments_sum_to_the_closed_form_however_thin_the_neck(ratio: float, segments: int) -> None:
    notch = closed.circular_notch(4.0, 4.0 * ratio, 3.0)
    assert series(notch, segments) == pytest.approx(closed.wu_zhou_bending(notch, PA2200), rel=ROUNDING)
    assert series(notch, segments) == pytest.approx(closed.paros_weisbord_bending(notch, PA2200), rel=ROUNDING)


def test_the_frame_of_a_notch_carries_those_segments(gripper: Gripper) -> None:
    thin = replace(gripper, hinge=replace(gripper.hinge, thickness_mm=0.05))
    parts = [m.compliance[2, 2] for m in skeleton_of(thin, HingeTheory.BEAM).members if m.name == "hinge 1"]
    notch = closed.circular_notch(4.0, 0.05, 3.0)
    assert sum(parts) == pytest.approx(closed.wu_zhou_bending(notch, PA2200), rel=ROUNDING)


def test_a_notch_that_leaves_its_web_early_is_only_as_long_as_the_web_has_it() -> None:
    """R = 5 in a web of 2 mm: h(x) reaches the faces at x = 2.14 mm; the integral by an independent quadrature."""
    notch = Notch(0.4, 5.0, 5.0, 3.0, web_mm=2.0)
    reach = np.sqrt(5.0**2 - (5.0 - 0.8) ** 2)
    assert notch.reach_mm == pytest.approx(reach)
    assert notch.height_mm(np.array([reach]))[0] == pytest.approx(2.0)
    integral, _ = quad(lambda x: 12.0 / (0.4 + 10.0 - 2.0 * np.sqrt(25.0 - x * x)) ** 3, -reach, reach, epsabs=1e-12)
    assert series(notch, 6) == pytest.approx(integral / (1650.0 * 3.0), rel=1e-9)


def test_a_whole_gripper_with_thin_necks_is_as_soft_as_finite_elements(gripper: Gripper) -> None:
    # For R = 4 and t = 0.05, ten equal segments with their mean heights are 100 % too stiff.
    thin = replace(gripper, hinge=replace(gripper.hinge, thickness_mm=0.05))
    lumped, plane = LumpedGripper(thin), FiniteElementGripper(thin)
    assert lumped.force_per_input_n_mm == pytest.approx(plane.force_per_input_n_mm, rel=0.002)
    assert lumped.peak_stress().mpa_per_mm == pytest.approx(plane.peak_stress().mpa_per_mm, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize(("nu", "width"), [(0.2, 5.5), (0.42, 5.5), (0.34, 18.0)])
def test_the_width_effect_between_the_tables_nodes_and_for_other_materials(nu: float, width: float) -> None:
    """Brick elements at a width and Poisson's ratio that are in no table: bending is within the stated uncertainty."""
    material = replace(PA2200, poisson_ratio=nu)
    notch = closed.circular_notch(1.0, 0.16, 0.16 * width)
    bricks = solid_compliance(notch, material, along=24, across=2, through=4)
    corrected = planes_ratio(notch, material)[2] * beam_compliance(notch, material)[2, 2]
    assert corrected == pytest.approx(bricks[5, 5], rel=COARSE + force_uncertainty(material))


def test_between_plane_stress_and_plane_strain() -> None:
    for share, modulus, ratio in ((0.0, 1650.0, 0.34), (1.0, 1650.0 / (1 - 0.34**2), 0.34 / (1 - 0.34))):
        E, nu = held_moduli(PA2200, np.array(share))
        assert float(E) == pytest.approx(modulus)
        assert float(nu) == pytest.approx(ratio)
        # The shear modulus does not depend on the restraint across the plate.
        assert float(E / (1.0 + nu)) == pytest.approx(1650.0 / 1.34)


def test_a_notch_thicker_than_its_web_is_refused() -> None:
    with pytest.raises(DataError, match="must be below the height of its bar, 2 mm, but is 3 mm"):
        Notch(3.0, 4.0, 4.0, 3.0, web_mm=2.0)


def test_a_neck_that_another_cut_makes_thinner_is_refused(gripper: Gripper) -> None:
    """Cuts of nearly 8 mm meet between the hinges: the largest stress is 40 % above that of the neck as drawn."""
    hinge = replace(gripper.hinge, thickness_mm=0.667, radius_mm=7.95)
    overlapping = redrawn(redrawn(replace(gripper, hinge=hinge), "lever.l2_mm", -0.74), "lever.l3_mm", 1.13)
    with pytest.raises(DataError, match=r"hinge 2 must be thinnest at its centre, but .* thinner 0\.\d+ mm"):
        LumpedGripper(overlapping)
