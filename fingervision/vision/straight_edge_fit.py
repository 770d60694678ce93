"""Straight blurred edges in a picture: maximum-likelihood position and angle from all pixels of a band at once.

The light of one or more nearly parallel straight edges is `c + d s + sum_k A_k S((t - p_k - m_k s) cos_k)`, with `t`
across the edges, `s` along them and `S` the integral over the pixel of a Gaussian-blurred step. Under white noise the
least-squares fit reaches the Cramer-Rao bound (Kay, Estimation Theory, 1993, chapter 8; O'Gorman, IEEE PAMI 18(7),
1996, doi:10.1109/34.506799 for lines). The picture is not resampled.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from fingervision.domain.loops import loop

Floats = NDArray[np.float64]

# Extent of the band on either side of an edge: this multiple of the blur plus these pixels, as in `calib.edge_spread`.
# In a wider band, the unknown levels contribute less to the uncertainty.
REACH_SIGMAS, REACH_EXTRA_PX = 4.0, 4.0
# Limits of the fitted blur (pixels); the calling functions refuse edges with a blur above 5 px.
SMALLEST_BLUR_PX, LARGEST_BLUR_PX = 0.2, 8.0
# Largest steps of the Gauss-Newton iteration (pixels, slope), within which the model is nearly linear; step at which
# the iteration ends (pixels), with a remaining error below 1e-4 px; largest number of steps.
LARGEST_STEP_PX, LARGEST_TURN, SETTLED_PX, ITERATIONS = 1.0, 0.1, 5e-3, 25
# Least contrast of an edge (grey levels), and relative regularisation for columns that are equal within rounding.
LEAST_CONTRAST, RIDGE = 1e-3, 1e-9
# Prior widths of slopes of the light across the edges, in standard deviations of their least-squares estimates.
RAMP_WIDTHS = (0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
# Lost share of a step whose effect on the profile is used to detect clipping.
CUT = 0.1
# Variance of rounding to whole grey levels, the least noise.
ROUNDING = 1.0 / 12.0
# Number of pieces along the edge in which residuals are examined; a scatter of the pieces' shifts beyond the 99.9 %
# quantile of chi-square means roughness or a bend, and increases the uncertainty.
PIECES = 8
CHI_SQUARE_999 = (0.0, 10.83, 13.82, 16.27, 18.47, 20.52, 22.46, 24.32, 26.12)
# Half width of a core window (in sigma), whose fitted position differs if the profile is not a blurred step; a
# difference beyond this number of its standard deviations (Hausman, Econometrica 46(6), 1978, doi:10.2307/1913827) is
# added to the uncertainty in quadrature.
CORE_SIGMAS, HAUSMAN = 1.2, 3.0
# Number of standard errors above which the correlation of neighbouring pixels' residuals is significant.
CORRELATED = 3.5
LAGS = ((0, 1), (1, 0), (1, 1), (1, -1), (0, 2), (2, 0))
# Largest number of edges that are fitted together; a pair with its neighbours has four.
MOST_EDGES = 6
# Reasons why no edges were fitted, by the return code of `straight_edge_fit.c`.
WHY_NOT = (
    "", "the zone has too few pixels", "the zone has no contrast", "the fit does not converge", "the pixels do not "
    "determine the edges"
)  # fmt: skip

_edges = loop("straight_edge_fit_edges")


@dataclass(frozen=True, slots=True)
class Band:
    """Band of pixels in which the edges are searched, with axes t (across the edges) and s (along them) from a centre.

    Parameters
    ----------
    x_px, y_px : float
        Centre of the band, in the picture's pixels.
    direction_rad : float
        Direction of the axis t across the edges: 0 to the right, pi / 2 downwards. The axis s is turned by 90 degrees
        from t, in the same sense.
    length_px : float
        Length of the band along the edges, half of it on either side of the centre.
    """

    x_px: float
    y_px: float
    direction_rad: float
    length_px: float


@dataclass(frozen=True, slots=True)
class EdgeStart:
    """Initial estimate of one straight edge.

    Parameters
    ----------
    position_px : float
        Coordinate t of the edge at s = 0.
    slope : float
        Change of t per unit of s.
    contrast : float or None
        Level beyond the edge minus level before it; None if not known.
    """

    position_px: float
    slope: float = 0.0
    contrast: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class StraightEdges:
    """Straight edges fitted jointly; k is the number of edges.

    Parameters
    ----------
    position_px : ndarray of float, shape (k,)
        Coordinate t of each edge at s = 0, in the band's own axes.
    slope : ndarray of float, shape (k,)
        Change of t per unit of s.
    covariance : ndarray of float, shape (2 k, 2 k)
        Covariance of all positions, then all slopes; it includes noise, common noise, roughness and misfit.
    contrast : ndarray of float, shape (k,)
        Level beyond the edge (larger t) minus the level before it, at the middle of the band.
    inside : float
        Level before the first edge.
    blur_px : float
        Gaussian sigma of the optics across the edges, without the pixel's width.
    noise : float
        Standard deviation of the residuals.
    bend_px : float
        Distance of the middle of the first edge from the chord of its ends.
    least_piece : float
        Smallest contrast among the pieces of the first edge, as a share of its contrast: near 1 if there is an edge
        over the whole length.
    pixels : int
        Number of fitted pixels.
    lost, u_lost : float
        Part of the first step that lies beyond the end of the scale, as a share of the visible part, and its standard
        uncertainty; only computed on request (`cut_off`).
    """

    position_px: Floats
    slope: Floats
    covariance: Floats
    contrast: Floats
    inside: float
    blur_px: float
    noise: float
    bend_px: float
    least_piece: float
    pixels: int
    lost: float = 0.0
    u_lost: float = 0.0


class NoEdgeFitError(ValueError):
    """The pixels do not determine the requested edges."""


def reach_px(blur_px: float) -> float:
    """Half-width (px) of the band that is needed for an edge of a given blur."""
    return REACH_SIGMAS * float(np.hypot(blur_px, ROUNDING**0.5)) + REACH_EXTRA_PX


def blurred_box_step(away: Floats, sigma: float, width: float) -> tuple[Floats, Floats, Floats]:
    """Blurred unit step averaged over a box, and its derivatives by distance and sigma.

    Parameters
    ----------
    away : ndarray of float
        Distance of the box's middle from the edge, positive beyond it.
    sigma, width : float
        Blur, and width of the box (that of a pixel, measured across the edge).
    """
    upper, lower = (away + 0.5 * width) / sigma, (away - 0.5 * width) / sigma
    n_upper, n_lower = ndtr(upper), ndtr(lower)
    root = 0.3989422804014327 / width
    p_upper, p_lower = root * np.exp(-0.5 * upper * upper), root * np.exp(-0.5 * lower * lower)
    by_sigma = p_upper - p_lower
    step = (sigma / width) * (upper * n_upper - lower * n_lower) + sigma * by_sigma
    return step, (n_upper - n_lower) / width, by_sigma


def fit_straight_edges(
    levels: Floats,
    origin_px: tuple[int, int],
    band: Band,
    starts: tuple[EdgeStart, ...],
    blur_px: float = 1.0,
    shared_pixels: float = 1.0,
    cut_off: int = 0,
) -> StraightEdges:
    """Fit straight blurred edges that share one blur.

    Parameters
    ----------
    levels : ndarray of float, shape (height, width)
        Light in a part of the picture.
    origin_px : (int, int)
        Column and row of the part's first pixel in the picture.
    band : Band
        Axes and length of the band.
    starts : tuple of EdgeStart
        Initial estimates of the edges, accurate to about two sigma.
    blur_px : float
        Initial estimate of the blur.
    shared_pixels : float
        Number of neighbouring pixels that share an error (from a codec) and count as one pixel.
    cut_off : int
        +1 if the lighter plateau of the first edge lies at the end of the scale, -1 if the darker one does: the clipped
        part of the step is then estimated too. 0 otherwise.

    Returns
    -------
    StraightEdges
        Positions and slopes with their covariance.

    Raises
    ------
    NoEdgeFitError
        If the band leaves the part of the picture, or the pixels do not determine the edges.
    """
    known = all(each.contrast is not None for each in starts)
    count = len(starts)
    if not 0 < count <= MOST_EDGES:
        raise NoEdgeFitError(f"between 1 and {MOST_EDGES} edges can be fitted together, but {count} were requested")
    guesses = [(each.position_px, each.slope, each.contrast or 0.0) for each in starts]
    state = np.ascontiguousarray(np.array(guesses).T)
    covariance, told = np.empty((2 * count, 2 * count)), np.empty(7)
    why, pixels = _edges(
        np.ascontiguousarray(levels, dtype=np.float64), origin_px[0] - band.x_px, origin_px[1] - band.y_px,
        band.direction_rad, band.length_px, blur_px, shared_pixels, cut_off, known, state, covariance, told,
    )  # fmt: skip
    if why:
        raise NoEdgeFitError(WHY_NOT[why])
    inside, blur, noise, bend, least, lost, u_lost = told.tolist()
    return StraightEdges(
        state[0], state[1], covariance, state[2], inside, blur, noise, bend, least, pixels, lost, u_lost
    )
