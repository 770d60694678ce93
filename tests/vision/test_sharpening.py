"""Sharpening of stored levels: profiles computed with a known mask, and pictures like those of a webcam."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from fingervision.vision.sharpening import Profile, is_curved, sharpening

LEVELS = np.arange(256.0)
POWER = 255.0 * (LEVELS / 255.0) ** 2.2


def profile(at: float, blur: float, amount: float, rng: np.random.Generator, noise: float = 0.3) -> Profile:
    """A step of light in strips of a thousandth of a pixel, encoded, and sharpened with a radius of one pixel."""
    fine = np.arange(-24.0, 24.0, 0.02)
    light = 0.06 + 0.59 * gaussian_filter1d((fine > at).astype(float), blur / 0.02)
    coded = 255.0 * light ** (1.0 / 2.2)
    sharp = coded + amount * (coded - gaussian_filter1d(coded, 1.0 / 0.02))
    t = np.arange(-16.0, 16.0, 0.5)
    return Profile(t, np.interp(t, fine, sharp) + noise * rng.standard_normal(t.size), np.full(t.size, 20.0))


@pytest.mark.parametrize("amount", [0.3, 0.6])
def test_a_mask_gives_back_where_the_edge_is(amount: float) -> None:
    rng = np.random.default_rng(int(10 * amount))
    found = sharpening((profile(0.06, 1.1, amount, rng), profile(-0.04, 1.1, amount, rng)), POWER, 255, 1.0)
    assert found is not None
    assert found.shift_px == pytest.approx((0.06, -0.04), abs=0.03)
    assert found.amount == pytest.approx(amount, abs=0.2)


def test_without_a_mask_there_is_none() -> None:
    rng = np.random.default_rng(2)
    seen = [sharpening((profile(0.0, 1.1, 0.0, rng), profile(0.0, 1.1, 0.0, rng)), POWER, 255, 1.1) for _ in range(20)]
    assert sum(found is not None for found in seen) <= 1


def test_levels_in_proportion_to_light_need_none() -> None:
    assert not is_curved(LEVELS, 255)
    assert is_curved(POWER, 255)
