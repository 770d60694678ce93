"""Which finger of a picture is the model's left one, for drawings that are not symmetric."""

import numpy as np
import pytest

from fingervision.diagnosis.input.exchanged_sides import facing
from fingervision.domain.measured_table import MeasuredTable
from fingervision.domain.response import Response


@pytest.mark.parametrize(
    ("drawn", "fault", "turns"),
    [
        (0.005, 0.0, True),  # a drawing of two slightly unlike fingers
        (0.5, 0.0, True),  # a lever and a jaw that does not move
        (-0.5, 0.02, True),  # the same with a fault
        (0.0, 0.0, False),  # a symmetric drawing
        (0.0, 0.02, False),
        (1e-4, -0.01, False),  # nearly symmetric: either way needs a fault
        (0.005, -0.02, False),
        (0.05, 1.0, False),  # a midline that moves by far more than any model says, either way
    ],
)
@pytest.mark.parametrize("is_turned", [True, False])
def test_sides_are_exchanged_if_only_then_the_model_holds(
    drawn: float, fault: float, turns: bool, is_turned: bool
) -> None:
    rng = np.random.default_rng(6)
    inputs = 0.5 * (1.0 - np.cos(np.linspace(0.0, 9.0, 120)))
    gap = 3.0 + 2.0 * inputs
    model = Response(drawn * gap - 0.5 * gap, drawn * gap + 0.5 * gap, None)
    midline = (drawn + fault) * gap + rng.normal(0.0, 5e-4, gap.size)
    midline = -midline if is_turned else midline
    table = MeasuredTable(inputs, gap, midline, None, (slice(0, gap.size),), ("",))
    found = facing(table, model)
    assert found.midline_mm is not None
    assert np.array_equal(found.midline_mm, -midline if turns and is_turned else midline)
    assert bool(found.notes) == (turns and is_turned)
