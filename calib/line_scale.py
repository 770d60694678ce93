"""Lines of a line scale (stage micrometer): position, width and uncertainty of each line.

A line is a stripe with two edges: c + A (step(t - x1) - step(t - x2)), each step blurred by the same Gaussian. Blooming
and the camera's response move the two edges in opposite directions and leave the centre of the line in place, so that
the pitch does not depend on the edge bias. The width of a line does depend on the edge bias; if the true width is
known, the edge bias follows from it.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import ndtr

from calib.errors import CalibrationError
from calib.short_repr import ShortRepr

Floats = NDArray[np.float64]

# Search for the lines of a line scale (stage micrometer): their direction, their rows, and rough positions.


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


Grey = NDArray[np.uint8] | NDArray[np.uint16]

# Number of pieces into which a line is divided along its length; the scatter of the pieces gives the uncertainty.
PIECES = 8
# Smallest ratio of a line's width to the blur at which the two edges can be distinguished; a narrower line shows only
# its centre.
RESOLVED_BLURS = 2.0
# Width of the bins in which the pixels of a line are averaged.
BIN_PX = 0.125
# Number of lines from which the blur is determined.
LINES_FOR_BLUR = 8
# Smallest standard uncertainty of a line's centre (pixels), even if all pieces agree.
LEAST_U_PX = 1e-3


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ScaleLines(ShortRepr):
    """Lines measured in a picture; arrays of shape (n,).

    Parameters
    ----------
    middle_px : ndarray of float, shape (n, 2)
        Centre of each line in x and y; all centres are on one straight line perpendicular to the lines.
    across : ndarray of float, shape (2,)
        Unit vector across the lines.
    at_px : ndarray of float
        Position of each line along `across`, from the first line.
    u_at_px : ndarray of float
        Standard uncertainty of the position, from the scatter of the pieces of the line.
    rising_px, falling_px : ndarray of float
        Positions, like `at_px`, of the edges at which the level rises and falls along `across`.
    width_px : ndarray of float or None
        Width of each line; None if the lines are too narrow compared with the blur.
    is_dark : bool
        Whether the lines are darker than the spaces between them.
    blur_px : float
        Blur of the edges (standard deviation).
    rows : (int, int)
        First and last row that was used (columns, for lines parallel to the rows).
    is_clipped : bool
        Whether lines or background are at an end of the scale: the widths are then too large or too small.
    """

    middle_px: Floats
    across: Floats
    at_px: Floats
    u_at_px: Floats
    rising_px: Floats
    falling_px: Floats
    width_px: Floats | None
    is_dark: bool
    blur_px: float
    rows: tuple[int, int]
    is_clipped: bool


def find_lines(grey: Grey, region: tuple[int, int, int, int] | None = None) -> ScaleLines:
    """Find and measure all lines of a scale.

    Parameters
    ----------
    grey : ndarray, shape (height, width)
        Picture with levels proportional to light.
    region : tuple of int, optional
        x, y, width and height of the part of the picture to be searched.

    Raises
    ------
    CalibrationError
        The picture shows fewer than three parallel lines, or the lines are too close together.

    Examples
    --------
    Ten dark lines, 40 pixels apart:

    >>> import numpy as np, calib
    >>> away = np.abs((np.arange(440.0) - 10.0) % 40.0 - 20.25)
    >>> away[:10] = away[410:] = 20.0
    >>> row = 220.0 - 180.0 * np.clip(5.5 - away, 0.0, 1.0)
    >>> lines = calib.find_lines(np.rint(np.tile(row, (120, 1))).astype(np.uint8))
    >>> lines.at_px.size, float(np.round(np.diff(lines.at_px).mean(), 3))
    (10, 40.0)
    """
    x0, y0, width, height = region if region is not None else (0, 0, grey.shape[1], grey.shape[0])
    if x0 < 0 or y0 < 0 or width < 1 or height < 1 or x0 + width > grey.shape[1] or y0 + height > grey.shape[0]:
        raise CalibrationError(
            f"The region must lie within the picture of {grey.shape[1]}x{grey.shape[0]} pixels, but is "
            f"{x0},{y0},{width},{height}: give X,Y,WIDTH,HEIGHT."
        )
    part = grey[y0 : y0 + height, x0 : x0 + width].astype(np.float64)
    if min(part.shape) < 2 * PIECES:
        raise CalibrationError(f"A picture of a scale must have at least {2 * PIECES} rows and columns.")
    first = lines_to_a_pixel(part)
    upright, rows, is_turned = (part.T if first.is_turned else part), first.rows, first.is_turned
    at, lean, width_px, blur, u_at = _measured(upright, first)
    # The median slope of all lines corrects the direction `across`.
    slope = first.slope + float(np.median(lean))
    length = float(np.hypot(1.0, slope))
    across = np.array([1.0, -slope]) / length
    row = 0.5 * (rows[0] + rows[1])
    # Positions were found along a row; the distances perpendicular to the lines are shorter.
    along = at / length
    start = np.array([at[0], row])
    middle = start + np.outer(along - along[0], across)
    half = 0.5 * width_px / length
    if is_turned:
        middle, across = middle[:, ::-1], across[::-1]
    is_dark = first.is_dark
    resolved = float(np.median(width_px)) > RESOLVED_BLURS * blur
    top = float(np.iinfo(grey.dtype).max) if grey.dtype == np.uint8 else float(grey.max())
    ends = np.mean((part <= 0.0) | (part >= top))
    return ScaleLines(
        middle_px=middle + np.array([x0, y0]),
        across=across,
        at_px=along - along[0],
        u_at_px=u_at / length,
        rising_px=along - along[0] + (half if is_dark else -half),
        falling_px=along - along[0] - (half if is_dark else -half),
        width_px=2.0 * half if resolved else None,
        is_dark=is_dark,
        blur_px=blur / length,
        rows=(rows[0] + (x0 if is_turned else y0), rows[1] + (x0 if is_turned else y0)),
        is_clipped=bool(ends > 0.1),
    )


def _measured(upright: Floats, coarse: CoarseLines) -> tuple[Floats, Floats, Floats, float, Floats]:
    """Position in the middle row, residual slope, width, common blur, and uncertainty of the positions of the lines."""
    rows = coarse.rows
    row = 0.5 * (rows[0] + rows[1])
    whole = np.arange(rows[0], rows[1] + 1)
    # All lines have the same blur, which is determined from some of them.
    some = coarse.middle[:: max(1, coarse.middle.size // LINES_FOR_BLUR)]
    fits = [_fit(upright, row, whole, middle, coarse, None) for middle in some]
    blur = float(np.median([fit[2] for fit in fits]))
    count = min(PIECES, whole.size // FEWEST_ROWS)
    pieces = np.array_split(whole, count)
    at, lean, width, u_at = [], [], [], []
    for middle in coarse.middle:
        own = np.array([_fit(upright, row, piece, middle, coarse, blur)[:2] for piece in pieces])
        height = np.array([piece.mean() - row for piece in pieces])
        place = own[:, 0]
        # Pieces with dirt are excluded from the line's fit, because they deviate from the others.
        keep = np.abs(place - np.median(place)) < 5.0 * 1.4826 * np.median(np.abs(place - np.median(place))) + 0.05
        by, here = np.polyfit(height[keep], place[keep], 1) if np.count_nonzero(keep) > 2 else (0.0, place.mean())
        left = place[keep] - here - by * height[keep]
        freedom = max(int(np.count_nonzero(keep)) - 2, 1)
        at.append(here)
        lean.append(by)
        width.append(float(np.median(own[keep, 1])))
        u_at.append(float(np.sqrt(left @ left / freedom / np.count_nonzero(keep))))
    # The scatter of few pieces is uncertain, so that the uncertainty of a line is at least half of the median
    # uncertainty.
    u = np.maximum(np.array(u_at), max(0.5 * float(np.median(u_at)), LEAST_U_PX))
    return np.array(at), np.array(lean), np.array(width), blur, u


def _fit(
    upright: Floats,
    row: float,
    rows: NDArray[np.int_],
    middle: float,
    coarse: CoarseLines,
    blur: float | None,
) -> tuple[float, float, float]:
    """Fit centre (in the middle row), width and blur of one line, or of a part of it, to the levels."""
    reach = int(np.ceil(0.5 * coarse.pitch))
    line = middle + coarse.slope * (rows - row)
    columns = np.rint(line).astype(int)[:, None] + np.arange(-reach, reach + 1)
    inside = (columns >= 0) & (columns < upright.shape[1])
    t = (columns - line[:, None])[inside]
    level = upright[np.broadcast_to(rows[:, None], columns.shape)[inside], columns[inside]]
    use = np.abs(t) <= 0.5 * coarse.pitch
    t, level, weight = _binned(t[use], level[use])

    def residual(p: Floats) -> Floats:
        sigma = blur if blur is not None else float(np.exp(p[2]))
        half = 0.5 * float(np.exp(p[1]))
        stripe = _step(t - p[0] + half, sigma) - _step(t - p[0] - half, sigma)
        design = np.stack([np.ones_like(t), stripe, t], axis=1) * weight[:, None]
        solved, *_ = np.linalg.lstsq(design, level * weight, rcond=None)
        return np.asarray(level * weight - design @ solved)

    start = [0.0, np.log(max(coarse.width, 0.5)), np.log(1.0)]
    size = 3 if blur is None else 2
    low, high = [-0.5 * coarse.pitch, np.log(0.1), np.log(0.2)], [0.5 * coarse.pitch, np.log(coarse.pitch), np.log(8.0)]
    start[1] = float(np.clip(start[1], low[1] + 1e-3, high[1] - 1e-3))
    found = least_squares(residual, start[:size], bounds=(low[:size], high[:size]), max_nfev=40).x
    return middle + float(found[0]), float(np.exp(found[1])), blur if blur is not None else float(np.exp(found[2]))


def _binned(t: Floats, level: Floats) -> tuple[Floats, Floats, Floats]:
    """Means of positions and levels in narrow bins, and the square root of the number of pixels in each bin.

    The bins are narrow compared with the blur of any edge.
    """
    place = np.floor((t - t.min()) / BIN_PX).astype(int)
    count = np.bincount(place)
    full = count > 0
    number = count[full]
    return (
        np.bincount(place, t)[full] / number,
        np.bincount(place, level)[full] / number,
        np.sqrt(number.astype(np.float64)),
    )


def _step(t: Floats, sigma: float) -> Floats:
    """A Gaussian-blurred unit step, averaged over a pixel."""
    upper, lower = (t + 0.5) / sigma, (t - 0.5) / sigma
    density = (np.exp(-0.5 * upper**2) - np.exp(-0.5 * lower**2)) / np.sqrt(2.0 * np.pi)
    return np.asarray(sigma * (upper * ndtr(upper) - lower * ndtr(lower) + density))
