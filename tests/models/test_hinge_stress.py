"""Nominal stress in the hinges: against the stress of a bar, finite elements, and scaling laws of elasticity."""

from dataclasses import replace

import numpy as np
import pytest

from fingervision.domain.gripper import Gripper
from fingervision.models.bars import peak_hinge_stress
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.gripper_mechanism import redrawn
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.lumped import LumpedGripper
from fingervision.models.skeleton import skeleton_of

NOTCH = 0.02
"""Tolerance of Neuber's factor for a deep notch at t / R = 0.25, and of the frame's force, against finite elements."""
SEGMENTS = 1e-3
"""Tolerance of the frame with ten segments against the frame with forty."""


def test_the_thinnest_section_carries_what_finite_elements_find(
    lumped: LumpedGripper, finite_element: FiniteElementGripper
) -> None:
    peak, refined = lumped.peak_stress(), finite_element.peak_stress()
    assert peak.mpa_per_mm == pytest.approx(refined.mpa_per_mm, rel=NOTCH)
    middles = [np.array(lumped.gripper.lever.hinge1_mm), np.array(lumped.gripper.lever.hinge2_mm)]
    off = min(float(np.hypot(*(np.array(peak.place_mm) - middle))) for middle in middles)
    # The largest stress is beside the neck, because the moment grows along the hinge while the section hardly grows.
    assert off == pytest.approx(0.5 * lumped.gripper.hinge.thickness_mm, rel=0.03)


def test_segments_converge(gripper: Gripper) -> None:
    coarse, fine = (LumpedGripper(gripper, bars_alone=True, segments=count).peak_stress() for count in (10, 40))
    assert coarse.mpa_per_mm == pytest.approx(fine.mpa_per_mm, rel=SEGMENTS)


def test_stress_goes_with_the_modulus_and_not_with_the_plate_of_a_beam(gripper: Gripper) -> None:
    bare = LumpedGripper(gripper, theory=HingeTheory.BEAM).peak_stress().mpa_per_mm
    stiff = LumpedGripper(redrawn(gripper, "material.youngs_modulus_mpa", 1650.0), theory=HingeTheory.BEAM)
    assert stiff.peak_stress().mpa_per_mm == pytest.approx(2.0 * bare)
    thick = LumpedGripper(redrawn(gripper, "body.plate_mm", 3.0), theory=HingeTheory.BEAM)
    assert thick.peak_stress().mpa_per_mm == pytest.approx(bare)


def test_a_rotation_of_one_hinge_is_its_bending_moment(gripper: Gripper) -> None:
    """If everything beyond hinge 1 rotates by a small angle, the moment is angle / C along the whole hinge."""
    skeleton = skeleton_of(gripper, HingeTheory.BEAM, 40)
    angle = 1e-3
    members = [place for place, member in enumerate(skeleton.members) if member.name == "hinge 1"]
    yielding = np.array([skeleton.members[place].compliance[5, 5] for place in members])
    displacement = np.zeros((members[-1] + 2, 3))
    moment = angle / yielding.sum()
    for place in members:
        member = skeleton.members[place]
        length = np.hypot(*np.subtract(member.end_mm, member.start_mm))
        before = displacement[member.parent + 1]
        # Under a pure moment M, every segment rotates by C M, and its end moves sideways by the coupling term.
        aside, turn = member.compliance[[1, 5], 5] * moment
        displacement[place + 1] = before + np.array([-before[2] * length - aside, 0.0, turn])
    still = replace(skeleton, members=skeleton.members[: members[-1] + 1])
    peak = peak_hinge_stress(gripper, still, displacement.ravel())
    thickness, plate = gripper.hinge.thickness_mm, gripper.body.plate_mm
    assert peak.mpa == pytest.approx(6.0 * moment / (plate * thickness**2), rel=1e-6)
