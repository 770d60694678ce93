"""Step 2, denoising: used only to find the fingers.

The measurement itself uses the grey image without denoising, because the noise of that image is white.
"""

import cv2

from fingervision.vision.grey import GreyImage


def denoise(grey: GreyImage) -> GreyImage:
    """Median of 3 by 3 pixels, which removes noise and single bright pixels and leaves edges in place.

    A Gaussian filter takes about twice the time and rounds the tips; a median of 5 by 5 takes more than twice the time
    (`tests/benchmarks/steps.py` prints the times).
    """
    return cv2.medianBlur(grey, 3)  # type: ignore[return-value]
