"""Sides of a body with another blur than the other sides: a shadow is detected, a lens's effect accepted."""

import numpy as np
import pytest

from fingervision.vision.rigid_outline import doubtful_offsets

MIDDLES = np.array([[0.0, 0, 0, 40, 40, 40, 20, 20], [10, 30, 50, 10, 30, 50, 0, 60]], dtype=float)
NORMALS = np.array([[-1.0, -1, -1, 1, 1, 1, 0, 0], [0, 0, 0, 0, 0, 0, -1, 1]], dtype=float)
U_BLUR = np.full(8, 0.01)
STRETCH = np.array([1.0, 1, 1, 1.08, 1.08, 1.08, 1.0, 1.08])


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_sides_that_a_lens_magnifies_differently_are_not_in_doubt(share: float) -> None:
    """The blur of optics is equal on all sides in the picture, the blur of defocus is equal in the object plane."""
    blur = 1.2 / STRETCH**share
    assert doubtful_offsets(MIDDLES, NORMALS, blur, U_BLUR, STRETCH).shape == (8, 0)


@pytest.mark.parametrize("stretch", [None, STRETCH])
def test_a_shadow_along_one_side_is_in_doubt(stretch: np.ndarray | None) -> None:
    blur = np.where(NORMALS[0] > 0.5, np.hypot(1.2, 0.6), 1.2)
    found = doubtful_offsets(MIDDLES, NORMALS, blur, U_BLUR, stretch)
    assert np.allclose(found[3:6].max(axis=1), 0.6, atol=0.05)
