"""Fit of the edge spread function: position of a blurred step in every row of pixels across an edge.

Each row contains one edge: a step between two levels specific to the row, blurred by a Gaussian and integrated over the
pixel. The blur is the same for all rows. The position is the maximum-likelihood estimate under white noise, so that its
variance is the Cramer-Rao bound (Kakarala & Hero, IEEE PAMI 14(7), 1992, 769-773). Grey levels are never resampled or
smoothed.
"""

from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from calib.errors import CalibrationError

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Half width of the first window about the coarse edge (pixels), which suffices for the largest blur that can be
# measured.
FIRST_REACH_PX = 20
# Half width of the fit's window: this multiple of the blur plus these pixels. Uneven light within the window displaces
# both edges of a pair in the same direction; the error of their distance is 0.002 px for a change of light of 40 %
# across the picture.
REACH_SIGMAS, REACH_EXTRA_PX = 4.0, 4.0
# Limits of the fitted blur (pixels).
SMALLEST_BLUR_PX, LARGEST_BLUR_PX = 0.15, 8.0
# Largest number of Gauss-Newton steps. The iteration ends when this share of the rows changes by less than the
# tolerance (pixels); rows without an edge do not converge.
STEPS, SETTLED_PX, SETTLED_ROWS = 12, 1e-6, 0.9
# Number of parameters of each row: two levels and the position.
OWN_PARAMETERS = 3
# Asymmetry above which a flank counts as clipped. With the positions t10, t50 and t90 at 10, 50 and 90 % of the step,
# (2 t50 - t10 - t90) / (t90 - t10) is 0 for a Gaussian, and 0.09 if the sensor clips the upper tenth of the step.
CLIPPED_ASYMMETRY = 0.08


@dataclass(frozen=True, slots=True, eq=False)
class CoarseEdge:
    """A straight edge known to one or two pixels: x = at_px + slope * row.

    Parameters
    ----------
    at_px : float
        Column of the edge at row 0.
    slope : float
        Columns per row; at most 1 in absolute value.
    rising : bool
        Whether the level rises with x.
    """

    at_px: float
    slope: float
    rising: bool

    def x_px(self, rows: Ints | Floats) -> Floats:
        """Column of the edge in each row."""
        return np.asarray(self.at_px + self.slope * rows)


@dataclass(frozen=True, slots=True, eq=False)
class EdgeRows:
    """Positions of one edge, row by row; all arrays have length n.

    Parameters
    ----------
    rows : ndarray of int
        Row numbers.
    x_px : ndarray
        Column at which the edge crosses the middle of the row.
    u_x_px : ndarray
        Standard uncertainty from the noise, whose variance is the same in all rows.
    contrast : ndarray
        Step in grey levels; positive if it has the expected sign.
    unexplained : ndarray
        Root-mean-square residual of the fit (grey levels).
    sigma_px : float
        Standard deviation of the blur across the edge, without the pixel's own width along the row.
    blur_px : float
        Standard deviation of the blur across the edge, the pixel's own width included.
    clipped : bool
        Whether the sensor's full scale (or zero) clips the flank.
    """

    rows: Ints
    x_px: Floats
    u_x_px: Floats
    contrast: Floats
    unexplained: Floats
    sigma_px: float
    blur_px: float
    clipped: bool


