"""Search for the lines of a line scale (stage micrometer): their direction, their rows, and rough positions."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from calib.errors import CalibrationError

Floats = NDArray[np.float64]

# Smallest distance of lines (pixels), and smallest number of visible lines.
NEAREST_PX, FEWEST_LINES = 4.0, 3
# Smallest number of rows of a piece of a line from which a position is fitted.
FEWEST_ROWS = 3
# Smallest contrast of a row that shows the scale, as a share of the usual contrast.
LEAST_CONTRAST = 0.85
# Half width of the search about the direction from the gradients (degrees), and finest step of the search.
SEARCH_DEG, FINE_DEG = 3.0, 0.02
# Smallest ratio of the lines' contrast to the noise of their mean profile.
LEAST_SIGNAL = 8.0


@dataclass(frozen=True, slots=True, eq=False)
class CoarseLines:
    """Lines of a scale, located to the nearest pixel in the picture or, if the lines are horizontal, its transpose.

    Parameters
    ----------
    middle : ndarray of float, shape (n,)
        Column of the centre of each line in the middle row of `rows`.
    width, pitch : float
        Median width of the lines, and median distance of neighbouring lines (pixels).
    is_dark : bool
        Whether the lines are darker than the spaces between them.
    slope : float
        Columns by which a line moves per row.
    rows : (int, int)
        First and last row in which the lines have their usual contrast.
    is_turned : bool
        Whether rows and columns are those of the transposed picture.
    """

    middle: Floats
    width: float
    pitch: float
    is_dark: bool
    slope: float
    rows: tuple[int, int]
    is_turned: bool


def lines_to_a_pixel(part: Floats) -> CoarseLines:
    """Find the lines of a scale in a picture with levels proportional to light, shape (height, width).

    Raises
    ------
    CalibrationError
        The picture shows fewer than three parallel lines, or the lines are too close together.
    """
    slope, is_turned = _direction(part)
    upright = part.T if is_turned else part
    slope = _refined(upright, slope)
    return _found(upright, slope, _rows(upright, slope), is_turned)


def _direction(part: Floats) -> tuple[float, bool]:
    """Slope of the lines in columns per row (structure tensor: Bigun & Granlund, ICCV 1987).

    Also return whether the lines are horizontal; the slope is then that of the transposed picture.
    """
    soft = cv2.GaussianBlur(part, (0, 0), 1.0)
    gx, gy = cv2.Sobel(soft, cv2.CV_64F, 1, 0), cv2.Sobel(soft, cv2.CV_64F, 0, 1)
    angle = 0.5 * np.arctan2(2.0 * float(np.sum(gx * gy)), float(np.sum(gx * gx) - np.sum(gy * gy)))
    is_turned = abs(np.cos(angle)) < abs(np.sin(angle))
    slope = -1.0 / np.tan(angle) if is_turned else -np.tan(angle)
    return float(slope), bool(is_turned)


def _refined(upright: Floats, slope: float) -> float:
    """Slope at which the mean profile along the lines has the largest contrast."""
    step = np.tan(np.radians(SEARCH_DEG)) / 4.0
    while step > np.radians(FINE_DEG):
        tried = [slope + k * step for k in (-2, -1, 0, 1, 2)]
        slope = max(tried, key=lambda each: float(np.var(_profile(upright, each, (0, upright.shape[0] - 1)))))
        step *= 0.5
    return slope


def _profile(upright: Floats, slope: float, rows: tuple[int, int]) -> Floats:
    """Mean level along the lines, as a function of the column in the middle row.

    Columns for which less than half of the rows lie inside the picture are left out.
    """
    used = np.arange(rows[0], rows[1] + 1)
    offset = slope * (used - 0.5 * (rows[0] + rows[1]))
    columns = np.arange(upright.shape[1], dtype=np.float64)
    at = columns[None, :] + offset[:, None]
    left = np.floor(at).astype(int)
    inside = (left >= 0) & (left + 1 < upright.shape[1])
    left = np.clip(left, 0, upright.shape[1] - 2)
    share = at - left
    lines = used[:, None]
    level = (1.0 - share) * upright[lines, left] + share * upright[lines, left + 1]
    count = inside.sum(axis=0)
    total = np.where(inside, level, 0.0).sum(axis=0)
    full = count >= max(1, used.size // 2)
    return np.asarray(total[full] / count[full])


def _rows(upright: Floats, slope: float) -> tuple[int, int]:
    """Longest run of rows in which the lines have nearly their largest contrast."""
    middle = 0.5 * (upright.shape[0] - 1)
    offset = np.rint(slope * (np.arange(upright.shape[0]) - middle)).astype(int)
    shifted = np.array([np.roll(row, -by) for row, by in zip(upright, offset, strict=True)])
    margin = int(np.abs(offset).max())
    inner = shifted[:, margin : shifted.shape[1] - margin] if 2 * margin < shifted.shape[1] // 2 else shifted
    # Each row is compared with the mean of the third of the rows that has the largest contrast.
    own = inner - inner.mean(axis=1, keepdims=True)
    best = np.argsort(own.std(axis=1))[-max(len(own) // 3, FEWEST_ROWS) :]
    usual = np.median(own[best], axis=0)
    seen = own @ usual / max(float(usual @ usual), 1e-12)
    soft = np.convolve(np.pad(seen, 2, mode="edge"), np.full(5, 0.2), mode="valid")
    good = np.flatnonzero(soft > LEAST_CONTRAST * float(np.quantile(soft, 0.9)))
    if not good.size:
        raise CalibrationError("A picture of a line scale must show lines, but there are none: check light and focus.")
    runs = np.split(good, np.flatnonzero(np.diff(good) > 1) + 1)
    run = max(runs, key=len)
    # Rows at the ends of the lines are excluded.
    first, last = int(run[0]) + (2 if run[0] > 0 else 0), int(run[-1]) - (2 if run[-1] < len(own) - 1 else 0)
    if last - first + 1 < FEWEST_ROWS * 2:
        raise CalibrationError(
            "The lines of a scale must be visible over at least six rows of pixels, but are not: "
            "select the lines with --roi."
        )
    return first, last


def _found(upright: Floats, slope: float, rows: tuple[int, int], is_turned: bool) -> CoarseLines:
    """Lines of the mean profile, without lines that the picture's border cuts and without marks of another width."""
    profile = _profile(upright, slope, rows)
    # The same number of columns is left out on both sides, where not all slanted rows have pixels.
    first = (upright.shape[1] - profile.size) // 2
    low, high = (float(level) for level in np.percentile(profile, (2, 98)))
    noise = 1.4826 * float(np.median(np.abs(np.diff(upright[rows[0] : rows[1] + 1], axis=0)))) / np.sqrt(2.0)
    if high - low < LEAST_SIGNAL * max(noise / np.sqrt(rows[1] - rows[0] + 1), 0.05):
        raise CalibrationError("A picture of a line scale must show lines, but there are none: check light and focus.")
    is_low = profile < 0.5 * (low + high)
    is_dark = bool(is_low.mean() <= 0.5)
    marks = is_low if is_dark else ~is_low
    starts = np.flatnonzero(marks & ~np.roll(marks, 1))
    ends = np.flatnonzero(marks & ~np.roll(marks, -1))
    if marks[0]:  # a line at the picture's border has only one edge
        starts, ends = starts[starts > 0], ends[ends >= (starts[starts > 0][0] if (starts > 0).any() else profile.size)]
    if starts.size and marks[-1]:
        starts = starts[:-1]
    ends = ends[: starts.size]
    if starts.size < FEWEST_LINES:
        raise CalibrationError(
            f"The picture of a line scale must show at least {FEWEST_LINES} complete lines, but shows {starts.size}: "
            "move the scale, or select the lines with --roi."
        )
    middle, width = 0.5 * (starts + ends) + first, float(np.median(ends - starts + 1))
    pitch = float(np.median(np.diff(middle)))
    if pitch < NEAREST_PX:
        raise CalibrationError(
            f"Lines of a scale must be at least {NEAREST_PX:g} px apart, but are {pitch:.1f} px: use a coarser scale."
        )
    # Digits and dirt have a width other than that of the lines.
    alike = (ends - starts + 1 < 2.0 * width + 2.0) & (ends - starts + 1 > 0.5 * width - 2.0)
    reach = 0.5 * pitch
    alike &= (middle > reach) & (middle < upright.shape[1] - 1 - reach)
    if np.count_nonzero(alike) < FEWEST_LINES:
        raise CalibrationError(
            f"The picture of a line scale must show at least {FEWEST_LINES} complete lines of equal width, but shows "
            f"{np.count_nonzero(alike)}: select such lines with --roi."
        )
    return CoarseLines(middle[alike].astype(np.float64), width, pitch, is_dark, slope, rows, is_turned)
