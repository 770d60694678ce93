"""Difference of the motions of edges and area of a body that bends, against finite elements of the whole mechanism."""

import numpy as np
import pytest

from fingervision.models.finite_element import MechanismPlate
from fingervision.models.place_answers import PlaceAnswers
from tests.benchmarks.which_hinge import drawn


@pytest.mark.slow
def test_edges_of_a_bending_body_move_as_finite_elements_say() -> None:
    answers = PlaceAnswers(drawn())
    told = dict(zip(answers.channels, answers.by_edges, strict=True))
    model = MechanismPlate(drawn())
    plate, state = model.plate, model.state(1.0)
    a, b, middle = plate.outline_edges
    way = plate.nodes_mm[:, b] - plate.nodes_mm[:, a]
    length = np.hypot(*way)
    normal = np.stack([-way[1], way[0]]) / length
    moved = state.displacement_mm
    along = normal[0] * moved[plate.x_dofs[middle]] + normal[1] * moved[plate.y_dofs[middle]]
    for body in model.bodies:
        if body.is_fixed:
            continue
        own = body.holds(plate.nodes_mm[:, middle] - 1e-3 * normal)
        arm = plate.nodes_mm[:, middle[own]] - body.centroid_mm[:, None]
        columns = np.stack([*normal[:, own], arm[0] * normal[1, own] - arm[1] * normal[0, own]], axis=1)
        root = np.sqrt(length[own])
        x, y, turn = np.linalg.lstsq(columns * root[:, None], along[own] * root, rcond=None)[0]
        pose = state.bodies[body.name]
        assert x - pose.x_mm == pytest.approx(told[f"{body.name}.x_mm"], abs=1e-4)
        # The lumped model cuts the flexures' own flanks off its bodies.
        assert y - pose.y_mm == pytest.approx(told[f"{body.name}.y_mm"], rel=0.4, abs=1e-4)
        assert 1e3 * turn - pose.angle_mrad == pytest.approx(told[f"{body.name}.angle_mrad"], abs=5e-3)
    # The driven bar of the sample bends by some micrometres per 1 mm of input; its fingers hardly bend.
    assert -4e-3 < told["drive.y_mm"] < -1e-3
    assert abs(told["left_finger.y_mm"]) < 2e-4
