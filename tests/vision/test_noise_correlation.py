"""Number of neighbouring lines that share noise: for filter kernels with a known factor, and its effect on
uncertainties.
"""

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
    """Two vertical edges at columns 100 and 200, located in rows 40 to 111."""
    fixed = np.zeros((2, PLACES), dtype=np.intp)
    coarse, weight, outward = np.zeros_like(fixed), np.zeros((2, PLACES)), np.ones_like(fixed)
    fixed[:, :INNER] = np.arange(40, 40 + INNER)
    coarse[0, :INNER], coarse[1, :INNER] = 100, 200
    weight[:, :INNER] = 1.0
    outward[1] = -1
    return ProfileLines(fixed, coarse, np.zeros((2, PLACES)), weight, outward)


def edge_weight(reach: int) -> np.ndarray:
    """Weights of a line's pixels for the position of an edge with a blur of 1 px: derivative, orthogonal to the two
    levels.
    """
    place = np.arange(-reach, reach + 1)
    slope = np.exp(-0.5 * place**2 / (1.0 + 1.0 / 12.0))
    return slope - slope.mean()


# Two sides of an edge with six squares of 16 x 16 pixels each, seven lags from line to line, and the seeds of the test.
PIXELS, LAGS, SEEDS = 6 * 16 * 16, 7, 24


@pytest.mark.parametrize("kernel", [np.array([1.0]), np.array([1.0, 2.0, 1.0]) / 4.0, np.ones(3) / 3.0], ids=str)
def test_noise_of_a_known_kernel(kernel: np.ndarray) -> None:
    """Noise that was smoothed from line to line by a kernel k is shared by (sum k)^2 / sum k^2 lines.

    What the estimate scatters by (Priestley, Spectral Analysis and Time Series, 1981, 6.2.4: a spectrum at frequency
    zero from all lags up to M has the relative variance 2 (2M + 1) / n): n is the number of independent values of a
    side, its pixels over what the edge's weight makes neighbours share. The larger one of two sides is taken, on
    average 0.564 of their scatter above the mean, with 0.826 of that scatter (David, Order Statistics, 1981).
    """
    weight = edge_weight(8)
    product = np.correlate(weight, weight, "full")
    near = product[weight.size - 4 : weight.size + 3] / product.max()
    scatter = np.sqrt(2.0 * LAGS * np.sum(near**2) / PIXELS)
    found = []
    for seed in range(SEEDS):
        noise = NOISE * np.random.default_rng(seed).standard_normal((160, 300))
        smooth = cv2.filter2D(noise, -1, kernel[:, None], borderType=cv2.BORDER_REFLECT)
        picture = np.rint(30000.0 + smooth).astype(np.uint16)
        filters = edge_filters(8)
        shared, _, sigma = flat_noise(picture, np.arange(float(LEVELS)), lines(), filters, *filters.middle(1.0))
        # A variance from n values with this correlation scatters by 2 sum rho^2 / n, the quieter of two sides is taken.
        own = np.correlate(kernel, kernel, "full") / np.sum(kernel**2)
        assert sigma == pytest.approx(
            NOISE * np.sqrt(np.sum(kernel**2)), rel=4.5 * np.sqrt(np.sum(own**2) / 2 / PIXELS)
        )
        found.append(shared)
    expected = kernel.sum() ** 2 / np.sum(kernel**2)
    if expected == 1.0:
        # Not significant: one; now and then a little more.
        assert np.mean(np.array(found) == 1.0) > 0.9
        assert max(found) < 1.0 + 5.0 * scatter
        return
    # The plane of light that is taken off each square takes 3 of 256 degrees of freedom along, at every lag.
    plane = 3.0 / 256.0 * LAGS * max(np.sum(near), 0.0)
    mean = expected * (1.0 - plane + 0.564 * scatter)
    assert abs(np.mean(found) - mean) < 3.0 * expected * 0.826 * scatter / np.sqrt(SEEDS)
    assert np.std(found) < 1.5 * expected * 0.826 * scatter


def test_a_digital_zoom_is_as_sure_as_it_says() -> None:
    """Twelve pictures enlarged by 1.5: without the correlation, their stated uncertainty would be a third too small."""
    rng = np.random.default_rng(20)
    ratios = []
    for _ in range(12):
        shot = zoom(rng, 1.5)
        found = measure_frame(Frame(shot.picture, 0), Settings(BELOW_PX, Direction.UP))
        assert isinstance(found, GapMeasurement), found
        ratios.append((found.gap_px - shot.gap_px) / found.u_gap_px)
    assert 0.4 < np.sqrt(np.mean(np.square(ratios))) < 1.5
