"""Step 3, black and white: which pixels are dark. The binary image finds; it measures nothing."""

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.vision.grey import GreyImage, full_scale

# The classes' spreads are taken from every so many rows and columns: nothing that is measured hangs on them.
THINNING = 3


@dataclass(frozen=True, slots=True, eq=False)
class Binary:
    """The dark pixels of a picture.

    Parameters
    ----------
    dark : ndarray of uint8, shape (height, width)
        255 where the pixel is darker than the threshold, else 0.
    threshold : float
        Grey level between the two classes.
    contrast : float
        Difference of the two classes' mean grey levels.
    separation : float
        `contrast` over the pooled standard deviation within the classes; 2.65 for pure Gaussian noise.
    """

    dark: NDArray[np.uint8]
    threshold: float
    contrast: float
    separation: float

    @property
    def light(self) -> NDArray[np.uint8]:
        """255 where the pixel is lighter than the threshold."""
        return cv2.bitwise_not(self.dark)  # type: ignore[return-value]


def binarise(denoised: GreyImage) -> Binary:
    """Split the picture in two by Otsu's threshold (IEEE Trans. SMC 9(1), 1979, 62-66).

    Every pixel has its say in the threshold, so that a picture which is turned, mirrored or shifted is split alike.
    """
    threshold, dark = cv2.threshold(denoised, 0, full_scale(denoised), cv2.THRESH_BINARY_INV | cv2.THRESH_OTSU)
    sample = np.asarray(cv2.resize(denoised, None, fx=1 / THINNING, fy=1 / THINNING, interpolation=cv2.INTER_NEAREST))
    contrast, separation = _separation(sample, threshold)
    return Binary(np.asarray(dark).astype(np.uint8, copy=False), threshold, contrast, separation)


def binarise_local(denoised: GreyImage) -> Binary:
    """Split the picture against its own light, for light so uneven that no single threshold serves.

    The light is the mean over an eighth of the picture's longer side to every side; what is left is split as before.
    """
    side = max(denoised.shape) // 8
    light = cv2.blur(denoised.astype(np.float32), (2 * side + 1, 2 * side + 1), borderType=cv2.BORDER_REPLICATE)
    flat = np.clip(128.0 * denoised / np.maximum(light, 1.0), 0, 255).astype(np.uint8)
    return binarise(flat)


def _separation(sample: NDArray[Any], threshold: float) -> tuple[float, float]:
    """Difference of the two classes' means, alone and in units of their spread."""
    is_light = sample > threshold
    light, dim = sample[is_light], sample[~is_light]
    if not len(light) or not len(dim):
        return 0.0, 0.0
    contrast = float(light.mean() - dim.mean())
    within = float(np.hypot(light.std(), dim.std())) / np.sqrt(2.0)
    return contrast, contrast / max(within, 1e-3)
