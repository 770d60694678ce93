import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.domain.gripper import Gripper
from fingervision.models.grip import Part
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.notch import beam_compliance, notches_of
from fingervision.models.skeleton import skeleton_of
from fingervision.models.stiffness_matrix import ComplianceChain, StiffnessMatrixGripper, carried, turned

arms = st.tuples(*[st.floats(-50.0, 50.0)] * 3).map(np.array)
ROUNDING = 1e-9


@given(arm=arms, angle=st.floats(-4.0, 4.0), seed=st.integers(0, 50))
def test_transforms_keep_reciprocity_and_work(gripper: Gripper, arm: np.ndarray, angle: float, seed: int) -> None:
    compliance = beam_compliance(notches_of(gripper)[0], gripper.material)
    transform = carried(arm) @ turned(angle)
    moved = transform @ compliance @ transform.T
    assert moved == pytest.approx(moved.T, rel=ROUNDING, abs=ROUNDING * np.abs(moved).max())
    load = np.random.default_rng(seed).standard_normal(6)
    # The same load, transferred back to the hinge, does the same work there.
    at_hinge = transform.T @ load
    assert load @ moved @ load == pytest.approx(at_hinge @ compliance @ at_hinge, rel=1e-7)


@given(first=arms, second=arms)
def test_carrying_twice_is_carrying_the_sum(first: np.ndarray, second: np.ndarray) -> None:
    assert carried(first) @ carried(second) == pytest.approx(carried(first + second), abs=1e-9)


def test_maxwell_and_betti(gripper: Gripper) -> None:
    skeleton = skeleton_of(gripper, HingeTheory.CORRECTED, 8)
    chain = ComplianceChain(skeleton)
    there, back = (
        chain.flexibility(*ends) for ends in ((skeleton.drive, skeleton.corner), (skeleton.corner, skeleton.drive))
    )
    assert there == pytest.approx(back.T, rel=1e-12, abs=1e-15)


def test_guided_shuttle_is_much_stiffer_than_a_free_one(gripper: Gripper) -> None:
    # Equation (15) holds with sideways motion and rotation held; for a free shuttle, 2 / C_yy would be a different
    # number.
    model = StiffnessMatrixGripper(gripper)
    free = 2.0 / model.drive_compliance[1, 1]
    assert model.input_stiffness_n_mm > 1.5 * free


def test_the_plane_and_the_space_do_not_mix(gripper: Gripper) -> None:
    compliance = StiffnessMatrixGripper(gripper).drive_compliance
    assert np.abs(compliance[np.ix_([0, 1, 5], [2, 3, 4])]).max() < 1e-15


def test_grip_force_starts_at_the_object(gripper: Gripper) -> None:
    model = StiffnessMatrixGripper(gripper)
    # The corner, 0.3 mm above the measuring point, moves a little more than the measuring point.
    touching = 0.25 * (model.first_touch_mm or 0.0)
    assert model.grip_force_n(touching, Part(3.0)) == pytest.approx(0.0, abs=1e-12)
    assert model.grip_force_n(touching + 0.1, Part(3.0)) == 0.0
    expected = 0.1 * -2.0 / (model.first_touch_mm or 0.0) * model.finger_stiffness_n_mm
    assert model.grip_force_n(touching - 0.1, Part(3.0)) == pytest.approx(expected)
    # A part as stiff as both fingers in series halves the grip.
    soft = Part(3.0, 0.5 * model.finger_stiffness_n_mm)
    assert model.grip_force_n(touching - 0.1, soft) == pytest.approx(0.5 * expected)


def test_gravity_sag_scales_with_density_and_plate(gripper: Gripper) -> None:
    sag, _ = StiffnessMatrixGripper(gripper).gravity_sag_mm()
    loose, _ = StiffnessMatrixGripper(gripper).gravity_sag_mm(drive_held=False)
    assert 0.0 < sag < loose
    # Brick elements give 0.156 mm with the drive free out of the plane; bars joined at points agree within a tenth.
    assert loose == pytest.approx(0.156, rel=0.1)
