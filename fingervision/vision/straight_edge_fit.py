"""Straight blurred edges in a picture: maximum-likelihood position and angle from all pixels of a band at once.

The light of one or more nearly parallel straight edges is `c + d s + sum_k A_k S((t - p_k - m_k s) cos_k)`, with `t`
across the edges, `s` along them and `S` the integral over the pixel of a Gaussian-blurred step. Under white noise the
least-squares fit reaches the Cramer-Rao bound of this model (Kay, Estimation Theory, 1993, chapter 8; O'Gorman, IEEE
PAMI 18(7), 1996, doi:10.1109/34.506799 for lines). Nothing is resampled.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Floats = NDArray[np.float64]

# The band reaches so many standard deviations of the blur, and so many pixels more, to either side of an edge, as in
# `calib.edge_spread`: the wider it is, the less the unknown levels cost.
REACH_SIGMAS, REACH_EXTRA_PX = 4.0, 4.0
# Blur is looked for within these limits (pixels), as there; edges beyond 5 px are refused by whoever asks.
SMALLEST_BLUR_PX, LARGEST_BLUR_PX = 0.2, 8.0
# Gauss-Newton: steps are limited to where the model is nearly linear. They shrink quadratically: after one of 0.005 px
# less than 1e-4 px is left.
LARGEST_STEP_PX, LARGEST_TURN, SETTLED_PX, ITERATIONS = 1.0, 0.1, 5e-3, 25
# No edge has less contrast (grey levels); columns that are alike to rounding are told apart by this share.
LEAST_CONTRAST, RIDGE = 1e-3, 1e-9
# What is cut off a step is looked for by the bend that the loss of its upper tenth makes.
CUT = 0.1
# Variance of rounding to whole grey levels: no noise is smaller.
ROUNDING = 1.0 / 12.0
# Residuals are looked at in so many pieces along the edge; a scatter of the pieces' own shifts beyond the 99.9 %
# quantile of its chi-square is roughness or a bend, and widens the uncertainty.
PIECES = 8
CHI_SQUARE_999 = (0.0, 10.83, 13.82, 16.27, 18.47, 20.52, 22.46, 24.32, 26.12)
# A core window of so many sigma sees another position where the profile is not a blurred step; a difference beyond so
# many of its own standard deviations (Hausman, Econometrica 46(6), 1978, doi:10.2307/1913827) is added in square.
CORE_SIGMAS, HAUSMAN = 1.2, 3.0
# Neighbouring pixels' residuals are correlated where this exceeds so many standard errors.
CORRELATED = 3.5
LAGS = ((0, 1), (1, 0), (1, 1), (1, -1), (0, 2), (2, 0))


@dataclass(frozen=True, slots=True)
class Band:
    """Band in which the edges are searched: axes turned by `direction_rad`, counted from a centre.

    Parameters
    ----------
    x_px, y_px : float
        The middle, in the picture's pixels.
    direction_rad : float
        Direction across the edges (the axis t): 0 to the right, pi / 2 downwards. s grows 90 degrees further on.
    length_px : float
        Along the edges, half of it to either side of the middle.
    """

    x_px: float
    y_px: float
    direction_rad: float
    length_px: float


@dataclass(frozen=True, slots=True)
class EdgeStart:
    """Initial estimate of one edge.

    Parameters
    ----------
    position_px : float
        t where s is 0.
    slope : float
        Change of t with s.
    contrast : float or None
        Level beyond less level before; None where nothing is known of it.
    """

    position_px: float
    slope: float = 0.0
    contrast: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class StraightEdges:
    """k edges fitted jointly; arrays of shape (k,).

    Parameters
    ----------
    position_px : ndarray of float, shape (k,)
        t of each edge where s is 0 (the band's own axes).
    slope : ndarray of float, shape (k,)
        Change of t with s.
    covariance : ndarray of float, shape (2 k, 2 k)
        Of all positions, then all slopes; noise, shared noise, roughness and misfit included.
    contrast : ndarray of float, shape (k,)
        Level beyond the edge (larger t) minus level before it, at the middle.
    inside : float
        Level before the first edge.
    blur_px : float
        Gaussian sigma of the optics across the edges, without the pixel.
    noise : float
        Standard deviation of the residuals.
    bend_px : float
        How far the middle of the first edge lies off the chord of its ends.
    least_piece : float
        Smallest contrast among the pieces of the first edge, as a share of its contrast: an edge is there all along.
    pixels : int
        Number of pixels that were fitted.
    lost, u_lost : float
        How much of the first step lies beyond the scale's end, as a share of what is seen, and its standard
        uncertainty; only where it was asked for.
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
    """The pixels do not determine such edges."""


def reach_px(blur_px: float) -> float:
    """Half-width of the band that an edge of this blur needs (pixels)."""
    return REACH_SIGMAS * float(np.hypot(blur_px, ROUNDING**0.5)) + REACH_EXTRA_PX


def blurred_box_step(away: Floats, sigma: float, width: float) -> tuple[Floats, Floats, Floats]:
    """Blurred unit step averaged over a box, and its derivatives with respect to distance and sigma.

    Parameters
    ----------
    away : ndarray of float
        Distance of the box's middle from the edge, positive beyond it.
    sigma, width : float
        Blur, and width of the box (of a pixel, across the edge).
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
        Axes and length.
    starts : tuple of EdgeStart
        First guesses, to within about two sigma.
    blur_px : float
        First guess of the blur.
    shared_pixels : float
        So many pixels count as one, where a codec is known to share its errors.
    cut_off : int
        +1 where the light plateau of the first edge lies at the end of the scale, -1 where the dark one does: how much
        of the step is lost there is then looked for.

    Returns
    -------
    StraightEdges
        Positions and slopes with their covariance.

    Raises
    ------
    NoEdgeFitError
        The band leaves the part of the picture, or its pixels do not determine the edges.
    """
    t, s = _axes(levels.shape, origin_px, band)
    along = np.abs(s) <= 0.5 * band.length_px
    state = _State(np.array([each.position_px for each in starts]), np.array([each.slope for each in starts]), blur_px)
    contrasts = [each.contrast for each in starts if each.contrast is not None]
    state.contrast = np.array(contrasts) if len(contrasts) == len(starts) else None
    fitted_reach, at = 0.0, state.position.copy()
    for _iteration in range(ITERATIONS):
        reach = reach_px(state.blur_px)
        if abs(reach - fitted_reach) > 0.5 or float(np.max(np.abs(state.position - at))) > 0.5:
            fitted_reach, at = reach, state.position.copy()
            mask = along & _near(t, s, at, state.slope, reach)
            rows, columns = np.nonzero(mask)
            tt, ss, seen = t[rows, columns], s[rows, columns], levels[rows, columns]
            if seen.size < 8 * len(starts) + 8:
                raise NoEdgeFitError("too few pixels")
        change = state.step(tt, ss, seen, band)
        if change < SETTLED_PX and abs(reach_px(state.blur_px) - fitted_reach) <= 0.5:
            break
    else:
        raise NoEdgeFitError("the fit does not settle")
    return state.result(tt, ss, seen, band, (rows, columns, levels.shape), shared_pixels, cut_off)


def _axes(shape: tuple[int, ...], origin_px: tuple[int, int], band: Band) -> tuple[Floats, Floats]:
    x = np.arange(shape[1]) + (origin_px[0] - band.x_px)
    y = np.arange(shape[0]) + (origin_px[1] - band.y_px)
    cosine, sine = np.cos(band.direction_rad), np.sin(band.direction_rad)
    t = cosine * x[None, :] + sine * y[:, None]
    s = -sine * x[None, :] + cosine * y[:, None]
    return t, s


def _near(t: Floats, s: Floats, position: Floats, slope: Floats, reach: float) -> NDArray[np.bool_]:
    low = (t - position.min() - slope[np.argmin(position)] * s) >= -reach
    high = (t - position.max() - slope[np.argmax(position)] * s) <= reach
    return np.asarray(low & high)


class _State:
    """Parameters of a fit during the iteration."""

    def __init__(self, position: Floats, slope: Floats, blur_px: float) -> None:
        self.position, self.slope = position.astype(np.float64), slope.astype(np.float64)
        self.blur_px = min(max(blur_px, SMALLEST_BLUR_PX), LARGEST_BLUR_PX)
        self.contrast: Floats | None = None
        self.last: _Solution | None = None

    def columns(self, t: Floats, s: Floats, band: Band) -> tuple[Floats, Floats, Floats]:
        """Linear columns (level, along, steps, steps along), d step / d position of each edge, and d step / d sigma."""
        count = self.position.size
        linear = np.empty((2 + 2 * count, t.size))
        linear[0], linear[1] = 1.0, s
        by_position, by_sigma = np.empty((count, t.size)), np.empty((count, t.size))
        for k in range(count):
            cosine = 1.0 / float(np.hypot(1.0, self.slope[k]))
            normal = band.direction_rad - np.arctan(self.slope[k])
            wide, narrow = sorted((abs(float(np.cos(normal))), abs(float(np.sin(normal)))), reverse=True)
            sigma = float(np.sqrt(self.blur_px**2 + narrow**2 / 12.0))
            step, density, widening = blurred_box_step((t - self.position[k] - self.slope[k] * s) * cosine, sigma, wide)
            linear[2 + k], linear[2 + count + k] = step, step * s
            by_position[k] = -cosine * density
            by_sigma[k] = widening * (self.blur_px / sigma)
        return linear, by_position, by_sigma

    def design(self, t: Floats, s: Floats, band: Band, contrast: Floats) -> Floats:
        """All columns of the design matrix: linear ones, then positions, slopes and blur for these contrasts."""
        linear, by_position, by_sigma = self.columns(t, s, band)
        moved = contrast[:, None] * by_position
        return np.concatenate((linear, moved, moved * s, (contrast @ by_sigma)[None]))

    def step(self, t: Floats, s: Floats, seen: Floats, band: Band) -> float:
        """Make one Gauss-Newton step, and return how far the edge that moved most was moved."""
        count = self.position.size
        if self.contrast is None:
            linear, _, _ = self.columns(t, s, band)
            self.contrast = _Solution(linear, seen).found[2 : 2 + count]
        contrast = self.contrast
        if not np.all(np.abs(contrast) > LEAST_CONTRAST):
            raise NoEdgeFitError("there is no contrast")
        self.last = _Solution(self.design(t, s, band, contrast), seen)
        found = self.last.found
        self.contrast = found[2 : 2 + count]
        ratio = np.clip(contrast / np.where(np.abs(self.contrast) > LEAST_CONTRAST, self.contrast, np.inf), 0.0, 1.0)
        move = np.clip(ratio * found[2 + 2 * count : 2 + 3 * count], -LARGEST_STEP_PX, LARGEST_STEP_PX)
        turn = np.clip(ratio * found[2 + 3 * count : 2 + 4 * count], -LARGEST_TURN, LARGEST_TURN)
        widening = float(np.clip(found[-1], -0.3 * self.blur_px, 0.5 * self.blur_px))
        self.position, self.slope = self.position + move, self.slope + turn
        before = self.blur_px
        self.blur_px = min(max(self.blur_px + widening, SMALLEST_BLUR_PX), LARGEST_BLUR_PX)
        half = 0.5 * float(np.ptp(s))
        return float(max(np.max(np.abs(move)), half * np.max(np.abs(turn)), 0.1 * abs(self.blur_px - before)))

    def result(
        self,
        t: Floats,
        s: Floats,
        seen: Floats,
        band: Band,
        place: "Place",
        shared_pixels: float,
        cut_off: int,
    ) -> StraightEdges:
        """Result and covariance, from the design matrix of the last step, which moved next to nothing."""
        count = self.position.size
        if self.last is None or self.contrast is None:
            raise NoEdgeFitError("nothing was fitted")
        contrast, design, scale, scaled = self.contrast, self.last.design, self.last.scale, self.last.scaled
        try:
            inverse = np.linalg.inv(self.last.normal)
        except np.linalg.LinAlgError:
            raise NoEdgeFitError("the pixels do not determine the edges") from None
        residual = seen - self.last.found @ design
        free = seen.size - design.shape[0]
        variance = max(float(residual @ residual) / max(free, 1), ROUNDING)
        wanted = slice(2 + 2 * count, 2 + 4 * count)
        # Rows of the pseudo-inverse: what each pixel does to each position and slope.
        effect = (inverse[wanted] @ scaled) / scale[wanted, None]
        covariance = variance * (inverse[wanted, wanted] / scale[wanted, None] / scale[None, wanted])
        correlations = _correlations(residual, place)
        shared = [_shared(correlations, effect[j], place) for j in range(2 * count)]
        factor = np.maximum(shared, shared_pixels) * max(_rough(residual, design, s, variance, count), 1.0)
        root = np.sqrt(factor)
        covariance = covariance * root[:, None] * root[None, :]
        self._add_misfit(covariance, t, s, scaled, scale, residual, variance, wanted)
        bend, least = _pieces(design, residual, s, contrast, count)
        return StraightEdges(
            self.position, self.slope, covariance, contrast, float(self.last.found[0]), self.blur_px,
            float(np.sqrt(variance)), bend, least, int(seen.size),
            *(_lost(design, residual, variance, float(contrast[0]), cut_off) if cut_off else (0.0, 0.0)),
        )  # fmt: skip

    def _add_misfit(
        self,
        covariance: Floats,
        t: Floats,
        s: Floats,
        scaled: Floats,
        scale: Floats,
        residual: Floats,
        variance: float,
        wanted: slice,
    ) -> None:
        """Add the misfit of the flanks to the uncertainty where it exceeds the noise."""
        width = CORE_SIGMAS * float(np.hypot(self.blur_px, ROUNDING**0.5)) + 0.5
        weight = np.zeros(t.size)
        for k in range(self.position.size):
            weight += np.exp(-0.5 * ((t - self.position[k] - self.slope[k] * s) / width) ** 2)
        weighted = scaled * weight
        normal = weighted @ scaled.T
        normal[np.diag_indices_from(normal)] *= 1.0 + 1e-9
        try:
            core = np.linalg.inv(normal)
        except np.linalg.LinAlgError:
            return
        change = (core @ (weighted @ residual))[wanted] / scale[wanted]
        spread = variance * np.diag(core @ (weighted @ weighted.T) @ core)[wanted] / scale[wanted] ** 2
        count = self.position.size
        for j in range(count):
            excess = max(float(spread[j]) - float(covariance[j, j]), 0.25 * float(covariance[j, j]))
            if change[j] ** 2 > HAUSMAN**2 * excess:
                covariance[j, j] += change[j] ** 2


class _Solution:
    """Least squares of scaled columns."""

    def __init__(self, design: Floats, seen: Floats) -> None:
        self.design = design
        self.scale = np.sqrt(np.einsum("ij,ij->i", design, design))
        self.scale[self.scale == 0.0] = 1.0
        self.scaled = design / self.scale[:, None]
        self.normal = self.scaled @ self.scaled.T
        self.normal[np.diag_indices_from(self.normal)] += RIDGE
        self.found = np.asarray(np.linalg.solve(self.normal, self.scaled @ seen) / self.scale)


Place = tuple[NDArray[np.intp], NDArray[np.intp], tuple[int, ...]]
Correlations = tuple[tuple[int, int, float], ...]


def _correlations(residual: Floats, place: Place) -> Correlations:
    """Lags at which neighbouring pixels' residuals are significantly correlated, and their correlations."""
    rows, columns, shape = place
    grid = np.zeros(shape)
    grid[rows, columns] = residual
    power, limit = float(residual @ residual), CORRELATED / np.sqrt(residual.size)
    found = []
    for down, right in LAGS:
        here, there = _lagged(grid, down, right)
        correlation = float(np.vdot(here, there)) / power
        if abs(correlation) > limit:
            found.append((down, right, correlation))
    return tuple(found)


def _shared(correlations: Correlations, effect: Floats, place: Place) -> float:
    """Ratio of the variance of a sum weighted by `effect` to its value for independent pixels."""
    if not correlations:
        return 1.0
    rows, columns, shape = place
    weight = np.zeros(shape)
    weight[rows, columns] = effect
    alone, total = float(effect @ effect), 1.0
    for down, right, correlation in correlations:
        here, there = _lagged(weight, down, right)
        total += 2.0 * correlation * float(np.vdot(here, there)) / alone
    return max(total, 1.0)


def _lagged(grid: Floats, down: int, right: int) -> tuple[Floats, Floats]:
    height, width = grid.shape
    if right >= 0:
        return grid[: height - down, : width - right], grid[down:, right:]
    return grid[: height - down, -right:], grid[down:, : width + right]


def _lost(design: Floats, residual: Floats, variance: float, contrast: float, cut_off: int) -> tuple[float, float]:
    """Estimate the share of the first edge that clipping removed, from the bend of its profile."""
    step = design[2] if contrast * cut_off > 0.0 else 1.0 - design[2]
    bend = cut_off * (np.minimum((1.0 + CUT) * step, 1.0) - step)
    scaled = design / np.maximum(np.sqrt(np.einsum("ij,ij->i", design, design)), 1e-12)[:, None]
    normal = scaled @ scaled.T
    normal[np.diag_indices_from(normal)] += RIDGE
    own = bend - np.linalg.solve(normal, scaled @ bend) @ scaled
    power = max(float(own @ own), 1e-12)
    return CUT * float(own @ residual) / power / abs(contrast), CUT * float(np.sqrt(variance / power)) / abs(contrast)


def _rough(residual: Floats, design: Floats, s: Floats, variance: float, count: int) -> float:
    """How much more the pieces of an edge scatter than their noise explains; 1 where chance would explain it."""
    half = float(np.abs(s).max()) + 1e-9
    piece = np.minimum(((s / half + 1.0) * 0.5 * PIECES).astype(np.intp), PIECES - 1)
    worst = 1.0
    for k in range(count):
        by_position = design[2 + 2 * count + k]
        info = np.bincount(piece, by_position**2, PIECES)
        score = np.bincount(piece, by_position * residual, PIECES)
        chi_square = float(np.sum(score**2 / np.maximum(info, 1e-12))) / variance
        if chi_square > CHI_SQUARE_999[PIECES]:
            worst = max(worst, chi_square / (PIECES - 2))
    return worst


def _pieces(design: Floats, residual: Floats, s: Floats, contrast: Floats, count: int) -> tuple[float, float]:
    """Bend of the first edge, and the least contrast among its pieces as a fraction of the edge's contrast."""
    half = float(np.abs(s).max()) + 1e-9
    piece = np.minimum(((s / half + 1.0) * 0.5 * PIECES).astype(np.intp), PIECES - 1)
    by_position = design[2 + 2 * count]
    info = np.maximum(np.bincount(piece, by_position**2, PIECES), 1e-12)
    shift = np.bincount(piece, by_position * residual, PIECES) / info
    middle = (np.arange(PIECES) + 0.5) / PIECES * 2.0 - 1.0
    weight = info / info.sum()
    square = middle**2 - weight @ middle**2
    bend = float((weight * square) @ shift) / max(float(weight @ square**2), 1e-12)
    step = design[2]
    mean = np.bincount(piece, step, PIECES) / np.maximum(np.bincount(piece, minlength=PIECES), 1)
    centred = step - mean[piece]
    power = np.maximum(np.bincount(piece, centred**2, PIECES), 1e-12)
    more = np.bincount(piece, centred * residual, PIECES) / power
    own = contrast[0] + more
    return abs(bend), float(np.min(own / contrast[0]))
