"""Step 2, denoising: for finding only. What is measured is the grey image itself, whose noise is white."""

import cv2

from fingervision.vision.grey import GreyImage


def denoise(grey: GreyImage) -> GreyImage:
    """Median of 3 by 3 pixels: takes noise and single bright pixels away and leaves edges where they are.

    A Gaussian costs about twice as much and rounds the tips; a median of 5 by 5 costs more than twice as much
    (`tests/benchmarks/steps.py` prints the times).
    """
    return cv2.medianBlur(grey, 3)  # type: ignore[return-value]
