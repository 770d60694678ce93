"""Camera response from the shape of straight edges: the evidence for families of tone curves.

The optics and the pixels blur light, and a symmetric blur gives an edge whose profile is odd about the edge in light,
but not in the stored levels. Profiles of several edges are fitted at once, in light, for every family of tone curves;
the evidence of each fit by Laplace's method (MacKay 2003, Information Theory, Inference and Learning Algorithms,
chapter 27) gives the probability of the family. A single family with free parameters would not do: the curve
F(l) = Phi(Phi^-1(l) + d) turns an edge into the same edge displaced by d sigma, so that the smoothness of few families
decides, and the quality of the fit does not.

The blur is a Gaussian convolved with a disc (defocus) and integrated over the pixel, of which a share is spread further
by an exponential to either side: the tails of optics, and coma if they are unlike. The side of a tail is fixed in the
picture, while that of a tone curve is fixed to the dark side of each edge.

A codec by blocks quantises the coefficients of a cosine transform of the levels. The error of a coefficient far larger
than its quantiser's step differs from block to block and averages out, but smaller ones vanish in every block: the
codec filters the levels, symmetrically, and a profile that is odd in light looks more nearly odd in the levels. What
remains of each frequency is therefore unknown, as the optics are.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.special import erfcx, ndtr

from calib.camera_response import CURVES, CameraResponse, standard_response
from calib.edge_profile import EdgeProfile

Floats = NDArray[np.float64]

# Levels (shares of full scale) at which the light of a family is tabulated.
LEVELS = np.linspace(0.0, 1.0, 1025)
# Prior standard deviations: ln of the disc's radius over sigma (about 0), share of the light in each tail, ln of the
# tails' mean length over sigma (about 0), change of the light of each plateau per pixel (share of the contrast),
# difference of an edge's ln sigma from the common one, ln sigma.
U_DISC, U_TAIL, U_LENGTH, U_SLOPE, U_UNLIKE, U_SIGMA = 1.0, 0.2, 0.5, 0.01, 0.03, 1.0
# Radius of the disc over sigma where a fit begins, and width of the edge over sigma with this disc: from a disc the fit
# finds both defocus and sharp optics, but not the other way round.
START_DISC = 1.6
START_WIDENED = (1.0 + 0.25 * START_DISC**2) ** 0.5
# Prior probability of a linear camera; the other families share the rest. Machine vision cameras are linear, others
# are not.
LINEAR_PRIOR = 0.5
# Least probability of a family that counts, and probability from which nothing else is averaged with a standard curve.
LEAST_PROBABILITY, CERTAIN = 1e-3, 0.99
# A profile is used over this multiple of the blur plus these pixels, to either side.
REACH_SIGMAS, REACH_EXTRA_PX = 4.0, 3.0
# Steps of the Levenberg-Marquardt fit, change of the cost below which it has converged, and step of the derivatives.
MOST_STEPS, CONVERGED, STEP = 25, 0.02, 1e-4
# Numbers of unknowns: common to all edges (see `FamilyFit`), and of each edge (position, both plateaus as
# levels, slopes of both, ln of its own sigma over the common one).
SHARED, OWN = 5, 6
# Side of a codec's block (pixels), number of places of an edge in it, and smallest standard deviation of a lost share.
BLOCK_PX, PLACES, LEAST_LOST = 8, 32, 1e-3

# Gauss-Chebyshev quadrature of the second kind, whose weight is the line spread of a uniform disc: places (radii) and
# weights. Seven nodes are exact to 1e-4 of the contrast up to a radius of three sigmas.
_ANGLES = np.arange(1, 8) * np.pi / 8.0
DISC_AT, DISC_W = np.cos(_ANGLES), 0.25 * np.sin(_ANGLES) ** 2
ROOT_2PI = float(np.sqrt(2.0 * np.pi))


@dataclass(frozen=True, slots=True, eq=False)
class Family:
    """A family of tone curves: light over level, with a Gaussian prior of its parameters.

    Parameters
    ----------
    name : str
        Name of the family.
    light : callable
        Light at `LEVELS` for a parameter vector, increasing; its scale is irrelevant.
    mean, u : tuple of float
        Prior means and standard deviations of the parameters.
    """

    name: str
    light: Callable[[Floats], Floats]
    mean: tuple[float, ...] = ()
    u: tuple[float, ...] = ()


def _log(p: Floats) -> Floats:
    steepness = np.exp(p[0])
    return np.asarray(np.expm1(LEVELS * np.log1p(steepness)) / steepness)


def _power_series(p: Floats) -> Floats:
    """Ln light = exp(p0) ln level + p1 (level - 1) + p2 (level^2 - 1)."""
    exponent = np.exp(p[0]) * np.log(np.maximum(LEVELS, 1e-4)) + p[1] * (LEVELS - 1.0) + p[2] * (LEVELS**2 - 1.0)
    return np.asarray(np.exp(np.minimum(exponent, 50.0)) * (LEVELS > 0.0))


def _shoulder(p: Floats) -> Floats:
    """A film's shoulder: light^n = h s / (1 + s - h), with h a power of the level."""
    h, s = LEVELS ** np.exp(p[0]), np.exp(p[1])
    return np.asarray((h * s / (1.0 + s - h)) ** np.exp(-p[2]))


