"""Lumped mechanisms of any topology: against finite elements of the same drawing, the published stiffness matrix, and
invariances.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fingervision.domain.errors import ModelError
from fingervision.domain.gripper import Gripper
from fingervision.models.answer_figures import Physics
from fingervision.models.corotational_frame import CorotationalBody, turned_axes
from fingervision.models.finite_element import FiniteElementGripper, MechanismPlate
from fingervision.models.gripper_mechanism import half_mechanism, redrawn, whole_mechanism
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.lumped import MechanismFrame
from fingervision.models.rigid_bodies import RigidBodies
from fingervision.storage.mechanism_toml import read_drawing
from tests.benchmarks.models_sway_table import stiffnesses

SLOPE = 5e-4
"""Tolerance of the slope for condensed bodies: a tenth of the tolerance for the lumped model of bars."""
FORCE = 0.01
SAME_DRAWING = 2e-4
"""Difference of two meshes of one outline: the packaged mesh and the mesh of the mechanism."""


def test_the_template_has_the_gripper_s_figures(gripper: Gripper, finite_element: FiniteElementGripper) -> None:
    unit = MechanismPlate(half_mechanism(gripper)).state(1.0)
    assert 2.0 * unit.probes_mm["right tip"][0] == pytest.approx(finite_element.gap_per_input, rel=SAME_DRAWING)
    assert unit.force_n == pytest.approx(finite_element.force_per_input_n_mm, rel=SAME_DRAWING)


@pytest.mark.slow
@pytest.mark.parametrize(("thickness", "radius", "plate"), [(1.0, 4.0, 3.0), (2.0, 5.0, 20.0), (0.2, 8.0, 1.0)])
def test_lumped_half_beside_finite_elements(gripper: Gripper, thickness: float, radius: float, plate: float) -> None:
    drawn = replace(
        gripper,
        hinge=replace(gripper.hinge, thickness_mm=thickness, radius_mm=radius),
        body=replace(gripper.body, plate_mm=plate),
    )
    frame, solid = MechanismFrame(half_mechanism(drawn)), FiniteElementGripper(drawn)
    unit = frame.state(1.0)
    assert 2.0 * unit.probes_mm["right tip"][0] == pytest.approx(solid.gap_per_input, rel=SLOPE)
    assert unit.force_n == pytest.approx(solid.force_per_input_n_mm, rel=FORCE)
    assert unit.stress_mpa == pytest.approx(solid.peak_stress().mpa_per_mm, rel=FORCE)
    for held in (False, True):
        ours = frame.modes_hz(drive_held=held, count=2)
        assert ours == pytest.approx(solid.modes_hz(drive_held=held, count=2), rel=FORCE)


@pytest.mark.slow
def test_contact_and_large_rotation(gripper: Gripper) -> None:
    """At 1.5 mm beyond first touch, in the deformed shape, both kinds of mechanism agree with the gripper's finite
    elements.
    """
    ours = FiniteElementGripper(gripper, Physics(large_rotation=True, contact=True)).loaded([-2.0])[0]
    half = half_mechanism(gripper)
    for kind, stress in ((MechanismPlate, FORCE), (MechanismFrame, 0.1)):
        state = kind(half).state(-2.0, large_rotation=True, contact=True)
        assert state.force_n == pytest.approx(ours.force_n, rel=FORCE)
        assert state.contact_n["tip"] == pytest.approx(ours.grip_n, rel=FORCE)
        assert state.stress_mpa == pytest.approx(ours.stress_mpa, rel=stress)


@pytest.mark.slow
def test_an_asymmetric_gripper_mirrors_with_its_drawing(gripper: Gripper) -> None:
    other = redrawn(gripper, "lever.l2_mm", 0.5)
    one, two = (MechanismFrame(whole_mechanism(a, b, "g")).state(1.0) for a, b in ((gripper, other), (other, gripper)))
    assert one.probes_mm["left tip"][0] == pytest.approx(-two.probes_mm["right tip"][0], rel=1e-4)
    assert one.probes_mm["right tip"][1] == pytest.approx(two.probes_mm["left tip"][1], rel=1e-4)
    assert one.force_n == pytest.approx(two.force_n, rel=1e-4)
    assert one.probes_mm["right tip"][0] < 0.98 * -one.probes_mm["left tip"][0]


def test_rigid_bodies_are_the_paper_s_matrix(gripper: Gripper) -> None:
    alone = replace(half_mechanism(gripper), mirrored=False, probes={"tip": gripper.measuring_point_mm}, pairs={})
    unit = RigidBodies(alone, theory=HingeTheory.BEAM).state(1.0)
    assert 2.0 * unit.force_n == pytest.approx(2.27, abs=0.005)
    assert 2.0 * unit.probes_mm["tip"][0] == pytest.approx(7.792, abs=0.001)


def test_bodies_without_flexures_are_refused(gripper: Gripper) -> None:
    alone = replace(half_mechanism(gripper), flexures=())
    for kind in (RigidBodies, MechanismFrame):
        with pytest.raises(ModelError, match="must have flexures"):
            kind(alone)


def test_both_halves_of_rigid_bodies_which_form_a_loop_are_twice_one_half(gripper: Gripper) -> None:
    whole, half = (RigidBodies(m) for m in (whole_mechanism(gripper, gripper, "both"), half_mechanism(gripper)))
    assert whole.stiffness_n_mm == pytest.approx(half.stiffness_n_mm, rel=1e-9)
    assert whole.state(1.0).pairs_mm["gap"] == pytest.approx(half.state(1.0).pairs_mm["gap"], rel=1e-9)
    assert whole.state(1.0).stress_mpa == pytest.approx(half.state(1.0).stress_mpa, rel=1e-9)


def stiff_triangle() -> CorotationalBody:
    """Three coordinate frames, coupled by a random positive definite stiffness."""
    random = np.random.default_rng(4)
    places = np.array([[0.0, 0.0], [3.0, 1.0], [-1.0, 4.0]])
    motions = np.zeros((9, 3))
    for i, (x, y) in enumerate(places):
        motions[3 * i : 3 * i + 3] = [[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]]
    free = np.eye(9) - motions @ np.linalg.pinv(motions)
    root = random.standard_normal((9, 9)) @ free
    return CorotationalBody(places, root.T @ root)


def test_a_rigid_turn_costs_a_body_nothing() -> None:
    body = stiff_triangle()
    for angle in (0.3, 2.0):
        moved = (body.places_mm @ turned_axes(angle).T + [5.0, -2.0]) - body.places_mm
        motion = np.column_stack([moved, np.full(3, angle)]).ravel()
        _, force = body.forces_n(motion)
        assert force == pytest.approx(np.zeros(9), abs=1e-12 * np.abs(body.stiffness_n_mm).max())


def test_the_tangent_is_the_slope_of_the_forces() -> None:
    body = stiff_triangle()
    at = np.random.default_rng(5).standard_normal(9)
    tangent, _ = body.forces_n(at)
    step = 1e-6
    by_hand = np.array([(body.forces_n(at + step * e)[1] - body.forces_n(at - step * e)[1]) / (2 * step)
                        for e in np.eye(9)]).T  # fmt: skip
    assert tangent == pytest.approx(by_hand, rel=1e-6, abs=1e-6)


@pytest.mark.slow
def test_stress_at_fillets_is_that_of_finite_elements() -> None:
    # Neither radius is a node of the table; the mesh is within 0.1 % of a mesh three times as fine.
    drawing = read_drawing(Path(__file__).parents[1] / "benchmarks" / "mechanisms" / "filleted_lever.toml")
    mechanism = drawing.mechanism()
    for radii in ((1.5, 1.0), (0.2, 0.3)):
        flexures = tuple(replace(f, fillet_mm=r) for f, r in zip(mechanism.flexures, radii, strict=True))
        drawn = replace(mechanism, flexures=flexures)
        ours, elements = (kind(drawn).state(1.0).stress_mpa for kind in (MechanismFrame, MechanismPlate))
        assert ours == pytest.approx(elements, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("thickness", "poisson", "depth"), [(0.35, 0.45, 10.0), (1.8, 0.2, 10.0), (6.5, 0.3, 10.0), (1.0, 0.3, 5.0)]
)
def test_a_notch_between_guided_blocks_is_as_stiff_as_elements(thickness: float, poisson: float, depth: float) -> None:
    """Between nodes of the table, for another material and an elliptic cut, errors are 1 % across and 3 % along."""
    for direction, within in (((0, 1), 0.01), ((1, 0), 0.03)):
        plate, frame = stiffnesses(thickness, direction, poisson=poisson, depth_mm=depth)
        assert frame == pytest.approx(plate, rel=within)
