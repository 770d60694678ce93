"""Step 1, grey scale: one number a pixel, as close to the sensor as the source allows."""

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Pixels

GreyImage = NDArray[np.uint8] | NDArray[np.uint16]


def to_grey(pixels: Pixels) -> GreyImage:
    """Grey levels of a picture, at its own bit depth.

    A grey picture passes untouched. Colour becomes the luma of ITU-R BT.601, whose weights add up to one, so that a
    grey picture stored as colour gives back its own levels.

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
    return int(np.iinfo(grey.dtype).max)
