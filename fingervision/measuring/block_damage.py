"""Detect blocks with wrong content in a decoded picture, caused by damage of the stream that the decoder missed.

JPEG and H.264 code the picture in squares of 8 or 16 pixels. Damage puts wrong content into whole squares. A picture
with damaged squares has steps of the grey level along the borders of squares, ending at their corners, where the
previous picture has none. Motion of objects does not follow the grid of the codec's squares, and optics never change an
edge within a single pixel.

Method: steps across the borders of blocks are compared with steps inside them, as in measures of blocking artefacts (Z.
Wang, H. R. Sheikh, A. C. Bovik, "No-reference perceptual quality assessment of JPEG compressed images", Proc. ICIP
2002, doi:10.1109/ICIP.2002.1038064). This module makes the comparison for the difference between two pictures, and for
each border segment separately.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.grey import GreyImage

# Side of the squares (pixels): the smallest transform of JPEG and H.264, except for that of 4 x 4 in H.264, whose
# damage appears in squares of 16.
SQUARE_PX = 8
# Smallest ratio of a step at a border to the two steps on either side of it. Lens and pixels blur real edges, so that
# an edge with a Gaussian blur of 0.5 px has a neighbouring step of half its size.
OUTSTANDING = 3.0
# Factor by which the least step is increased if mean absolute steps are used. They also detect waves caused by wrong
# coefficients, whose signed steps along a border cancel, but contain the picture's noise.
WAVES = 2.0

Levels = NDArray[np.float32]
Picture = GreyImage | Levels

_mean_change = loop("block_damage_mean_change")


def foreign_corners(picture: Picture, before: Picture, least_step: float, levels_only: bool = False) -> int:
    """Count corners of codec squares that are visible in a picture and not in the previous picture.

    Parameters
    ----------
    picture, before : ndarray of uint8, uint16 or float32, shape (height, width)
        Grey levels of the same part of both pictures, which starts at a corner of a square and contains whole squares.
    least_step : float
        Least step in grey levels; smaller steps also occur with undamaged coding.
    levels_only : bool
        Whether only wrong mean levels of squares are detected, and no waves in them, which takes a third of the time.

    Returns
    -------
    int
        Number of points where a conspicuous step along a vertical border meets a conspicuous step along a horizontal
        border.
    """
    upright = _outstanding(picture, before, least_step, levels_only)
    if not upright.any():  # true for nearly every undamaged picture
        return 0
    lying = _outstanding(picture.T, before.T, least_step, levels_only).T
    # upright[j, i] is the border segment in block row j after block column i. A corner has a vertical segment above or
    # below it, and a horizontal segment to its left or right.
    meets_upright = upright[:-1] | upright[1:]
    meets_lying = lying[:, :-1] | lying[:, 1:]
    return int(np.count_nonzero(meets_upright & meets_lying))


def _outstanding(picture: Picture, before: Picture, least_step: float, levels_only: bool) -> NDArray[np.bool_]:
    """Border segments between block columns at which the change has a step, shape (block rows, block columns - 1)."""
    at = slice(SQUARE_PX - 1, picture.shape[1] - 1, SQUARE_PX)
    stands_out = np.zeros((picture.shape[0] // SQUARE_PX, len(range(picture.shape[1])[at])), dtype=bool)
    measures = ((_levelled, least_step), (_sized, WAVES * least_step))
    for steps, least in measures[:1] if levels_only else measures:
        step = steps(picture, before)
        here, left, right = step[:, at], _largest_beside(step, at, -1), _largest_beside(step, at, 1)
        # Beside a wrong level, both sides have small steps; beside a wrong wave, only the undamaged side has.
        beside = np.maximum(left, right) if steps is _levelled else np.minimum(left, right)
        alone = (here > least) & (here > OUTSTANDING * beside)
        if alone.any():  # rare in undamaged pictures
            stands_out |= alone & (steps(picture)[:, at] > steps(before)[:, at])
    return stands_out


def _largest_beside(step: Levels, at: slice, way: int) -> Levels:
    """Larger of the two steps to the left (-1) or right (1) of each border."""
    near, far = (step[:, at.start + away : at.stop + away : SQUARE_PX] for away in (way, 2 * way))
    return np.asarray(np.maximum(near, far))


def _levelled(levels: Picture, less: Picture | None = None) -> Levels:
    """Absolute value of the mean level step between columns over each block's height, shape (block rows, width - 1).

    With `less`, the steps are those of the difference of the two pictures.
    """
    if less is None or np.float32 in (levels.dtype, less.dtype):
        rows = _block_rows(_difference(levels, less))
    else:  # stored integer levels: the usual case in a Motion JPEG stream
        rows = np.empty((levels.shape[0] // SQUARE_PX, levels.shape[1]), dtype=np.float32)
        _mean_change(levels, less, rows)
    return np.asarray(np.abs(np.diff(rows, axis=1)))


def _sized(levels: Picture, less: Picture | None = None) -> Levels:
    """Mean of the absolute level steps between columns over each block's height, shape (block rows, width - 1).

    With `less`, the steps are those of the difference of the two pictures.
    """
    return _block_rows(np.abs(np.diff(_difference(levels, less), axis=1)))


def _difference(levels: Picture, less: Picture | None) -> Levels:
    whole = np.asarray(levels, dtype=np.float32)
    return whole if less is None else whole - np.asarray(less, dtype=np.float32)


def _block_rows(levels: Levels) -> Levels:
    """Mean over each block's height, shape (block rows, width); OpenCV does this ten times as fast as NumPy."""
    size = (levels.shape[1], levels.shape[0] // SQUARE_PX)
    return np.asarray(cv2.resize(np.ascontiguousarray(levels), size, interpolation=cv2.INTER_AREA), dtype=np.float32)