def fit_edge(grey: Floats, rows: Ints, coarse: CoarseEdge, room_px: float, known: "EdgeRows | None" = None) -> EdgeRows:
    """Fit the edge spread function to all rows at once.

    Parameters
    ----------
    grey : ndarray, shape (height, width)
        Original grey levels.
    rows : ndarray of int, shape (n,)
        Rows to use; rows in which the edge is too near the border are left out.
    coarse : CoarseEdge
        Position of the edge, accurate to two pixels.
    room_px : float
        Largest half width of the window that contains no other structure.
    known : EdgeRows, optional
        Result for the same edge in other rows: its blur is used, so that rows without an edge do not affect the blur.

    Raises
    ------
    CalibrationError
        The strip shows no edge, or is too short to fit one.
    """
    cosine = 1.0 / np.hypot(1.0, coarse.slope)
    profile = (
        _mean_profile(grey, rows, coarse, min(FIRST_REACH_PX, int(room_px)))
        if known is None
        else _Profile(0.0, known.sigma_px, known.clipped)
    )
    reach = min(int(room_px), ceil((REACH_SIGMAS * profile.sigma_px + REACH_EXTRA_PX) / cosine))
    middle = coarse.x_px(rows) + profile.offset_px
    columns = np.rint(middle).astype(np.int_)
    inside = (columns - reach >= 0) & (columns + reach < grey.shape[1])
    if np.count_nonzero(inside) < OWN_PARAMETERS or 2 * reach + 1 <= OWN_PARAMETERS + 1:
        raise CalibrationError(
            "The distance of the edge from the picture's border or from another edge is smaller than its blur: leave "
            "more space around the edge."
        )
    rows, columns, middle = rows[inside], columns[inside], middle[inside]
    window = columns[:, None] + np.arange(-reach, reach + 1)
    levels = grey[rows[:, None], window]
    x_px, sigma_px = middle, profile.sigma_px
    for _ in range(STEPS):
        jacobian, by_sigma, left, _ = _linearised(levels, window - x_px[:, None], cosine, sigma_px)
        normal = np.einsum("nwi,nwj->nij", jacobian, jacobian)
        normal[:, 2, 2] += np.finfo(float).eps
        right = np.einsum("nwi,nwk->nik", jacobian, np.stack([left, by_sigma], axis=2))
        solved = np.linalg.solve(normal, right)
        # Part of the derivative by the blur that the rows' own parameters cannot reproduce (Schur complement).
        own = np.einsum("nwi,ni->nw", jacobian, solved[:, :, 1])
        free = by_sigma - own
        step = float(np.sum(free * left) / max(float(np.sum(free * by_sigma)), np.finfo(float).tiny))
        step = step if known is None else 0.0
        new_sigma = float(np.clip(sigma_px + step, sigma_px / 1.5, sigma_px * 1.5))
        new_sigma = float(np.clip(new_sigma, SMALLEST_BLUR_PX, LARGEST_BLUR_PX))
        change = np.clip(solved[:, 2, 0] - solved[:, 2, 1] * (new_sigma - sigma_px), -1.0, 1.0)
        x_px = np.clip(x_px + change, middle - reach / 2, middle + reach / 2)
        settled = abs(new_sigma - sigma_px) < SETTLED_PX and np.quantile(np.abs(change), SETTLED_ROWS) < SETTLED_PX
        sigma_px = new_sigma
        if settled:
            break
    jacobian, _, left, contrast = _linearised(levels, window - x_px[:, None], cosine, sigma_px)
    normal = np.einsum("nwi,nwj->nij", jacobian, jacobian)
    normal[:, 2, 2] += np.finfo(float).eps
    row_variance = np.sum(left**2, axis=1) / (window.shape[1] - OWN_PARAMETERS)
    # Rounding to 8 bits causes a variance of 1/12 grey level squared, which is the least variance.
    variance = max(float(np.median(row_variance)), 1.0 / 12.0)
    return EdgeRows(
        rows=rows,
        x_px=x_px,
        u_x_px=np.sqrt(variance * np.maximum(np.linalg.inv(normal)[:, 2, 2], 0.0)),
        contrast=contrast if coarse.rising else -contrast,
        unexplained=np.sqrt(row_variance),
        sigma_px=sigma_px,
        blur_px=float(np.hypot(sigma_px, cosine / np.sqrt(12.0))),
        clipped=profile.clipped,
    )


@dataclass(frozen=True, slots=True)
class _Profile:
    offset_px: float
    sigma_px: float
    clipped: bool


