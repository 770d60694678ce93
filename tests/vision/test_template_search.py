"""A template is found at its true position, with the correlation of the definition, and is not found where it is
absent.
"""

import numpy as np
import pytest

from fingervision.vision.straight_edge_fit import Band, EdgeStart, NoEdgeFitError, fit_straight_edges
from fingervision.vision.template_search import BEYOND_PX, Template


def _correlation(part: np.ndarray, template: np.ndarray) -> np.ndarray:
    """Zero-normalised correlation, computed by its definition at every position."""
    windows = np.lib.stride_tricks.sliding_window_view(part.astype(float), template.shape)
    centred = windows - windows.mean(axis=(2, 3), keepdims=True)
    own = template.astype(float) - template.mean()
    power = np.sqrt((centred**2).sum(axis=(2, 3)) * (own**2).sum())
    return np.einsum("ijkl,kl->ij", centred, own) / np.maximum(power, 1e-9)


def test_the_best_place_is_that_of_the_largest_correlation() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        part = rng.normal(128.0, 30.0, (52, 47)).astype(np.float32)
        row, column = rng.integers(BEYOND_PX, 20, 2)
        template = part[row : row + 21, column : column + 17].copy()
        part += rng.normal(0.0, 15.0, part.shape).astype(np.float32)
        found = Template(template).best_match(part)
        seen = _correlation(part, template)
        assert found.correlation == pytest.approx(seen[row, column], abs=1e-4)
        assert abs(found.x_px - column - 8) < 0.5
        assert abs(found.y_px - row - 10) < 0.5
        assert found.is_alone


def test_what_repeats_is_not_alone() -> None:
    lattice = np.tile(np.kron(np.eye(2), np.ones((4, 4))), (7, 7)).astype(np.float32)
    assert not Template(lattice[16:33, 16:33].copy()).best_match(lattice).is_alone


def test_a_blank_part_a_blank_template_and_too_small_a_part_have_no_match() -> None:
    blank, texture = np.full((40, 40), 77.0, np.float32), np.random.default_rng(1).normal(0, 9, (40, 40))
    textured = texture.astype(np.float32)
    for part, template in ((blank, textured[:15, :15]), (textured, blank[:15, :15]), (textured[:15, :15],) * 2):
        found = Template(template.copy()).best_match(part.copy())
        assert not found.is_alone
        assert found.correlation == 0.0


def test_no_edge_and_too_many_edges_are_a_sentence() -> None:
    for starts in ((), tuple(EdgeStart(float(k)) for k in range(7))):
        with pytest.raises(NoEdgeFitError, match=str(len(starts))):
            fit_straight_edges(np.zeros((30, 30)), (0, 0), Band(15.0, 15.0, 0.0, 20.0), starts)
