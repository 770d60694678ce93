"""A stripe of background that is narrower than its blur, rendered exactly."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.vision.edge_filters import blurred_step
from fingervision.vision.stripes import StripeEdges, fit_stripes

# Grey levels are rounded to 1/257 of a level of 8 bits; the position follows within this.
ROUNDED_PX = 2e-3


def _stripe(left: float, width: float, blur: float, contrast: float, rows: int) -> np.ndarray:
    borders = np.arange(-0.5, 80.0)
    rise = blurred_step(borders - left, np.array([blur]))[0]
    fall = blurred_step(borders - left - width, np.array([blur]))[0]
    return np.tile(40.0 + contrast * (rise - fall), (rows, 1))


def _fit(picture: np.ndarray, left: float, right: float, blur: float, contrast: float, noise: float) -> StripeEdges:
    rows = len(picture)
    return fit_stripes(
        np.rint(picture * 257).astype(np.uint16), np.arange(rows), np.full(rows, left), np.full(rows, right),
        np.full(rows, blur), contrast * 257, noise * 257, 9,
    )  # fmt: skip


@given(left=st.floats(30.0, 31.0), width=st.floats(2.0, 8.0), blur=st.floats(0.6, 1.6))
def test_both_edges_of_an_exact_stripe_are_found(left: float, width: float, blur: float) -> None:
    found = _fit(_stripe(left, width, blur, 160.0, 1), left - 0.5, left + width + 0.5, blur, 160.0, 1.0)
    assert found.left[0] == pytest.approx(left, abs=ROUNDED_PX)
    assert found.right[0] == pytest.approx(left + width, abs=ROUNDED_PX)


def test_the_stated_uncertainty_is_the_scatter() -> None:
    noise, rows = 3.0, 2000
    picture = _stripe(30.4, 3.0, 1.1, 160.0, rows) + np.random.default_rng(73).normal(0, noise, (rows, 80))
    found = _fit(picture, 30.0, 34.0, 1.1, 160.0, noise)
    # The standard deviation of 2000 values is itself known to 1.6 %: four of those.
    assert found.left.std() == pytest.approx(found.u_noise.mean(), rel=0.065)
    assert found.right.std() == pytest.approx(found.u_noise.mean(), rel=0.065)


def test_a_contrast_that_is_wrong_by_its_uncertainty_moves_the_edges_by_theirs() -> None:
    picture = _stripe(30.4, 3.0, 1.1, 160.0, 1)
    true = _fit(picture, 30.0, 34.0, 1.1, 160.0, 1.0)
    wrong = _fit(picture, 30.0, 34.0, 1.1, 160.0 * 1.015, 1.0)
    # To first order in 1.5 %.
    assert abs(wrong.left[0] - true.left[0]) == pytest.approx(true.u_shared[0], rel=0.05)
