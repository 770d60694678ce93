"""What lies on an edge is found from its parts, also where one part of it shows places that no other does."""

import numpy as np
from scipy.special import ndtr

from calib.edge_profile import BIN_PX, binned_profile


def test_places_that_only_a_short_part_shows_have_a_finite_structure() -> None:
    rng = np.random.default_rng(5)
    every = np.arange(-8.0, 8.0, BIN_PX) + 0.5 * BIN_PX
    places = [every[every < 6.0]] * 8 + [every[every > 4.0]]  # the last part is short, and alone beyond 6 px
    away = np.concatenate([np.tile(each, 40) for each in places])
    part = np.concatenate([np.full(40 * each.size, k) for k, each in enumerate(places)])
    waves = 0.02 * rng.standard_normal(len(places))[part] * np.sin(2.0 * away)
    level = 0.2 + 0.5 * ndtr(away) + waves + 0.002 * rng.standard_normal(away.size)
    found = binned_profile(away, level, np.zeros(away.size, dtype=int), 1.0 / 255.0, 1.0, part=part)
    assert found is not None
    assert found.u_structure.max() > 0.001
    assert np.isfinite(found.u_structure).all()
