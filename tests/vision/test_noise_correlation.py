"""How many neighbouring lines share their noise: against kernels whose factor is known, and what it is for."""

import cv2
import numpy as np
import pytest

from fingervision.domain.direction import Direction
from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement
from fingervision.vision.edge_filters import edge_filters
from fingervision.vision.noise_correlation import flat_noise
from fingervision.vision.pipeline import Settings, measure_frame
from fingervision.vision.profile_lines import INNER, PLACES, ProfileLines
from tests.benchmarks.camera_artefacts.classes import BELOW_PX, zoom

LEVELS, NOISE = 65536, 900.0


def lines() -> ProfileLines:
    """Two upright edges at columns 100 and 200, seen in rows 40 to 111."""
    fixed = np.zeros((2, PLACES), dtype=np.intp)
    coarse, weight, outward = np.zeros_like(fixed), np.zeros((2, PLACES)), np.ones_like(fixed)
    fixed[:, :INNER] = np.arange(40, 40 + INNER)
    coarse[0, :INNER], coarse[1, :INNER] = 100, 200
    weight[:, :INNER] = 1.0
    outward[1] = -1
    return ProfileLines(fixed, coarse, np.zeros((2, PLACES)), weight, outward)


@pytest.mark.parametrize("kernel", [np.array([1.0]), np.array([1.0, 2.0, 1.0]) / 4.0, np.ones(3) / 3.0], ids=str)
def test_noise_of_a_known_kernel(kernel: np.ndarray) -> None:
    """Noise that was smoothed from line to line by a kernel k is shared by (sum k)^2 / sum k^2 lines."""
    found = []
    for seed in range(6):
        noise = NOISE * np.random.default_rng(seed).standard_normal((160, 300))
        smooth = cv2.filter2D(noise, -1, kernel[:, None], borderType=cv2.BORDER_REFLECT)
        picture = np.rint(30000.0 + smooth).astype(np.uint16)
        filters = edge_filters(8)
        shared, sigma = flat_noise(picture, np.arange(float(LEVELS)), lines(), filters, *filters.middle(1.0))
        assert sigma == pytest.approx(NOISE * np.sqrt(np.sum(kernel**2)), rel=0.08)
        found.append(shared)
    # One where it is not significant. The plane of light that is taken off each square takes a little of it along: each
    # of seven lags loses 3 / 256 of the sum, an eighth of the widest kernel's factor, a sixteenth of the uncertainty.
    expected = kernel.sum() ** 2 / np.sum(kernel**2)
    assert 0.85 * expected < np.mean(found) < 1.1 * expected


def test_a_digital_zoom_is_as_sure_as_it_says() -> None:
    """Twelve pictures enlarged by 1.5: without the correlation their uncertainty would be a third too small."""
    rng = np.random.default_rng(20)
    ratios = []
    for _ in range(12):
        shot = zoom(rng, 1.5)
        found = measure_frame(Frame(shot.picture, 0), Settings(BELOW_PX, Direction.UP))
        assert isinstance(found, GapMeasurement), found
        ratios.append((found.gap_px - shot.gap_px) / found.u_gap_px)
    assert 0.4 < np.sqrt(np.mean(np.square(ratios))) < 1.5