# Exponents of consumer cameras lie around 2 (Grossberg & Nayar 2004, doi:10.1109/TPAMI.2004.88), log profiles span five
# to ten stops, and film curves have shoulders of every height.
FAMILIES = (
    Family("linear", lambda _: LEVELS),
    Family("srgb", lambda _: CURVES["srgb"](LEVELS)),
    Family("bt709", lambda _: CURVES["bt709"](LEVELS)),
    Family("power", lambda p: np.asarray(LEVELS ** np.exp(p[0])), (0.5,), (0.4,)),
    Family("log", _log, (3.5,), (1.2,)),
    Family("power series", _power_series, (0.5, 0.0, 0.0), (0.4, 1.5, 1.0)),
    Family("shoulder", _shoulder, (0.6, 0.7, 0.1), (0.3, 1.2, 0.25)),
)


@dataclass(frozen=True, slots=True, eq=False)
class FamilyFit:
    """Fit of one family to all profiles.

    Parameters
    ----------
    family : Family
        The family.
    parameters, covariance : ndarray of float, shapes (k,) and (k, k)
        Parameters of the tone curve, and their covariance with everything else free.
    shared, u_shared : ndarray of float, shape (SHARED,)
        ln sigma, ln radius of the disc over sigma, shares of the tails towards larger and towards smaller coordinates,
        ln length of the tails over sigma; and their standard uncertainties.
    edges : ndarray of float, shape (SHARED + edges * OWN + bands,)
        All unknowns but the parameters of the tone curve; the last are the shares of each frequency that a codec lost.
    log_evidence : float
        Logarithm of the evidence, up to a constant.
    misfit : ndarray of float, shape (edges,)
        Chi-square of each edge's bins, divided by their number less that of the unknowns of an edge.
    rms_level : float
        Root mean square of the residuals (share of full scale).
    """

    family: Family
    parameters: Floats
    covariance: Floats
    shared: Floats
    u_shared: Floats
    edges: Floats
    log_evidence: float
    misfit: Floats
    rms_level: float

    def response(self, parameters: Floats | None = None) -> CameraResponse:
        """Tone curve of the fit, or of other parameters of its family."""
        if not self.parameters.size:
            return _fixed_response(self.family)
        return _as_response(self.family, self.parameters if parameters is None else parameters)

    def one_sigma(self) -> tuple[CameraResponse, ...]:
        """Tone curves one standard deviation away along each principal axis of the parameters' covariance."""
        if not self.parameters.size:
            return ()
        variance, axes = np.linalg.eigh(self.covariance)
        steps = np.sqrt(np.clip(variance, 0.0, None)) * axes
        return tuple(self.response(self.parameters + step) for step in steps.T)


