"""Noise that differs from block to block by more than chance is the trace of a codec; a camera's noise is none."""

import cv2
import numpy as np
import pytest

from fingervision.vision.uneven_noise import uneven_noise

SIZE = (320, 400)
NOISE = 2.0


def picture(noise: np.ndarray, *, depth: int = 1) -> np.ndarray:
    """A bright ground, a dark finger, and the noise."""
    levels = np.full(SIZE, 180.0)
    levels[100:, 120:250] = 40.0
    return np.rint(depth * (levels + noise)).astype(np.uint8 if depth == 1 else np.uint16)


def white(seed: int) -> np.ndarray:
    return NOISE * np.random.default_rng(seed).standard_normal(SIZE)


@pytest.mark.parametrize("seed", range(6))
def test_a_cameras_noise_is_even_also_if_a_filter_has_correlated_it(seed: int) -> None:
    assert uneven_noise(picture(white(seed))) == 0.0
    assert uneven_noise(picture(white(seed), depth=16)) == 0.0
    assert uneven_noise(picture(cv2.GaussianBlur(3.0 * white(seed), (0, 0), 0.8))) == 0.0


def test_a_picture_without_noise_or_too_small_has_no_trace() -> None:
    assert uneven_noise(picture(np.zeros(SIZE))) == 0.0
    assert uneven_noise(picture(white(1))[:20, :20]) == 0.0


@pytest.mark.parametrize("depth", [1, 16])
def test_noise_that_is_missing_in_some_blocks_is_a_trace(depth: int) -> None:
    kept = np.random.default_rng(3).random((SIZE[0] // 16, SIZE[1] // 16)) < 0.6
    share = np.where(np.kron(kept, np.ones((16, 16))), 1.0, 0.4)
    assert uneven_noise(picture(share * white(2), depth=depth)) == pytest.approx(depth * NOISE, rel=0.15)
