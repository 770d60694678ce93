"""Maximum-likelihood position of a blurred edge by linear filters, one for every blur and sub-pixel offset.

If the position of an edge is known approximately, the best corrections of its position, contrast and blur under white
noise are linear functions of the grey levels. The coefficients of the linear functions are the rows of the
pseudo-inverse of the edge model (Kay, Estimation Theory, 1993, section 8.9). The filters depend only on the blur, the
offset and the length of the window, so that they are computed once; a Gauss-Newton step for a whole outline is then a
table look-up and a scalar product.

Bias of an edge fitted along a slanted line on a curved, blurred outline.
"""

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from fingervision.domain.loops import loop

Floats = NDArray[np.float64]
Ints = NDArray[np.int_]

# Half-lengths of the window (pixels). The smallest one is used that contains three standard deviations of the blur plus
# 2.5 pixels.
REACHES_PX = (6, 8, 11, 15, 21, 28)
REACH_SIGMAS, REACH_EXTRA_PX = 3.0, 2.5
SMALLEST_SIGMA_PX = 0.15
# Ratio of the blurs of neighbouring rows of the table. A blur error of half a step does not affect the position,
# because a step is antisymmetric and the effect of the blur error symmetric; the contrast changes by less than 0.1 %.
SIGMA_RATIO = 1.03
# Spacing of the offsets in the table, at which the error of the linear step is below 1e-4 px, and largest offset.
OFFSET_STEP_PX, LARGEST_OFFSET_PX = 0.125, 2.5
# Largest change of position and of blur in a step, within which the filters are nearly linear; least contrast of an
# edge (grey levels).
LARGEST_MOVE_PX, LARGEST_WIDENING_PX, LEAST_CONTRAST = 1.0, 0.3, 1e-3
# Limits of the fitted blur (pixels); the status `blurred` begins at 5.
SMALLEST_BLUR_PX, LARGEST_BLUR_PX = 0.2, 8.0
# Variance of the position within a pixel (a uniform distribution of width 1), which adds to the squared blur.
PIXEL_VARIANCE = 1.0 / 12.0
# Least blur that can be resolved. With a smaller blur, nearly the whole step is within one pixel, which determines
# either the position or the blur: sharp rectangles at all sub-pixel positions are fitted with blurs from 0.2 to 0.42
# px.
LEAST_RESOLVED_BLUR_PX = 0.45

_row = loop("edge_filters_row")
_column = loop("edge_filters_column")
_look = loop("edge_filters_look")
_mean_square = loop("edge_filters_mean_square")


@dataclass(frozen=True, slots=True, eq=False)
class EdgeFilters:
    """Filters for one length of the fit window; arrays of shape (blurs, offsets, pixels) unless stated otherwise.

    Parameters
    ----------
    reach_px : int
        Half-length of the window.
    sigmas_px : ndarray of float, shape (blurs,)
        Gaussian sigma along the line.
    offsets_px : ndarray of float, shape (offsets,)
        Position of the edge, from the window's middle outwards.
    contrast, shift, blur : ndarray of float
        Filters: the scalar product with the grey levels gives the contrast, the contrast times the shift of the edge,
        and the contrast times the change of sigma.
    step : ndarray of float
        Blurred step from 0 inside to 1 outside, with its mean subtracted.
    shift_gain : ndarray of float, shape (blurs, offsets)
        Square root of the Fisher information of the position for unit contrast and unit noise, with unknown levels.
    """

    reach_px: int
    sigmas_px: Floats
    offsets_px: Floats
    contrast: Floats
    shift: Floats
    blur: Floats
    step: Floats
    shift_gain: Floats

    def look(self, levels: Floats, lines: "Lines", blur_px: Floats, position_px: Floats) -> "Look":
        """Take one Gauss-Newton step for the position and contrast of every line, and for the blurs of the lines.

        Parameters
        ----------
        levels : ndarray of float, shape (n, pixels)
            Grey levels along each line, from inside to outside.
        lines : Lines
            Properties of the lines.
        blur_px : ndarray of float, shape (blurs,)
            Gaussian sigma of the optics.
        position_px : ndarray of float, shape (n,)
            Present estimate of each edge's position, from the window's middle outwards.
        """
        n = len(levels)
        position, contrast, sigma, blur = np.empty(n), np.empty(n), np.empty(n), np.empty(blur_px.size)
        row, column = np.empty((2, n), dtype=np.int64)
        table = (self.contrast, self.shift, self.blur, self.offsets_px)
        _look(levels, *lines, blur_px, position_px, *table, position, contrast, blur, sigma, row, column)
        return Look(position, contrast, blur, sigma, row, column)

    def middle(self, sigma_px: float) -> tuple[int, int]:
        """Row and column in the table of filters for an edge of a given blur in the centre of the window."""
        return _row(sigma_px, self.sigmas_px.size), _column(0.0)

    def mean_square(self, levels: Floats, look: "Look") -> tuple[Floats, Floats]:
        """Mean squared residual of each line after a look-up, and gain of the position filter; shape (n,) each."""
        mean_square, gain = np.empty((2, len(levels)))
        table = (self.step, self.offsets_px, self.shift_gain)
        _mean_square(levels, look.position, look.contrast, look.row, look.column, *table, mean_square, gain)
        return mean_square, gain