def fit_families(
    profiles: Sequence[EdgeProfile],
    model_error: float,
    scale: float = 1.0,
    tagged: str = "",
    steps: Sequence[float] = (),
) -> list[FamilyFit]:
    """Fit every family to profiles, the most probable one first.

    Parameters
    ----------
    profiles : sequence of EdgeProfile
        At least one profile.
    model_error : float
        Standard deviation of a bin about the best model, as a share of the contrast.
    scale : float
        Factor of all uncertainties.
    tagged : str
        Standard response that a tag of the file states, which becomes a further family; empty without one.
    steps : sequence of float
        Steps of a codec's quantiser for the eight frequencies across an edge (shares of full scale); empty without one.
    """
    data = _Data.of(profiles, model_error, scale, steps)
    fits: list[FamilyFit] = []
    for family in (*FAMILIES, *_tagged(tagged)):
        # A family with parameters begins where the best one has ended, because edges and optics are the same.
        best = max(fits, key=lambda fit: fit.log_evidence, default=None) if family.mean else None
        fits.append(_fit(family, data, data.start() if best is None else best.edges))
    return sorted(fits, key=lambda fit: -fit.log_evidence)


@cache
def _tagged(name: str) -> tuple[Family, ...]:
    if not name or any(family.name == name for family in FAMILIES):
        return ()
    return (Family(name, lambda _: np.interp(LEVELS, standard_response(name).level, standard_response(name).light)),)


def probabilities(fits: Sequence[FamilyFit]) -> Floats:
    """Posterior probability of each family."""
    prior = np.array(
        [LINEAR_PRIOR if fit.family.name == "linear" else (1.0 - LINEAR_PRIOR) / (len(fits) - 1) for fit in fits]
    )
    evidence = np.array([fit.log_evidence for fit in fits])
    weight = prior * np.exp(evidence - evidence.max())
    return np.asarray(weight / weight.sum())


@dataclass(frozen=True, slots=True, eq=False)
class ResponsePosterior:
    """Response that edges show, and what they leave open.

    Parameters
    ----------
    curve : CameraResponse
        Mean curve of the families; a standard one if it is practically certain, or the linear one if it is the most
        probable.
    others : tuple of (CameraResponse, float)
        Other curves, each with the weight of the squared displacement of an edge in the variance of its position.
    """

    curve: CameraResponse
    others: tuple[tuple[CameraResponse, float], ...]

    @classmethod
    def of(cls, fits: Sequence[FamilyFit]) -> "ResponsePosterior":
        """Average over families, and over the parameters of each."""
        likely = [(fit, float(p)) for fit, p in zip(fits, probabilities(fits), strict=True) if p > LEAST_PROBABILITY]
        first, p_first = max(likely, key=lambda each: each[1])
        if not first.parameters.size and (first.family.name == "linear" or p_first > CERTAIN):
            curve = first.response()
        else:
            curve = curve_response(
                first.family.name,
                np.sum(
                    [p * np.interp(LEVELS, r.level, r.light) for fit, p in likely for r in (fit.response(),)], axis=0
                ),
            )
        others = [(fit.response(), p) for fit, p in likely if fit.response() is not curve]
        return cls(curve, (*others, *((other, p) for fit, p in likely for other in fit.one_sigma())))


def _light(response: CameraResponse) -> Floats:
    return np.asarray(np.interp(LEVELS, response.level, response.light))


@lru_cache(maxsize=32)
def _fixed_response(family: Family) -> CameraResponse:
    return standard_response(family.name)


def _as_response(family: Family, parameters: Floats) -> CameraResponse:
    return curve_response(family.name, _table(family, parameters))


def curve_response(name: str, light: Floats) -> CameraResponse:
    """Camera response of light tabulated at `LEVELS`."""
    light = (light - light[0]) / (light[-1] - light[0])
    light = np.maximum.accumulate(light) + 1e-9 * LEVELS
    return CameraResponse(name, LEVELS, light / light[-1])


def _table(family: Family, parameters: Floats) -> Floats:
    light = family.light(parameters)
    light = np.maximum.accumulate(light / light[-1])
    return np.asarray(light + 1e-7 * LEVELS)


