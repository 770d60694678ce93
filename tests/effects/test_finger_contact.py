"""Fingers can touch only if the gap at rest is above zero."""

import numpy as np
import pytest

from fingervision.domain.effect import History
from fingervision.effects.finger_contact import EFFECT


@pytest.mark.parametrize("rest_gap_mm", [0.0, -3.0])
def test_a_table_of_positions_through_zero_has_no_fingers_that_meet(rest_gap_mm: float) -> None:
    # The gap is the position of a stage: the bounds of the parameter floor_mm would have zero width.
    inputs = np.linspace(-3.0, 3.0, 7)
    history = History(inputs, None, (slice(0, 7),), rest_gap_mm=rest_gap_mm, opening_mm=3.0, closing_mm=3.0)
    searched = EFFECT.search(history)
    assert isinstance(searched, str)
    assert "not above zero" in searched
