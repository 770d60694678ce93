"""Straight lines with certified results, and properties of a line with errors in both variables."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from calib.errors import CalibrationError
from calib.straight_line import line_through_origin, line_with_errors

# The certified values carry 15 digits; the bar is 10.
TEN_DIGITS = 1e-10
# Monte Carlo over 2000 lines knows a standard deviation to 1.6 %.
MONTE_CARLO = 0.08

# National Institute of Standards and Technology, Statistical Reference Datasets, linear regression, Norris:
# https://www.itl.nist.gov/div898/strd/lls/data/Norris.shtml (calibration of ozone monitors); y, x.
NORRIS = """
0.1 0.2     338.8 337.4 118.1 118.2 888.0 884.6 9.2 10.1    228.1 226.5 668.5 666.3 998.5 996.3 449.1 448.6
778.9 777.0 559.2 558.2 0.3 0.4     0.1 0.6     778.1 775.5 668.8 666.9 339.3 338.0 448.9 447.5 10.8 11.6
557.7 556.0 228.3 228.1 998.0 995.8 888.8 887.6 119.6 120.2 0.3 0.3     0.6 0.3     557.6 556.8 339.3 339.1
888.0 887.2 998.5 999.0 778.9 779.0 10.2 11.1   117.6 118.3 228.9 229.2 668.4 669.1 449.2 448.9 0.2 0.5
"""


def test_norris() -> None:
    y, x = np.array(NORRIS.split(), dtype=float).reshape(-1, 2).T
    line = line_with_errors(x, y, np.zeros_like(x), np.ones_like(x))
    sd = line.residual_sd * np.sqrt(np.diag(line.covariance))
    assert line.slope == pytest.approx(1.00211681802045, rel=TEN_DIGITS)
    assert line.intercept == pytest.approx(-0.262323073774029, rel=TEN_DIGITS)
    assert sd[0] == pytest.approx(0.429796848199937e-03, rel=TEN_DIGITS)
    assert sd[1] == pytest.approx(0.232818234301152, rel=TEN_DIGITS)
    assert line.residual_sd == pytest.approx(0.884796396144373, rel=TEN_DIGITS)


@pytest.mark.parametrize(
    ("x", "y", "slope", "sd", "residual_sd"),
    [
        # https://www.itl.nist.gov/div898/strd/lls/data/NoInt1.shtml
        (np.arange(60.0, 71.0), np.arange(130.0, 141.0), 2.07438016528926, 0.165289256198347e-01, 3.56753034006338),
        # https://www.itl.nist.gov/div898/strd/lls/data/NoInt2.shtml
        (
            np.array([4.0, 5.0, 6.0]),
            np.array([3.0, 4.0, 4.0]),
            0.727272727272727,
            0.420827318078432e-01,
            0.369274472937998,
        ),
    ],
    ids=["NoInt1", "NoInt2"],
)
def test_lines_through_the_origin(x: np.ndarray, y: np.ndarray, slope: float, sd: float, residual_sd: float) -> None:
    line = line_through_origin(x, y, np.zeros_like(x), np.ones_like(x))
    assert line.slope == pytest.approx(slope, rel=TEN_DIGITS)
    assert line.residual_sd * np.sqrt(line.covariance[0, 0]) == pytest.approx(sd, rel=TEN_DIGITS)
    assert line.residual_sd == pytest.approx(residual_sd, rel=TEN_DIGITS)


def test_pearsons_data_with_yorks_weights() -> None:
    """The classic test of errors in both variables: York, Canadian Journal of Physics 44 (1966), 1079-1086."""
    x = np.array([0.0, 0.9, 1.8, 2.6, 3.3, 4.4, 5.2, 6.1, 6.5, 7.4])
    y = np.array([5.9, 5.4, 4.4, 4.6, 3.5, 3.7, 2.8, 2.8, 2.4, 1.5])
    weight_x = np.array([1000, 1000, 500, 800, 200, 80, 60, 20, 1.8, 1.0])
    weight_y = np.array([1, 1.8, 4, 8, 20, 20, 70, 70, 100, 500])
    line = line_with_errors(x, y, weight_x**-0.5, weight_y**-0.5)
    # The published solution has these digits.
    assert line.slope == pytest.approx(-0.480533407, abs=1e-8)
    assert line.intercept == pytest.approx(5.47991022, abs=1e-7)
    assert line.chi_square == pytest.approx(11.866353, abs=1e-5)


def test_the_covariance_is_what_repeated_lines_scatter_by() -> None:
    rng = np.random.default_rng(7)
    true_x = np.array([2.0, 5.0, 8.0, -3.0])
    u_x, u_y = np.array([0.01, 0.02, 0.01, 0.03]), np.array([0.2, 0.4, 0.2, 0.1])
    lines = [
        line_with_errors(true_x + u_x * rng.normal(size=4), 34 * true_x - 0.6 + u_y * rng.normal(size=4), u_x, u_y)
        for _ in range(2000)
    ]
    seen = np.cov([[line.slope, line.intercept] for line in lines], rowvar=False)
    stated = np.mean([line.covariance for line in lines], axis=0)
    unit = np.sqrt(np.outer(np.diag(stated), np.diag(stated)))
    assert np.abs((seen - stated) / unit).max() < MONTE_CARLO
    chi_square = np.mean([line.chi_square for line in lines])
    assert chi_square == pytest.approx(2.0, rel=MONTE_CARLO)


@settings(max_examples=50, deadline=None)
@given(
    slope=st.floats(0.1, 100.0),
    intercept=st.floats(-10.0, 10.0),
    sizes=st.lists(st.floats(-20.0, 20.0), min_size=3, max_size=8, unique_by=lambda size: round(size, 1)),
    seed=st.integers(0, 100),
)
def test_an_exact_line_is_found_and_swaps_with_its_inverse(
    slope: float, intercept: float, sizes: list[float], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    x = np.array(sizes)
    y = intercept + slope * x
    u_x, u_y = rng.uniform(0.01, 0.1, size=(2, len(x)))
    line, inverse = line_with_errors(x, y, u_x, u_y), line_with_errors(y, x, u_y, u_x)
    # Rounding of x alone is 1e-16 of 20 mm.
    assert line.slope == pytest.approx(slope, rel=1e-9)
    assert inverse.slope == pytest.approx(1.0 / slope, rel=1e-9)


def test_a_single_size_is_no_line() -> None:
    same = np.array([5.0, 5.0])
    with pytest.raises(CalibrationError, match="needs at least two different sizes"):
        line_with_errors(same, 34 * same, same, same)
