"""What every parametric model must be, whichever there are."""

import numpy as np
import pytest

from fingervision.domain.errors import UsageError
from fingervision.domain.gripper import Gripper
from fingervision.domain.model import Model
from fingervision.models.hinge_correction import HingeTheory
from fingervision.models.kinds import build_model, kinds
from fingervision.models.physics import LINEAR


@pytest.mark.parametrize("kind", kinds())
def test_contract_of_every_kind(gripper: Gripper, kind: str) -> None:
    model = build_model(kind, gripper, LINEAR, HingeTheory.CORRECTED)
    assert isinstance(model, Model)
    assert model.name == kind
    low, high = model.input_range_mm
    answer = model.respond(np.array([low, 0.0, 0.5 * high, high]))
    assert answer.gap_mm[1] == pytest.approx(model.rest_gap_mm)
    assert np.all(np.diff(answer.gap_mm) > 0.0)
    assert answer.left_mm == pytest.approx(-answer.right_mm)
    figures = model.figures()
    assert answer.gap_mm[3] - answer.gap_mm[1] == pytest.approx(figures.gap_per_input * high)
    assert answer.force_n == pytest.approx(figures.input_stiffness_n_mm * np.array([low, 0.0, 0.5 * high, high]))


def test_all_three_are_found() -> None:
    assert kinds() == ("finite_element", "lumped", "stiffness_matrix")


def test_an_unknown_kind_is_refused(gripper: Gripper) -> None:
    with pytest.raises(UsageError, match="must be one of finite_element, lumped, stiffness_matrix, but is comsol"):
        build_model("comsol", gripper, LINEAR, HingeTheory.BEAM)
