"""Points that a fit rejects as dust: if they are too many for dust, the uncertainty of the edge increases."""

import numpy as np
import pytest

from fingervision.vision.finger_end import FingerEnd
from fingervision.vision.outline_points import OutlinePoints
from fingervision.vision.profile_lines import INNER_SIDE
from fingervision.vision.residuals import set_aside_variance

U_POINT, OFF_PX = 0.05, 1.5


@pytest.mark.parametrize(
    ("above", "below", "is_unsure"), [(0, 0, False), (1, 1, False), (2, 0, False), (3, 0, True), (2, 2, True)]
)
def test_most_points_or_half_on_both_sides_may_be_the_edge(above: int, below: int, is_unsure: bool) -> None:
    """Four points above and four below the measuring height; some of them deviate by 1.5 px, as at a chamfer."""
    y = np.array([6.5, 7.5, 8.5, 9.5, 10.5, 11.5, 12.5, 13.5])
    robust = np.ones(y.size)
    robust[:above] = robust[y.size - below :] = 0.0
    x = np.where(robust > 0.0, 0.0, OFF_PX)
    points = OutlinePoints(x, y, np.full(y.size, U_POINT), np.full(y.size, INNER_SIDE), np.ones(y.size))
    end = FingerEnd(np.zeros(8), np.eye(8), np.zeros(2), 1.0, x / U_POINT, robust)
    stated = 2.0 / 3.0 * OFF_PX**2 if is_unsure else 0.0
    assert set_aside_variance(points, end, 0.0, 10.0) == pytest.approx(stated)