@dataclass(frozen=True, slots=True, eq=False)
class _Data:
    """Bins of all profiles in one array each."""

    away: Floats
    level: Floats
    u: Floats
    edge: NDArray[np.intp]
    side: Floats
    ends: Floats
    sigma: float
    bands: Floats
    u_lost: Floats

    @classmethod
    def of(cls, profiles: Sequence[EdgeProfile], model_error: float, scale: float, steps: Sequence[float]) -> "_Data":
        sigma = float(np.median([_width(profile) for profile in profiles]))
        reach = REACH_SIGMAS * sigma + REACH_EXTRA_PX
        away, level, u, edge = [], [], [], []
        for k, profile in enumerate(profiles):
            near = np.abs(profile.away_px) < reach
            away.append(profile.away_px[near])
            level.append(profile.level[near])
            u.append(scale * np.hypot(profile.u_level[near], model_error * profile.contrast))
            edge.append(np.full(away[-1].size, k))
        return cls(
            np.concatenate(away),
            np.concatenate(level),
            np.concatenate(u),
            np.concatenate(edge),
            np.array([profile.side for profile in profiles]),
            np.array([profile.ends for profile in profiles]),
            sigma,
            _bands(away, len(steps)),
            _u_lost(sigma, float(np.median([profile.contrast for profile in profiles])), np.array(steps)),
        )

    def start(self) -> Floats:
        own = np.zeros((len(self.ends), OWN))
        own[:, 1:3] = self.ends
        optics = [np.log(self.sigma / START_WIDENED), np.log(START_DISC), 0.0, 0.0, 0.0]
        return np.concatenate([optics, own.ravel(), np.zeros(len(self.bands))])


def _cosines() -> Floats:
    """Orthonormal basis of the discrete cosine transform of a block's pixels, one frequency a row."""
    at = np.arange(BLOCK_PX)
    basis = np.sqrt(2.0 / BLOCK_PX) * np.cos(np.pi / BLOCK_PX * np.outer(at, at + 0.5))
    basis[0] /= np.sqrt(2.0)
    return np.asarray(basis)


def _moved(x: Floats, way_px: float) -> Floats:
    """Matrix that takes values at the increasing distances x to values at x + `way_px`, by linear interpolation."""
    at = np.clip(x + way_px, x[0], x[-1])
    before = np.clip(np.searchsorted(x, at) - 1, 0, x.size - 2)
    share, rows = (at - x[before]) / (x[before + 1] - x[before]), np.arange(x.size)
    matrix = np.zeros((x.size, x.size))
    matrix[rows, before], matrix[rows, before + 1] = 1.0 - share, share
    return matrix


def _bands(away: Sequence[Floats], count: int) -> Floats:
    """Matrices that take levels to their part of each frequency but the mean, averaged over all places of blocks.

    The mean over all places of the projection on a vector of a basis is the convolution with its autocorrelation,
    divided by the number of places.
    """
    if not count:
        return np.zeros((0, 0, 0))
    kernels = np.array([np.correlate(basis, basis, "full") for basis in _cosines()[1:]]) / BLOCK_PX
    ways = range(1 - BLOCK_PX, BLOCK_PX)
    edges = [np.tensordot(kernels, np.array([_moved(x, way) for way in ways]), 1) for x in away]
    return np.array([block_diag(*(edge[k] for edge in edges)) for k in range(len(kernels))])


def _u_lost(sigma: float, contrast: float, steps: Floats) -> Floats:
    """Prior standard deviations of the lost share of each frequency but the mean.

    A coefficient below half of a step vanishes, and the error of one above it is no fixed share of it.
    """
    if not steps.size:
        return np.zeros(0)
    places = np.arange(BLOCK_PX) - np.linspace(0.0, BLOCK_PX, PLACES, endpoint=False)[:, None]
    # The same profile in each of a block's rows makes its coefficients larger by the square root of their number.
    coefficients = np.sqrt(BLOCK_PX) * contrast * ndtr(places / sigma) @ _cosines().T
    size = np.sqrt(np.mean(coefficients**2, axis=0))
    return np.asarray(np.maximum(1.0 / (1.0 + (2.0 * size / steps) ** 2), LEAST_LOST)[1:])


