"""Lines of a line scale (stage micrometer): position, width and uncertainty of each line.

A line is a stripe with two edges: c + A (step(t - x1) - step(t - x2)), each step blurred by the same Gaussian. Blooming
and the camera's response move the two edges in opposite directions and leave the centre of the line in place, so that
the pitch does not depend on the edge bias. The width of a line does depend on the edge bias; if the true width is
known, the edge bias follows from it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import ndtr

from calib.errors import CalibrationError
from calib.line_search import FEWEST_ROWS, CoarseLines, lines_to_a_pixel

Floats = NDArray[np.float64]
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


@dataclass(frozen=True, slots=True, eq=False)
class ScaleLines:
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
