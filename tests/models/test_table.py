"""A simulation table between and beyond its rows."""

import numpy as np
import pytest

from fingervision.models.table import TableModel


def test_beyond_an_end_it_follows_the_line_through_the_last_quarter() -> None:
    at = np.linspace(0.0, 1.0, 9)
    table = TableModel("bent", at, -(at**2), at**3, 3.0 * at)
    seen = table.respond(np.array([-0.5, 0.2, 1.5]))
    # A quarter of nine rows is rounded up to three; the least-squares slope over three equidistant rows is that from
    # the first to the last.
    low, high = (0.25**2 / 0.25, 0.25**3 / 0.25), ((1.0 - 0.75**2) / 0.25, (1.0 - 0.75**3) / 0.25)
    assert seen.left_mm[[0, 2]] == pytest.approx([0.5 * low[0], -1.0 - 0.5 * high[0]])
    assert seen.right_mm[[0, 2]] == pytest.approx([-0.5 * low[1], 1.0 + 0.5 * high[1]])
    # Interpolation between rows is linear: 0.2 lies three fifths of the distance from 0.125 to 0.25.
    assert seen.left_mm[1] == pytest.approx(-(0.4 * 0.125**2 + 0.6 * 0.25**2))
    assert seen.force_n == pytest.approx([-1.5, 0.6, 4.5])
