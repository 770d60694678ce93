"""Candidates for the steps that only find: time per 640x480 frame and error, on the same frames.

    python -m tests.benchmarks.steps [--frames 10] [--seed 4]

Error: share of pixels that the step then calls dark or light wrongly, against the picture without noise.
"""

from collections.abc import Callable

import cv2
import numpy as np
from skimage.filters import gaussian, threshold_otsu
from skimage.filters.rank import median as rank_median
from skimage.measure import find_contours

from fingervision.rendering import Camera, render, two_fingers
from fingervision.vision.binarise import binarise
from fingervision.vision.grey import denoise
from fingervision.vision.outlines import find_outlines
from tests.benchmarks.frame import Namespace, benchmark, spent_s

DENOISE: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "none": lambda a: a,
    "OpenCV median 3 (ours)": denoise,
    "OpenCV median 5": lambda a: cv2.medianBlur(a, 5),
    "OpenCV Gaussian 1 px": lambda a: cv2.GaussianBlur(a, (0, 0), 1.0),
    "scikit-image median 3": lambda a: rank_median(a, np.ones((3, 3))),
    "scikit-image Gaussian 1 px": lambda a: (255 * gaussian(a, 1.0)).astype(np.uint8),
}
SPLIT: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "Otsu with the spread (ours)": lambda a: binarise(a).dark > 0,
    "OpenCV Otsu": lambda a: cv2.threshold(a, 0, 255, cv2.THRESH_BINARY_INV | cv2.THRESH_OTSU)[1] > 0,
    "scikit-image Otsu": lambda a: a <= threshold_otsu(a),
}
OUTLINE: dict[str, Callable[[np.ndarray], object]] = {
    "OpenCV outlines (ours)": lambda a: find_outlines((255 * (a < 120)).astype(np.uint8)),
    "scikit-image find_contours": lambda a: find_contours(a, 120.0),
}


@benchmark(frames=10, seed=4)
def main(options: Namespace) -> None:
    """Print the table."""
    rng = np.random.default_rng(options.seed)
    pairs = []
    for _ in range(options.frames):
        scene = two_fingers(rng.uniform(60, 200), radius_px=30.0)
        noisy = render(scene, Camera(noise_grey=10.0), rng)
        pairs.append((noisy, render(scene, Camera(), rng) < 120))
    print(f"{'step':34s} {'ms':>8s} {'wrong pixels':>13s}")
    for candidates in (DENOISE, SPLIT, OUTLINE):
        for name, step in candidates.items():
            answers = [step(noisy) for noisy, _ in pairs]
            spent = 1e3 * spent_s(lambda step=step: [step(noisy) for noisy, _ in pairs])[0] / len(pairs)
            if candidates is OUTLINE:
                print(f"{name:34s} {spent:8.3f}")
                continue
            darks = [a < 120 if candidates is DENOISE else a for a in answers]
            wrong = np.mean([np.mean(dark != true) for dark, (_, true) in zip(darks, pairs, strict=True)])
            print(f"{name:34s} {spent:8.3f} {wrong:13.6f}")