def _mean_profile(grey: Floats, rows: Ints, coarse: CoarseEdge, reach: int) -> _Profile:
    # Rows cross a slanted edge at many sub-pixel positions; all pixels, sorted by their distance from the edge, form
    # one finely sampled profile.
    middle = coarse.x_px(rows)
    columns = np.rint(middle).astype(np.int_)
    inside = (columns - reach >= 0) & (columns + reach < grey.shape[1])
    if reach < 2 or not np.any(inside):
        raise CalibrationError(
            "The distance of the edge from the picture's border or from another edge is smaller "
            "than its blur: leave more space around the edge."
        )
    window = columns[inside, None] + np.arange(-reach, reach + 1)
    seen = grey[rows[inside, None], window]
    levels = np.median(seen, axis=0).astype(np.float64)
    away = np.arange(-reach, reach + 1.0) + float(np.mean(columns[inside] - middle[inside]))
    if not coarse.rising:
        levels = -levels
    ends = max(1, reach // 3)
    low, high = float(np.mean(levels[:ends])), float(np.mean(levels[-ends:]))
    if not high > low:
        raise CalibrationError(
            "There is no step of the grey level at the expected position of the edge: check the "
            "picture, its light and its focus."
        )
    share = np.asarray((levels - low) / (high - low), dtype=np.float64)
    t10, t16, t50, t84, t90 = (_crossing(away, share, level) for level in (0.1, 0.1587, 0.5, 0.8413, 0.9))
    cosine = 1.0 / np.hypot(1.0, coarse.slope)
    sigma = float(np.clip((t84 - t16) / 2.0 * cosine, 0.5, LARGEST_BLUR_PX / 1.5))
    # The asymmetry is positive if the upper end of the step is sharper; a clipped plateau has a single level.
    asymmetry = (t50 - t10 - (t90 - t50)) / max(t90 - t10, 1e-9)
    flat = [bool(np.mean(seen[:, columns] == limit) > 0.5) for columns, limit in _ends(ends, coarse.rising, grey)]
    to_light = asymmetry if coarse.rising else -asymmetry
    clipped = (flat[1] and to_light > CLIPPED_ASYMMETRY) or (flat[0] and to_light < -CLIPPED_ASYMMETRY)
    return _Profile(t50, sigma, clipped)


def _ends(width: int, rising: bool, grey: Floats) -> tuple[tuple[slice, float], tuple[slice, float]]:
    left, right = slice(None, width), slice(-width, None)
    dark, light = (left, right) if rising else (right, left)
    return (dark, float(grey.min())), (light, float(grey.max()))


def _crossing(away: Floats, share: Floats, level: float) -> float:
    # Of several crossings, the one nearest to the coarse edge is used.
    above = share >= level
    at = np.flatnonzero(~above[:-1] & above[1:])
    if at.size == 0:
        return 0.0
    start = int(at[np.argmin(np.abs(away[at] + 0.5))])
    return float(away[start] + (level - share[start]) / (share[start + 1] - share[start]))


def _normal(x: Floats) -> Floats:
    return np.asarray(np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi))


def _linearised(levels: Floats, away: Floats, cosine: float, sigma_px: float) -> tuple[Floats, Floats, Floats, Floats]:
    # Share of the right-hand level in a pixel: integral of ndtr over the pixel's width across the edge, `cosine`.
    upper, lower = (away * cosine + cosine / 2) / sigma_px, (away * cosine - cosine / 2) / sigma_px
    n_upper, n_lower, p_upper, p_lower = ndtr(upper), ndtr(lower), _normal(upper), _normal(lower)
    share = sigma_px / cosine * (upper * n_upper + p_upper - lower * n_lower - p_lower)
    # Best two levels of every row for this position and blur.
    mean_share, mean_level = share.mean(axis=1, keepdims=True), levels.mean(axis=1, keepdims=True)
    spread = share - mean_share
    step = np.sum(spread * (levels - mean_level), axis=1) / np.maximum(np.sum(spread**2, axis=1), np.finfo(float).tiny)
    left = levels - mean_level - step[:, None] * spread
    by_x = -step[:, None] * (n_upper - n_lower)
    by_sigma = step[:, None] * (p_upper - p_lower) / cosine
    jacobian = np.stack([np.ones_like(share), share, by_x], axis=2)
    return jacobian, by_sigma, left, step
