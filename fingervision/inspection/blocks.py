"""Block artefacts of a codec: steps of the grey level at the borders of blocks."""

import numpy as np

from fingervision.domain.frame import Pixels

# Side of the blocks in which codecs process pictures (pixels).
BLOCK_PX = 8
# Larger differences of neighbouring levels are left out, because they are edges of objects; this limit is several times
# the noise of cameras.
LARGEST_STEP = 12
# Limits of the blockiness. Above the first, the picture was coded in blocks; above the second, structures beside an
# edge are regarded as errors of the codec. Noise alone gives up to 0.1 in a small picture, JPEG of quality 95 gives
# 0.4, and JPEG of quality 85 or less gives 1 or more.
BLOCKY, HEAVY = 0.3, 0.5


def blockiness(pixels: Pixels) -> float:
    """Relative excess of level differences across block borders over those elsewhere; about 0 without a block codec.

    Parameters
    ----------
    pixels : ndarray, shape (height, width) or (height, width, 3)
        The picture; of a colour picture the green channel is used.
    """
    grey = pixels if pixels.ndim == 2 else pixels[..., 1]
    ratios = []
    for axis in (0, 1):
        steps = np.abs(np.diff(grey.astype(np.int32), axis=axis))
        mean = np.minimum(steps, LARGEST_STEP).mean(axis=1 - axis)
        at_border = np.arange(mean.size) % BLOCK_PX == BLOCK_PX - 1
        if at_border.sum() > 2:
            ratios.append(float(mean[at_border].mean() / max(mean[~at_border].mean(), 0.02)) - 1.0)
    return float(np.mean(ratios)) if ratios else 0.0
