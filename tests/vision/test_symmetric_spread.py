"""A symmetric spread of any shape is explained by optics; an asymmetric spread is not."""

import numpy as np
from scipy.special import ndtr

from fingervision.vision.profile_models import symmetric_squares

T = np.arange(-16.0, 16.0, 0.5) + 0.25
WEIGHT = np.full(T.size, 70.0 / 4.0)


def _disc(radius_px: float) -> np.ndarray:
    """Light of a step blurred by a disc of defocus, computed from its line spread function."""
    fine = np.linspace(-20.0, 20.0, 8001)
    spread = np.sqrt(np.maximum(radius_px**2 - fine**2, 0.0))
    return 30.0 + 150.0 * np.interp(T, fine, np.cumsum(spread) / spread.sum())


def test_a_disc_is_symmetric_and_a_line_of_light_is_not() -> None:
    """For a disc of defocus, slightly off the profile's centre, only noise remains; for a line of light, much more
    remains.
    """
    rng = np.random.default_rng(5)
    noise = rng.standard_normal(T.size) / np.sqrt(WEIGHT)
    disc = symmetric_squares(T + 0.07, _disc(2.0) + noise, WEIGHT, 1.1)
    glare = symmetric_squares(T, 30.0 + 150.0 * ndtr(T) + 40.0 * np.exp(-0.5 * (T + 2.0) ** 2) + noise, WEIGHT, 1.1)
    assert disc < 2.0 * T.size
    assert glare > 10.0 * T.size