class Lines(NamedTuple):
    """Lines of pixels across an outline; several lines may have the same blur.

    Parameters
    ----------
    slope : ndarray of float, shape (n,)
        Change of the edge's position from line to line: a slanted edge is wider along the line.
    weight : ndarray of float, shape (n,)
        Weight of the line; 0 for a line that is not used.
    blur_of_line : ndarray of int, shape (n,)
        Index of the blur that each line has.
    """

    slope: Floats
    weight: Floats
    blur_of_line: Ints


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """Result of one look-up in the table of filters for all edges; arrays of shape (n,) unless stated otherwise.

    Parameters
    ----------
    position : ndarray of float
        Position of each edge from the window's middle outwards (pixels).
    contrast : ndarray of float
        Outside level minus inside level.
    blur : ndarray of float, shape (blurs,)
        Gaussian sigma of the optics (pixels).
    sigma : ndarray of float
        Blur along each line before this look-up.
    row, column : ndarray of int
        Indices of the blur and of the offset of the filters used.
    """

    position: Floats
    contrast: Floats
    blur: Floats
    sigma: Floats
    row: Ints
    column: Ints


def reach_for(sigma_px: float) -> int:
    """Half-length of the fit window (px) that is needed for an edge of a given blur."""
    needed = REACH_SIGMAS * sigma_px + REACH_EXTRA_PX
    return next((reach for reach in REACHES_PX if reach >= needed), REACHES_PX[-1])


def blurred_step(borders: Floats, sigma: Floats) -> tuple[Floats, Floats, Floats]:
    """Pixel integrals of a Gaussian-blurred unit step at zero, and their derivatives by position and sigma.

    Parameters
    ----------
    borders : ndarray of float, shape (..., pixels + 1)
        Borders of the pixels, measured from the edge.
    sigma : ndarray of float, shape (..., 1)
        Standard deviation of the blur.

    Returns
    -------
    step, by_position, by_sigma : ndarray of float, shape (..., pixels)
        Integral over each pixel, its change when the edge moves outwards, and its change when the blur grows.
    """
    q = borders / sigma
    cumulative = ndtr(q)
    density = np.exp(-0.5 * q * q) * (1.0 / np.sqrt(2.0 * np.pi))
    step = np.diff(borders * cumulative + sigma * density, axis=-1)
    return step, -np.diff(cumulative, axis=-1), np.diff(density, axis=-1)


@cache
def edge_filters(reach_px: int) -> EdgeFilters:
    """Filters for a window of `2 reach_px + 1` pixels, for every blur that fits into the window."""
    largest = (reach_px - REACH_EXTRA_PX) / REACH_SIGMAS * np.sqrt(2.0) + 1.0  # a slanted edge is wider along the line
    count = int(np.ceil(np.log(largest / SMALLEST_SIGMA_PX) / np.log(SIGMA_RATIO))) + 1
    sigmas = np.asarray(SMALLEST_SIGMA_PX * SIGMA_RATIO ** np.arange(count), dtype=np.float64)
    offsets = np.arange(-LARGEST_OFFSET_PX, LARGEST_OFFSET_PX + 1e-9, OFFSET_STEP_PX)
    borders = np.arange(-reach_px - 0.5, reach_px + 1.0) - offsets[None, :, None]
    model = np.stack(
        blurred_step(np.broadcast_to(borders, (count, *borders.shape[1:])), sigmas[:, None, None]), axis=-2
    )
    model = model - model.mean(axis=-1, keepdims=True)
    gram = model @ np.swapaxes(model, -1, -2)
    filters = np.linalg.pinv(gram, rcond=1e-10, hermitian=True) @ model
    step, shift = model[..., 0, :], model[..., 1, :]
    ss, st, tt = (step**2).sum(-1), (step * shift).sum(-1), (shift**2).sum(-1)
    gain = np.sqrt(np.maximum(tt - st**2 / np.maximum(ss, 1e-12), 1e-12))
    contrast_filter, shift_filter, blur_filter = (np.ascontiguousarray(filters[..., k, :]) for k in range(3))
    return EdgeFilters(
        reach_px, sigmas, offsets, contrast_filter, shift_filter, blur_filter, np.ascontiguousarray(step), gain
    )


# The constant 1 / (2 sqrt pi).
ROOT = 0.5 / float(np.sqrt(np.pi))


def curvature_gain(slope: Floats, reach_sigmas: Floats) -> Floats:
    """Bias of an edge fitted along a slanted line on a curved outline, relative to the bias of the half-level.

    Along a line that meets a curved edge at a slant of slope m, the distance to the edge is t + kappa m^2 t^2 / (2 (1 +
    m^2)^(1/2)). Projected on the parameters of the fit over a window of w standard deviations, the quadratic term moves
    the position by m^2 c sigma^2 kappa / 2 across the edge, c = (1 / (4 sqrt pi) - 1 / 2w) / (1 / (2 sqrt pi) - 1 /
    2w); the half-level itself is moved by sigma^2 kappa / 2.
    """
    level = 0.5 / np.maximum(reach_sigmas, 2.5)
    return np.asarray(1.0 + slope**2 * (0.5 * ROOT - level) / (ROOT - level))
