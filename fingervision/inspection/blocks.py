"""The blocks that a picture coder leaves: steps of level at their borders."""

import numpy as np

from fingervision.domain.frame import Pixels

# Coders of pictures work in blocks of this side (pixels).
BLOCK_PX = 8
# Edges of things are no noise: a step counts up to so many levels, several times the noise of cameras.
LARGEST_STEP = 12
# Steps between blocks that are larger than those within by the first share show that the picture was coded; by the
# second, that what is seen beside an edge is the coder's work.
BLOCKY, HEAVY = 0.06, 0.5


def blockiness(pixels: Pixels) -> float:
    """How much larger the steps of level across borders of blocks are than elsewhere, as a share; about 0 without.

    Parameters
    ----------
    pixels : ndarray, shape (height, width) or (height, width, 3)
        The picture; of colours the green.
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
