"""Block artefacts of a codec: steps of the grey level at the borders of blocks."""

import numpy as np

from fingervision.domain.frame import Pixels

# Coders of pictures work in blocks of this side (pixels).
BLOCK_PX = 8
# Edges of things are no noise: a step counts up to so many levels, several times the noise of cameras.
LARGEST_STEP = 12
# Noise alone makes up to 0.1 in a small picture, JPEG of quality 95 0.4, of 85 and less 1 and more.
# Steps between blocks that are larger than those within by the first share show that the picture was coded; by the
# second, that what is seen beside an edge is the coder's work.
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
