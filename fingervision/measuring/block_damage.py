"""Detect blocks with wrong content in a decoded picture, caused by damage of the stream that the decoder missed.

JPEG and H.264 code the picture in squares of 8 or 16 pixels. Damage puts wrong content into whole squares. The picture
then has steps of the grey level along the borders of squares, ending at their corners, where the previous picture has
none. Motion of objects does not follow this grid, and optics never change an edge within a single pixel.

Method: steps across the borders of blocks are compared with steps inside them, as in measures of blocking artefacts (Z.
Wang, H. R. Sheikh, A. C. Bovik, "No-reference perceptual quality assessment of JPEG compressed images", Proc. ICIP
2002, doi:10.1109/ICIP.2002.1038064). Here the comparison is made for the difference between two pictures, and for each
border segment separately.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from fingervision.domain.loops import loop
from fingervision.vision.grey import GreyImage

# The smallest square that JPEG and H.264 transform, but for H.264's 4 x 4, whose damage comes in squares of 16.
SQUARE_PX = 8
# A step at the border stands out where it is so many times the two steps beside it on either side. A real edge that
# happens to lie there is spread by the lens and the pixels: one of a Gaussian spread of 0.5 px has a step half as large
# beside it.
OUTSTANDING = 3.0
# A wrong coefficient may draw a wave, whose steps along a border cancel; their sizes also hold the noise of the
# picture, so that more of them is asked for.
WAVES = 2.0

Levels = NDArray[np.float32]
Picture = GreyImage | Levels

_mean_change = loop("block_damage_mean_change")


def foreign_corners(picture: Picture, before: Picture, least_step: float, levels_only: bool = False) -> int:
    """Count corners of codec squares that are visible in a picture and were not in the previous one.

    Parameters
    ----------
    picture, before : ndarray of uint8, uint16 or float32, shape (height, width)
        Grey levels of the same part of both pictures, which starts at a corner of a square and contains whole squares.
    least_step : float
        Least step in grey levels; smaller steps also occur with undamaged coding.
    levels_only : bool
        Whether only wrong levels of squares are looked for, and no waves in them, which takes a third of the time.

    Returns
    -------
    int
        Number of points where an outstanding step along a vertical border meets one along a horizontal border.
    """
    upright = _outstanding(picture, before, least_step, levels_only)
    if not upright.any():  # as in nearly every sound picture
        return 0
    lying = _outstanding(picture.T, before.T, least_step, levels_only).T
    # upright[j, i] runs along block row j at the border behind block column i; a corner has one above or below it, and
    # a lying one to its left or right.
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
        # A wrong level is quiet on both sides, a wrong wave on the side of the sound picture alone.
        beside = np.maximum(left, right) if steps is _levelled else np.minimum(left, right)
        alone = (here > least) & (here > OUTSTANDING * beside)
        if alone.any():  # hardly ever in sound pictures
            stands_out |= alone & (steps(picture)[:, at] > steps(before)[:, at])
    return stands_out


def _largest_beside(step: Levels, at: slice, way: int) -> Levels:
    """Larger one of the two steps to the left (-1) or right (1) of each border."""
    near, far = (step[:, at.start + away : at.stop + away : SQUARE_PX] for away in (way, 2 * way))
    return np.asarray(np.maximum(near, far))


def _levelled(levels: Picture, less: Picture | None = None) -> Levels:
    """Absolute value of the mean level step between columns over each block's height, shape (block rows, width - 1).

    With `less`, the steps are those of the difference of the two pictures.
    """
    if less is None or np.float32 in (levels.dtype, less.dtype):
        rows = _block_rows(_difference(levels, less))
    else:  # pictures as they are stored, which nearly every frame of a Motion JPEG stream passes
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
