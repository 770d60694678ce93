"""A frame after JPEG compression."""

import cv2
import numpy as np

from fingervision.domain.errors import DataError
from fingervision.domain.frame import Pixels


def through_jpeg(pixels: Pixels, quality: int) -> Pixels:
    """Compress a frame as JPEG and decode it.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (height, width) or (height, width, 3)
        Grey levels, or red, green and blue.
    quality : int
        Quality from 0 to 100, as defined by libjpeg.

    Returns
    -------
    ndarray of uint8
        Array of the same shape.

    Raises
    ------
    DataError
        If the frame is not in 8 bits, or the quality is out of range.
    """
    if pixels.dtype != np.uint8:
        msg = f"JPEG stores 8 bits, but the frame has {pixels.dtype.itemsize * 8}: render with bits=8."
        raise DataError(msg)
    if not 0 <= quality <= 100:
        msg = f"A JPEG quality must lie between 0 and 100, but is {quality}."
        raise DataError(msg)
    # OpenCV stores colours in the order blue, green, red.
    colour = pixels.ndim == 3
    done, packet = cv2.imencode(".jpg", pixels[..., ::-1] if colour else pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])
    read = cv2.imdecode(packet, cv2.IMREAD_COLOR if colour else cv2.IMREAD_GRAYSCALE) if done else None
    if read is None:
        msg = f"OpenCV could not compress a frame of {pixels.shape[1]} x {pixels.shape[0]} pixels as JPEG."
        raise DataError(msg)
    return read[..., ::-1].astype(np.uint8) if colour else read.astype(np.uint8, copy=False)
