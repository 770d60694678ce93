"""Dead and hot pixels, rows and columns: found in the mean of some frames, and replaced by their neighbours."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from fingervision.domain.camera import CameraModel, DefectPixels
from fingervision.domain.frame import Frame
from fingervision.vision.grey import GreyImage

Floats = NDArray[np.float32]
Levels = TypeVar("Levels", bound=NDArray[Any])

# Excess over the neighbours: in standard deviations of the noise, which normal noise never reaches in a million pixels,
# and as a share of full scale, below which no edge is displaced.
LEAST_SIGMAS, LEAST_EXCESS = 8.0, 0.03
# Largest share of the excess in both neighbours along a direction: no optics gives light to one pixel alone, while even
# a point spread of 0.5 px gives a quarter to each.
MOST_BESIDE = 0.2
# Share of the even places of a row or column that must stand out, and least share of even places.
WHOLE, FEWEST_EVEN = 0.8, 0.1
# Extent of what a lossy codec draws beside a line (pixels).
RINGS_PX = 7
# Smallest side of a picture (pixels).
SMALLEST_PX = 5
# Largest number of defects: more of them are texture, or noise of salt and pepper.
MOST_DEFECTS = 100
# Share of the pixels whose excess tells the noise, edges and codec included: with lines among them, and without.
MOST_WITH_LINES, MOST = 0.95, 0.99
# Cubic interpolation from the two neighbours on either side.
NEAR, FAR = 4.0 / 6.0, -1.0 / 6.0


def defect_pixels(pictures: Sequence[GreyImage], top_level: int) -> tuple[DefectPixels, ...]:
    """Pixels that are sharper than any optics and stand still from picture to picture.

    Parameters
    ----------
    pictures : sequence of ndarray, shape (height, width)
        Grey levels of frames of one recording.
    top_level : int
        Full scale of the pictures.
    """
    mean = np.zeros(pictures[0].shape, np.float32)
    for picture in pictures:
        cv2.accumulate(picture, mean)
    mean *= np.float32(1.0 / (top_level * len(pictures)))
    if min(mean.shape) < SMALLEST_PX:
        return ()
    seen = excess, around, is_defect = _sharper(mean, len(pictures), top_level, MOST_WITH_LINES)
    columns, rows = _whole_columns(mean, *seen), _whole_columns(mean.T, excess.T, around.T, is_defect.T)
    lines = [DefectPixels(x, None, float(np.median(excess[:, x]))) for x in columns]
    lines += [DefectPixels(None, y, float(np.median(excess[y]))) for y in rows]
    excess, _, is_defect = _sharper(without_defects(mean, lines), len(pictures), top_level, MOST)
    for line in lines:  # a codec draws rings beside them
        if line.x_px is not None:
            is_defect[:, max(line.x_px - RINGS_PX, 0) : line.x_px + RINGS_PX + 1] = False
        elif line.y_px is not None:
            is_defect[max(line.y_px - RINGS_PX, 0) : line.y_px + RINGS_PX + 1] = False
    points = [DefectPixels(int(x), int(y), float(excess[y, x])) for y, x in np.argwhere(is_defect)[: MOST_DEFECTS + 1]]
    return (*lines, *points) if len(points) <= MOST_DEFECTS else tuple(lines)


def _sharper(mean: Floats, count: int, top_level: int, most: float) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Excess of every pixel over its neighbours, the range of these, and whether the pixel is sharper than optics."""
    # A median keeps straight edges and leaves out single lines and points.
    smooth = cv2.medianBlur(mean, 3)
    excess, window = mean - smooth, np.ones((5, 5), np.uint8)
    around = np.asarray(cv2.dilate(smooth, window) - cv2.erode(smooth, window))
    rounding = 1.0 / (top_level * np.sqrt(12.0 * count))
    sigma = max(float(np.quantile(np.abs(excess), most) / ndtri(0.5 + 0.5 * most)), rounding)
    beside = np.maximum(np.abs(_beside(mean)), np.abs(_beside(mean.T).T))
    least = np.maximum(around, max(LEAST_SIGMAS * sigma, LEAST_EXCESS))
    return excess, around, (np.abs(excess) > least) & (beside < MOST_BESIDE * np.abs(excess))


def _whole_columns(mean: Floats, excess: Floats, around: Floats, is_defect: NDArray[np.bool_]) -> list[int]:
    """Columns that stand out wherever the scene beside them is even and not as dark or light as they are themselves."""
    would_be = np.abs(mean - excess - np.median(mean, axis=0))
    stands_out = would_be > np.maximum(around, 2.0 * LEAST_EXCESS)
    count = stands_out.sum(axis=0)
    share = (stands_out & is_defect).sum(axis=0) / np.maximum(count, 1)
    return [int(x) for x in np.flatnonzero((share > WHOLE) & (count > FEWEST_EVEN * len(mean)))]


def blanked(grey: GreyImage, defects: Sequence[DefectPixels]) -> Floats:
    """Levels with NaN at the defect pixels, whose neighbours are no measurement of them."""
    out = grey.astype(np.float32)
    for defect in defects:
        rows, columns = (slice(None) if at is None else at for at in (defect.y_px, defect.x_px))
        out[rows, columns] = np.nan
    return out


def without_defects(picture: Levels, defects: Sequence[DefectPixels]) -> Levels:
    """Picture with the levels that the neighbours of defect pixels suggest, shape (height, width) or with colours."""
    if not defects:
        return picture
    out: Levels = picture.copy()
    for defect in defects:
        if defect.x_px is None:
            own, lines, at = out[defect.y_px], out, defect.y_px
        else:
            rows = slice(None) if defect.y_px is None else slice(defect.y_px, defect.y_px + 1)
            own, lines, at = out[rows, defect.x_px], np.swapaxes(out[rows], 0, 1), defect.x_px  # type: ignore[assignment]
        assert at is not None  # noqa: S101 - one of both is stated
        near, far = (_mirrored(lines, at, away) for away in (1, 2))
        levels = NEAR * near + FAR * far
        if picture.dtype.kind == "u":
            levels = np.clip(np.rint(levels), 0, 2 ** (8 * picture.itemsize) - 1)
        own[...] = levels
    return out


def repaired(frame: Frame, camera: CameraModel) -> Frame:
    """Frame without the camera's defect pixels."""
    return replace(frame, pixels=without_defects(frame.pixels, camera.defects)) if camera.defects else frame


def _beside(mean: Floats) -> Floats:
    """Mean light of the left and right neighbours beyond that of the next ones."""
    wide = cv2.copyMakeBorder(np.ascontiguousarray(mean), 0, 0, 2, 2, cv2.BORDER_REFLECT_101)
    return np.asarray(0.5 * (wide[:, 1:-3] + wide[:, 3:-1] - wide[:, :-4] - wide[:, 4:]))


def _mirrored(lines: NDArray[Any], at: int, away: int) -> NDArray[np.float64]:
    """Sum of the lines at a distance to both sides; beyond the picture's border the other side counts twice."""
    last = len(lines) - 1
    sides = [k if 0 <= k <= last else 2 * at - k for k in (at - away, at + away)]
    return np.asarray(lines[sides[0]].astype(np.float64) + lines[sides[1]].astype(np.float64))
