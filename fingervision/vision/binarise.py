"""Step 3, thresholding: which pixels are dark; the binary image only serves to find the fingers.

Nothing is measured in the binary image.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.grey import GreyImage, full_scale

# Number of pixels from which pixels are counted in pairs of neighbours, which takes half of the time; for smaller
# pictures, the table of all pairs takes as long as it saves.
LARGE_PX = 1_000_000

_count = loop("binarise_histogram")
_otsu = loop("binarise_split")
_flatten, _flatten_sums = loop("binarise_flatten"), loop("binarise_flatten_sums")


@dataclass(frozen=True, slots=True, eq=False)
class Binary:
    """Dark and light pixels of a picture.

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
    """Split the picture into dark and light by Otsu's threshold (IEEE Trans. SMC 9(1), 1979, 62-66).

    Every pixel counts for the threshold, so that a turned, mirrored or shifted picture is split in the same way. One
    histogram gives the threshold and the separation of the two classes. `top_level` is the full scale, which no level
    exceeds.
    """
    histogram = _histogram(denoised, (full_scale(denoised) if top_level is None else top_level) + 1)
    threshold, contrast, separation = _otsu(histogram)
    _, dark = cv2.threshold(denoised, threshold, 255, cv2.THRESH_BINARY_INV)
    return Binary(
        dark.astype(np.uint8, copy=False), threshold, contrast, separation, float(histogram[-1]) / denoised.size
    )


def binarise_local(denoised: GreyImage) -> Binary:
    """Split the picture by its difference from the local mean, for illumination too uneven for one threshold.

    The local mean extends an eighth of the picture's longer side in each direction; the difference is split by Otsu's
    threshold.
    """
    side = max(denoised.shape) // 8
    square = (2 * side + 1, 2 * side + 1)
    flat = np.empty(denoised.shape, dtype=np.uint8)
    if denoised.dtype == np.uint8 and 255 * square[0] * square[1] < np.iinfo(np.int32).max:
        # Sums of whole numbers take half of the time, and give the same means.
        sums = cv2.boxFilter(denoised, cv2.CV_32S, square, normalize=False, borderType=cv2.BORDER_REPLICATE)
        _flatten_sums(np.ascontiguousarray(denoised), sums, 1.0 / (square[0] * square[1]), flat)
    else:
        light = cv2.blur(denoised.astype(np.float32), square, borderType=cv2.BORDER_REPLICATE)
        _flatten(denoised, light, flat)
    return binarise(flat)


def split_at(denoised: GreyImage, otsu: Binary, threshold: int) -> Binary:
    """Return the picture split at another threshold, if Otsu's threshold put a third tone into the wrong class."""
    _, dark = cv2.threshold(denoised, threshold, 255, cv2.THRESH_BINARY_INV)
    return replace(otsu, dark=dark.astype(np.uint8, copy=False), threshold=threshold)


def _histogram(grey: GreyImage, levels: int) -> NDArray[np.int64]:
    """Number of pixels with each grey level."""
    count = np.empty(levels, dtype=np.int64)
    _count(grey, count)
    return count
