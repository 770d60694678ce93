"""Step 3, black and white: which pixels are dark. The binary image finds; it measures nothing."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.vision.grey import GreyImage


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

    The threshold is taken from every second row and column: it moves by far less than the contrast, and costs a
    quarter.
    """
    sample = np.ascontiguousarray(denoised[::2, ::2])
    threshold, light_sample = cv2.threshold(sample, 0, np.iinfo(sample.dtype).max, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    return _split(denoised, float(threshold), sample, light_sample)


def binarise_local(denoised: GreyImage) -> Binary:
    """Split the picture against its own light, for light so uneven that no single threshold serves.

    The light is the mean over an eighth of the picture's longer side; what differs from it by half of Otsu's contrast is
    told apart by the sign.
    """
    side = max(denoised.shape) // 8
    light = cv2.blur(denoised.astype(np.float32), (2 * side + 1, 2 * side + 1), borderType=cv2.BORDER_REPLICATE)
    flat = np.clip(128.0 * denoised / np.maximum(light, 1.0), 0, 255).astype(np.uint8)
    return binarise(flat)


def _split(denoised: GreyImage, threshold: float, sample: GreyImage, light_sample: GreyImage) -> Binary:
    _, dark = cv2.threshold(denoised, threshold, 255, cv2.THRESH_BINARY_INV)
    is_light = cv2.compare(light_sample, 0, cv2.CMP_GT)
    light_mean, light_deviation = cv2.meanStdDev(sample, mask=is_light)
    dark_mean, dark_deviation = cv2.meanStdDev(sample, mask=cv2.bitwise_not(is_light) if is_light.any() else None)
    contrast = float(light_mean[0, 0] - dark_mean[0, 0])
    within = float(np.hypot(light_deviation[0, 0], dark_deviation[0, 0])) / np.sqrt(2.0)
    return Binary(dark.astype(np.uint8, copy=False), threshold, contrast, contrast / max(within, 1e-3))