def _width(profile: EdgeProfile) -> float:
    """Sigma of the edge from its steepest place: contrast / (sqrt(2 pi) slope)."""
    slope = np.gradient(profile.level, profile.away_px)
    steepest = float(np.median(np.sort(slope)[-3:]))
    return max(profile.contrast / (ROOT_2PI * max(steepest, 1e-9)), 0.5)


def _fit(family: Family, data: _Data, start: Floats) -> FamilyFit:
    """Levenberg-Marquardt fit, and Laplace's evidence at its result."""
    k, edges = len(family.mean), len(data.ends)
    unknowns = np.concatenate([family.mean, start])
    prior_mean, prior_u = _priors(family, data)
    precision = np.where(np.isfinite(prior_u), prior_u**-2.0, 0.0)
    damping, residual = 1e-2, _residuals(family, data, unknowns[None])[0]
    cost = _cost(residual, unknowns, prior_mean, precision)
    hessian = np.eye(unknowns.size)
    for _step in range(MOST_STEPS):
        jacobian = _jacobian(family, data, unknowns, residual)
        gradient = jacobian.T @ residual + precision * (unknowns - prior_mean)
        hessian = jacobian.T @ jacobian + np.diag(precision + 1e-9)
        gained = 0.0
        while damping < 1e6:
            step = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), -gradient)
            tried = unknowns + step
            left = _residuals(family, data, tried[None])[0]
            tried_cost = _cost(left, tried, prior_mean, precision)
            if tried_cost < cost:
                gained, unknowns, residual, cost = cost - tried_cost, tried, left, tried_cost
                damping = max(0.1 * damping, 1e-9)
                break
            damping *= 10.0
        if gained < CONVERGED:
            break
    covariance = np.asarray(np.linalg.pinv(hessian), dtype=np.float64)
    evidence = -cost - 0.5 * float(np.linalg.slogdet(hessian)[1]) - float(np.sum(np.log(family.u)))
    count = np.bincount(data.edge, minlength=edges)
    chi = np.bincount(data.edge, residual**2, minlength=edges)
    return FamilyFit(
        family,
        unknowns[:k],
        covariance[:k, :k],
        unknowns[k : k + SHARED],
        np.sqrt(np.diag(covariance)[k : k + SHARED]),
        unknowns[k:],
        evidence,
        chi / np.maximum(count - OWN, 1).astype(np.float64),
        float(np.sqrt(np.mean((residual * data.u) ** 2))),
    )


def _priors(family: Family, data: _Data) -> tuple[Floats, Floats]:
    """Means and standard deviations of all unknowns; infinite for the position and the plateaus."""
    own = np.array([np.inf, np.inf, np.inf, U_SLOPE, U_SLOPE, U_UNLIKE])
    edges, bands = len(data.ends), len(data.bands)
    shared_u = np.array([U_SIGMA, U_DISC, U_TAIL, U_TAIL, U_LENGTH])
    mean = np.concatenate([family.mean, [np.log(data.sigma), 0.0, 0.0, 0.0, 0.0], np.zeros(OWN * edges + bands)])
    return mean, np.concatenate([family.u, shared_u, np.tile(own, edges), data.u_lost])


def _cost(residual: Floats, unknowns: Floats, mean: Floats, precision: Floats) -> float:
    return float(0.5 * (residual @ residual + precision @ (unknowns - mean) ** 2))


def _jacobian(family: Family, data: _Data, unknowns: Floats, residual: Floats) -> Floats:
    """Derivatives of the residuals; an unknown of one edge moves that edge alone, so that all edges move at once."""
    common, edges = len(family.mean) + SHARED, len(data.ends)
    own_end = common + OWN * edges
    moved = np.repeat(unknowns[None], common + OWN + len(data.bands), axis=0)
    moved[np.arange(common), np.arange(common)] += STEP
    for j in range(OWN):
        moved[common + j, common + j : own_end : OWN] += STEP
    lost = np.arange(len(data.bands))
    moved[common + OWN + lost, own_end + lost] += STEP
    change = (_residuals(family, data, moved) - residual) / STEP
    jacobian = np.zeros((residual.size, unknowns.size))
    jacobian[:, :common], jacobian[:, own_end:] = change[:common].T, change[common + OWN :].T
    for e in range(edges):
        mine = data.edge == e
        jacobian[mine, common + OWN * e : common + OWN * (e + 1)] = change[common : common + OWN, mine].T
    return jacobian


