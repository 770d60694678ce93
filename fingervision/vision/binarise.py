"""Step 3, black and white: which pixels are dark. The binary image finds; it measures nothing."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.compiled import compiled
from fingervision.vision.grey import GreyImage, full_scale


@dataclass(frozen=True, slots=True, eq=False)
class Binary:
    """The dark pixels of a picture.

    Parameters
    ----------
    dark : ndarray of uint8, shape (height, width)
        255 where the pixel is not lighter than the threshold, else 0.
    threshold : int
        Largest grey level of the dark class.
    contrast : float
        Difference of the two classes' mean grey levels.
    separation : float
        `contrast` over the pooled standard deviation within the classes; 2.65 for pure Gaussian noise.
    full_scale_share : float
        Share of the pixels at full scale.
    """

    dark: NDArray[np.uint8]
    threshold: int
    contrast: float
    separation: float
    full_scale_share: float

    @property
    def light(self) -> NDArray[np.uint8]:
        """255 where the pixel is lighter than the threshold."""
        return cv2.bitwise_not(self.dark)  # type: ignore[return-value]


def binarise(denoised: GreyImage, top_level: int | None = None) -> Binary:
    """Split the picture in two by Otsu's threshold (IEEE Trans. SMC 9(1), 1979, 62-66).

    Every pixel has its say in the threshold, so that a picture which is turned, mirrored or shifted is split alike. One
    histogram gives the threshold and how far the classes stand apart. No level lies above `top_level`, full scale.
    """
    histogram = _histogram(denoised, (full_scale(denoised) if top_level is None else top_level) + 1)
    threshold, contrast, separation = _split(histogram)
    _, dark = cv2.threshold(denoised, threshold, 255, cv2.THRESH_BINARY_INV)
    return Binary(
        dark.astype(np.uint8, copy=False), threshold, contrast, separation, float(histogram[-1]) / denoised.size
    )


def binarise_local(denoised: GreyImage) -> Binary:
    """Split the picture against its own light, for light so uneven that no single threshold serves.

    The light is the mean over an eighth of the picture's longer side to every side; what is left is split as before.
    """
    side = max(denoised.shape) // 8
    light = cv2.blur(denoised.astype(np.float32), (2 * side + 1, 2 * side + 1), borderType=cv2.BORDER_REPLICATE)
    flat = np.clip(128.0 * denoised / np.maximum(light, 1.0), 0, 255).astype(np.uint8)
    return binarise(flat)


def split_at(denoised: GreyImage, otsu: Binary, threshold: int) -> Binary:
    """The same picture split at another threshold, where Otsu's had a third tone on its wrong side."""
    _, dark = cv2.threshold(denoised, threshold, 255, cv2.THRESH_BINARY_INV)
    return replace(otsu, dark=dark.astype(np.uint8, copy=False), threshold=threshold)


@compiled
def _histogram(grey: GreyImage, levels: int) -> NDArray[np.int64]:
    """Pixels with each grey level; eight counts in turn, since neighbours are alike and would wait for each other."""
    count = np.zeros((8, levels), dtype=np.uint32)
    for row in grey:
        eights = row.size - row.size % 8
        for j in range(0, eights, 8):
            count[0, row[j]] += 1
            count[1, row[j + 1]] += 1
            count[2, row[j + 2]] += 1
            count[3, row[j + 3]] += 1
            count[4, row[j + 4]] += 1
            count[5, row[j + 5]] += 1
            count[6, row[j + 6]] += 1
            count[7, row[j + 7]] += 1
        for j in range(eights, row.size):
            count[0, row[j]] += 1
    total = np.zeros(levels, dtype=np.int64)
    for part in range(8):
        for level in range(levels):
            total[level] += count[part, level]
    return total


@compiled
def _split(histogram: NDArray[np.int64]) -> tuple[int, float, float]:
    """Otsu's threshold, the difference of the two classes' means, and that in units of their spread."""
    pixels, total = 0.0, 0.0
    for level in range(histogram.size):
        pixels += histogram[level]
        total += histogram[level] * float(level)
    threshold, largest = 0, 0.0
    below, sum_below = 0.0, 0.0
    for level in range(histogram.size - 1):
        below += histogram[level]
        sum_below += histogram[level] * float(level)
        above = pixels - below
        if histogram[level] == 0 or above == 0:
            continue
        between = below * above * (sum_below / below - (total - sum_below) / above) ** 2
        if between > largest:
            threshold, largest = level, between
    if largest == 0.0:
        return threshold, 0.0, 0.0
    means, variances = np.zeros(2), np.zeros(2)
    for side in range(2):
        first, past = (0, threshold + 1) if side == 0 else (threshold + 1, histogram.size)
        inside = 0.0
        for level in range(first, past):
            inside += histogram[level]
            means[side] += histogram[level] * float(level)
        means[side] /= inside
        for level in range(first, past):
            variances[side] += histogram[level] * (level - means[side]) ** 2
        variances[side] /= inside
    contrast = means[1] - means[0]
    return threshold, contrast, contrast / max(np.sqrt(0.5 * (variances[0] + variances[1])), 1e-3)
