"""Step 1, grey scale: one number per pixel, as close to the sensor's data as the source allows, and the full scale.

Step 2, denoising: used only to find the fingers.

The measurement itself uses the grey image without denoising, because the noise of that image is white.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Pixels
from fingervision.domain.loops import loop

GreyImage = NDArray[np.uint8] | NDArray[np.uint16]

# Bit depths of sensors whose levels are stored in 16 bits.
SENSOR_BITS = (10, 12, 14, 16)


def to_grey(pixels: Pixels) -> GreyImage:
    """Grey levels of a picture, at its own bit depth.

    A grey picture is returned unchanged. Colour becomes the luma of ITU-R BT.601, whose weights add up to one, so that
    a grey picture stored as colour gives back its own levels.

    Parameters
    ----------
    pixels : ndarray, shape (height, width) or (height, width, 3)
        Grey, or red, green and blue.

    Returns
    -------
    ndarray, shape (height, width)
        Same type as `pixels`.
    """
    if pixels.ndim == 2:
        return pixels
    return cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY)  # type: ignore[return-value]


def full_scale(grey: GreyImage) -> int:
    """Largest level that the picture's type can hold."""
    return (1 << 8 * grey.itemsize) - 1


def top_level(grey: GreyImage, bits: int | None = None) -> int:
    """Level at which the sensor saturates.

    Cameras store 10, 12 or 14 bits in 16-bit words, in their lower or in their upper bits. Which bits are used follows
    from the bits that are set in any pixel: none above the depth, or none in the lowest bits.

    Parameters
    ----------
    grey : ndarray, shape (height, width)
        Grey levels.
    bits : int or None
        Bit depth stated by the user; it is ignored if the picture itself uses more bits.
    """
    if grey.dtype == np.uint8:
        return 255
    used = int(np.bitwise_or.reduce(grey, axis=None))
    unused_below = (used & -used).bit_length() - 1 if used else 0
    if used.bit_length() == 16 and unused_below:
        return used | (0xFFFF >> unused_below << unused_below)
    seen = next(depth for depth in SENSOR_BITS if used.bit_length() <= depth)
    depth = seen if bits is None else max(bits, used.bit_length())
    return int(2**depth - 1)


def denoise(grey: GreyImage) -> GreyImage:
    """Median of 3 by 3 pixels, which removes noise and single bright pixels and leaves edges in place.

    A Gaussian filter takes about twice the time and rounds the tips; a median of 5 by 5 takes more than twice the time
    (`tests/benchmarks/steps.py` prints the times).
    """
    return cv2.medianBlur(grey, 3)  # type: ignore[return-value]


_middle, _median = loop("median_middle"), loop("median_median")