def _residuals(family: Family, data: _Data, sets: Floats) -> Floats:
    """Measured minus modelled level of every bin, in its standard uncertainties, for each set of unknowns."""
    k, edges = len(family.mean), len(data.ends)
    own_end = k + SHARED + OWN * edges
    own = sets[:, k + SHARED : own_end].reshape(len(sets), edges, OWN)
    at, dark, light, slope_dark, slope_light, unlike = (own[:, :, j][:, data.edge] for j in range(OWN))
    # The blurred step depends on few unknowns, which most sets of a derivative have in common.
    blur = np.concatenate((sets[:, k : k + SHARED], own[:, :, 0], own[:, :, 5]), axis=1)
    _, first, place = np.unique(blur, axis=0, return_index=True, return_inverse=True)
    step = _step(data.away - at[first], np.exp(unlike[first]), sets[first, k : k + SHARED, None], data.side[data.edge])
    x, step = data.away - at, step[place.ravel()]
    share = step + slope_dark * np.minimum(x, 0.0) * (1.0 - step) + slope_light * np.maximum(x, 0.0) * step
    out = np.empty_like(x)
    table, before = LEVELS, None
    for i, one in enumerate(sets):
        if before is None or not np.array_equal(one[:k], before):
            table, before = _table(family, one[:k]), one[:k]
        ends = np.interp(np.stack([dark[i], light[i]]), LEVELS, table)
        out[i] = np.interp(ends[0] + (ends[1] - ends[0]) * share[i], table, LEVELS)
    kept = out
    for share, band in zip(sets[:, own_end:].T, data.bands, strict=True):
        kept = kept - share[:, None] * (out @ band.T)
    return np.asarray((kept - data.level) / data.u)


def _step(x: Floats, wider: Floats, shared: Floats, side: Floats) -> Floats:
    """Edge spread function at the distances x, with the common unknowns; `wider` multiplies sigma."""
    sigma = wider * np.exp(shared[:, 0])
    radius = sigma * np.exp(shared[:, 1])
    own = sum(w * _over_pixel(x - radius * at, sigma) for at, w in zip(DISC_AT, DISC_W, strict=True))
    # The variance of a disc's line spread is a quarter of its squared radius, that of a pixel's width a twelfth.
    spread, length = np.sqrt(sigma**2 + 0.25 * radius**2 + 1.0 / 12.0), sigma * np.exp(shared[:, 4])
    larger, smaller = shared[:, 2], shared[:, 3]
    lighter, darker = np.where(side > 0.0, larger, smaller), np.where(side > 0.0, smaller, larger)
    outwards, inwards = _with_tail(x, spread, length), 1.0 - _with_tail(-x, spread, length)
    return np.asarray((1.0 - larger - smaller) * own + lighter * outwards + darker * inwards)


def _with_tail(x: Floats, sigma: Floats, length: Floats) -> Floats:
    """Step blurred by a Gaussian and by an exponential towards larger x (scaled error function against overflow)."""
    z = (sigma / length - x / sigma) / np.sqrt(2.0)
    near = 0.5 * np.exp(-0.5 * (x / sigma) ** 2) * erfcx(np.maximum(z, -5.0))
    far = np.exp(np.minimum(0.5 * (sigma / length) ** 2 - x / length, 50.0))
    return np.asarray(ndtr(x / sigma) - np.where(z > -5.0, near, far))


def _over_pixel(x: Floats, sigma: Floats) -> Floats:
    """Normal distribution integrated over a pixel about x: Edgeworth's series to the box's fourth cumulant, -1/120."""
    variance = sigma**2 + 1.0 / 12.0
    z = x / np.sqrt(variance)
    square = z * z
    return np.asarray(ndtr(z) + z * (square - 3.0) * np.exp(-0.5 * square) / (2880.0 * ROOT_2PI * variance**2))
