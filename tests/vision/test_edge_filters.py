"""The table of linear filters against an ordinary least-squares fit, on edges integrated by another method."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import least_squares
from scipy.special import ndtr

from fingervision.vision.edge_filters import REACHES_PX, Lines, blurred_step, edge_filters, reach_for

# Quadrature and closed form agree to rounding.
QUADRATURE = 1e-9
# edge_filters states 1e-4 px for what the linear step leaves over; this is that, for unit contrast.
LINEAR_STEP_PX = 1e-4
# A central difference with steps of 1e-5 is good to this.
DIFFERENCE = 1e-8


@given(edge=st.floats(-3.0, 3.0), sigma=st.floats(0.2, 6.0))
def test_a_blurred_step_is_the_integral_of_the_error_function_over_each_pixel(edge: float, sigma: float) -> None:
    borders = np.arange(-4.5, 5.0) - edge
    step, _, _ = blurred_step(borders, np.array([sigma]))
    by_quadrature = [quad(lambda t: ndtr(t / sigma), a, b, epsabs=1e-12)[0] for a, b in pairwise(borders)]
    assert np.abs(step - by_quadrature).max() < QUADRATURE


@given(edge=st.floats(-3.0, 3.0), sigma=st.floats(0.2, 6.0))
def test_derivatives_of_a_blurred_step_are_those_of_central_differences(edge: float, sigma: float) -> None:
    h = 1e-5

    def step(e: float, s: float) -> np.ndarray:
        return blurred_step(np.arange(-6.5, 7.0) - e, np.array([s]))[0]

    _, by_position, by_sigma = blurred_step(np.arange(-6.5, 7.0) - edge, np.array([sigma]))
    assert np.abs(by_position - (step(edge + h, sigma) - step(edge - h, sigma)) / (2 * h)).max() < DIFFERENCE
    assert np.abs(by_sigma - (step(edge, sigma + h) - step(edge, sigma - h)) / (2 * h)).max() < DIFFERENCE


@pytest.mark.parametrize("reach", REACHES_PX)
def test_filters_answer_one_to_their_own_parameter_and_nothing_to_the_others_or_to_a_level(reach: int) -> None:
    filters = edge_filters(reach)
    row, column = len(filters.sigmas_px) // 2, 22
    borders = np.arange(-reach - 0.5, reach + 1.0) - filters.offsets_px[column]
    model = np.stack(blurred_step(borders, filters.sigmas_px[row : row + 1]))
    own = np.stack([filters.contrast[row, column], filters.shift[row, column], filters.blur[row, column]])
    assert np.abs(own @ model.T - np.eye(3)).max() < 1e-6
    assert np.abs(own.sum(axis=1)).max() < 1e-9


@given(seed=st.integers(0, 10**6), sigma=st.floats(0.4, 2.5), edge=st.floats(-1.5, 1.5))
def test_two_looks_at_the_table_find_the_least_squares_edge(seed: int, sigma: float, edge: float) -> None:
    reach, contrast, noise = reach_for(sigma), 140.0, 0.05
    filters = edge_filters(reach)
    sigma = float(filters.sigmas_px[np.abs(filters.sigmas_px - sigma).argmin()])
    pixels = np.arange(-reach - 0.5, reach + 1.0)

    def model(q: np.ndarray) -> np.ndarray:
        return q[0] + q[1] * blurred_step(pixels - q[2], np.array([q[3]]))[0]

    true = np.array([40.0, contrast, edge, sigma])
    levels = model(true) + noise * np.random.default_rng(seed).normal(size=len(pixels) - 1)
    exact = least_squares(lambda q: model(q) - levels, true, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    # One upright line; the table's sigma holds the optics alone, since the pixel is integrated over.
    line, position = Lines(np.zeros(1), np.ones(1), np.zeros(1, dtype=np.int64)), np.array([edge + 0.1])
    for _look in range(3):
        position = filters.look(levels[None], line, np.array([sigma]), position).position
    # The blur's own change is left out of the second look: its share of the shift is its square.
    assert position[0] == pytest.approx(exact.x[2], abs=LINEAR_STEP_PX + 0.03 * noise / contrast)


def test_the_gain_is_the_bound_that_unknown_levels_leave() -> None:
    """The formula of measuring.md, section 2, for one row and a window long enough for its linear approximation."""
    filters = edge_filters(28)
    row, column = np.abs(filters.sigmas_px - 1.2).argmin(), np.abs(filters.offsets_px).argmin()
    sigma_e = np.hypot(filters.sigmas_px[row], np.sqrt(1 / 12))
    closed = 1.0 / (2.0 * np.sqrt(np.pi) * sigma_e) - 1.0 / 57
    # The closed form itself agrees with the numeric Fisher matrix to 0.3 % of the standard deviation.
    assert filters.shift_gain[row, column] ** 2 == pytest.approx(closed, rel=0.01)
