"""Meshes of grippers, made from their outlines."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Gripper
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.reference_mesh import ElementSize, is_reference, mesh_outline
from fingervision.storage.gripper_toml import read_gripper

MICRO = Path(__file__).parents[2] / "fingervision" / "models" / "micro_gripper.toml"


def test_a_new_mesh_answers_as_the_packaged_one(gripper: Gripper, finite_element: FiniteElementGripper) -> None:
    mesh = mesh_outline(gripper, ElementSize(0.3, 2.5))
    new = FiniteElementGripper(gripper, mesh=mesh).respond(np.array([1.0]))
    old = finite_element.respond(np.array([1.0]))
    assert new.gap_mm == pytest.approx(old.gap_mm, rel=1e-4)
    assert new.force_n == pytest.approx(old.force_n, rel=1e-3)


def test_longer_lever_arm_opens_less(gripper: Gripper, finite_element: FiniteElementGripper) -> None:
    # Computed with another mesh: l2 + 0.1 mm lowers the slope from 7.7212 to 7.680 and the force from 2.004 to 1.985.
    lever = replace(gripper.lever, l2_mm=17.92, hinge1_mm=(35.6, 30.0))
    links = replace(gripper.links, pillar_and_root_mm=(31.1, 40.1, 0.0, 45.0))
    other = replace(gripper, lever=lever, links=links)
    assert not is_reference(other)
    opens = [
        float(np.ptp(each.respond(np.array([0.0, 1.0])).gap_mm))
        for each in (FiniteElementGripper(other), finite_element)
    ]
    assert opens[0] == pytest.approx(opens[1] - 0.041, abs=0.005)


@pytest.mark.slow
def test_micro_design_opens_in_the_samples_ratio(finite_element: FiniteElementGripper) -> None:
    micro = FiniteElementGripper(read_gripper(MICRO)).figures()
    assert micro.gap_per_input == pytest.approx(finite_element.figures().gap_per_input, rel=0.02)


def test_links_that_do_not_overlap_are_refused(gripper: Gripper) -> None:
    apart = replace(gripper.links, finger_mm=(60.0, 70.0, 50.0, 88.0))
    with pytest.raises(DataError, match="must be one body, but the links and notches leave 3 pieces"):
        mesh_outline(replace(gripper, links=apart), ElementSize(0.5, 4.0))
