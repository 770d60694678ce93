"""An error that all rows of an edge share appears in their mean residual, insignificant in ordinary pictures."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import ndtr

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.vision.pipeline import LINEAR_CAMERA, Settings, look_closely
from fingervision.vision.shared_profile import even_shift_px, flanks, shared_shift_px

LIGHT = np.arange(256.0)
SETTINGS = Settings(10.2, Direction.UP, camera=LINEAR_CAMERA)


def drawn(seed: int, shift_px: float = 0.0, noise: float = 2.0) -> NDArray[np.uint8]:
    """Two vertical bars, computed by exact (separable) integrals over the pixels."""
    rng = np.random.default_rng(seed)
    x, y, sigma = np.arange(320.0) - shift_px, np.arange(240.0)[:, None], 1.0

    def passed(at: float, along: NDArray[np.float64]) -> NDArray[np.float64]:
        q = (along - at)[..., None] + np.array([-0.5, 0.5])
        integral = q * ndtr(q / sigma) + sigma * np.exp(-0.5 * (q / sigma) ** 2) / np.sqrt(2.0 * np.pi)
        return np.asarray(integral[..., 1] - integral[..., 0])

    across = passed(40.3, x) - passed(110.6, x) + passed(205.2, x) - passed(280.9, x)
    light = 190.0 - 150.0 * across * passed(60.4, y)
    return np.clip(np.rint(light + rng.normal(0.0, noise, light.shape)), 0, 255).astype(np.uint8)


def saved_again(picture: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    return np.asarray(cv2.imdecode(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], 0), np.uint8)


def shifts(picture: NDArray[np.uint8]) -> tuple[float, float]:
    outcome, _, edges = look_closely(Frame(picture, 0), SETTINGS)
    assert isinstance(outcome, GapMeasurement)
    assert edges is not None
    found = flanks(picture, edges, LIGHT)
    assert len(found) == 4
    return even_shift_px(found), shared_shift_px(found)


def test_sound_pictures_share_nothing() -> None:
    found = [shifts(drawn(seed, 0.1 * seed))[0] for seed in range(12)]
    assert found == [0.0] * 12


def test_chance_is_what_independent_rows_leave() -> None:
    ratio = []
    for seed in range(8):
        picture = drawn(20 + seed, 0.13 * seed)
        edges = look_closely(Frame(picture, 0), SETTINGS)[2]
        assert edges is not None
        ratio += [float(np.mean(each.mean**2)) / each.chance for each in flanks(picture, edges, LIGHT)]
    # 32 flanks of nine free pixels each: the mean of the ratio scatters by 8 %.
    assert np.mean(ratio) == pytest.approx(9.0 / 13.0, rel=0.3)


def test_pictures_saved_again_after_jpeg_are_less_sure() -> None:
    found = [shifts(saved_again(drawn(40 + seed, 0.1 * seed), 60)) for seed in range(8)]
    assert np.count_nonzero([even > 0.0 for even, _ in found]) >= 6
    assert all(whole > 0.0 for _, whole in found)
    outcome = look_closely(Frame(saved_again(drawn(40), 60), 0), SETTINGS)[0]
    assert isinstance(outcome, GapMeasurement)
    assert outcome.u_shift_px > 0.0


def test_an_odd_profile_is_no_displacement() -> None:
    """Optics whose spread is not Gaussian but symmetric: a sum of two Gaussian blurs."""
    rng = np.random.default_rng(3)
    sharp = drawn(60, noise=0.0).astype(np.float64)
    wide = cv2.GaussianBlur(sharp, (0, 0), 2.0)
    picture = np.clip(np.rint(0.8 * sharp + 0.2 * wide + rng.normal(0.0, 2.0, sharp.shape)), 0, 255).astype(np.uint8)
    even, whole = shifts(picture)
    assert even == 0.0
    assert whole > 0.0


def test_overlapping_windows_say_nothing() -> None:
    picture = drawn(70)
    narrow = np.concatenate((picture[:, :114], picture[:, 202:]), axis=1)
    outcome, _, edges = look_closely(Frame(narrow, 0), SETTINGS)
    assert isinstance(outcome, GapMeasurement)
    assert edges is not None
    assert flanks(narrow, edges, LIGHT) == []
