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
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.special import erfcx, ndtr
from scipy.stats import chi2

from calib.camera_response import CURVES, CameraResponse, standard_response
from calib.edge_profile import EdgeProfile
from calib.edge_scene import NOTHING, PROBE, SCENES, Scene

Floats = NDArray[np.float64]

# Levels (shares of full scale) at which the light of a family is tabulated.
LEVELS = np.linspace(0.0, 1.0, 1025)
# Prior standard deviations: ln of the disc's radius over sigma (about 0), share of the light in each tail, ln of the
# tails' mean length over sigma (about 0), change of the light of each plateau per pixel (share of the contrast),
# difference of an edge's ln sigma from the common one, ln sigma.
U_DISC, U_TAIL, U_LENGTH, U_SLOPE, U_UNLIKE, U_SIGMA = 1.0, 0.2, 0.5, 0.01, 0.03, 1.0
# Standard deviation of the difference of an edge's ln sigma from that of the same finger's other edge.
U_UNLIKE_INSIDE = 0.01
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
# Length over which what lies on an edge is correlated (pixels).
STRUCTURE_PX = 1.5
# Steps after which the best of several starts is chosen.
FIRST_STEPS = 7
# Difference in log evidence beyond which a scene is not tried with further tone curves, which gain less than this.
HOPELESS = 20.0
# Difference of the blurs of inner and outer edges (ln sigma) above which a wall narrower than the blur is possible: it
# is four times the precision of recordings without a wall.
WIDER_INSIDE = 0.02
# Rate of false alarms of the score test, and least information of a direction as a share of the largest.
FALSE_ALARMS, LEAST_TOLD = 1e-3, 1e-3
# Extent of the table of the edge spread function in the largest length of the optics and in pixels, and its spacing:
# linear interpolation errs by 1e-4. A step of a fit may try optics of any width (ln px): what is broader than the
# profile is cut off.
TABLE_SIGMAS, TABLE_EXTRA_PX, TABLED_PX, MOST_TABLED = 5.0, 1.0, 0.05, 3.0
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
    scene : Scene
        What stands beside the edges.
    beside : ndarray of float, shape (m,)
        Parameters of the scene.
    at_px, at_covariance : ndarray of float, shapes (edges,) and (edges, edges)
        Positions of the edges, and their covariance with everything else free.
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
    scene: Scene = NOTHING
    beside: Floats = field(default_factory=lambda: np.zeros(0))
    at_px: Floats = field(default_factory=lambda: np.zeros(0))
    at_covariance: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    def response(self, parameters: Floats | None = None) -> CameraResponse:
        """Tone curve of the fit, or of other parameters of its family."""
        if not self.parameters.size:
            return _fixed_response(self.family)
        return _as_response(self.family, self.parameters if parameters is None else parameters)

    def outline_px(self, side: Floats, is_outer: NDArray[np.bool_]) -> Floats:
        """Distance of the outline of the whole part beyond each edge: the width of a side wall."""
        if self.scene.name != "wall":
            return np.zeros(side.size)
        distances, _ = self.scene.steps(self.beside[None], side, is_outer)
        return np.asarray(distances[0].max(axis=-1))

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
    data = _Data.of(profiles, model_error, scale, steps).with_structure()
    fits: list[FamilyFit] = []
    for family in (*FAMILIES, *_tagged(tagged)):
        # A family with parameters begins where the best one has ended, because edges and optics are the same.
        best = max(fits, key=lambda fit: fit.log_evidence, default=None) if family.mean else None
        fits.append(_fit(family, data, data.start() if best is None else best.edges))
    return sorted(fits, key=lambda fit: -fit.log_evidence)


def fit_scenes(
    profiles: Sequence[EdgeProfile],
    discrepancy: float,
    families: Sequence[Family],
    others: Sequence[Family] = (),
) -> list[FamilyFit]:
    """Fit everything that may stand beside the edges, the most probable first.

    Parameters
    ----------
    profiles : sequence of EdgeProfile
        Profiles of dark fingers, at least one of an inner and one of an outer flank.
    discrepancy : float
        Standard deviation of a real edge about the best model, smooth over a pixel, as a share of the contrast.
    families : sequence of Family
        Families of tone curves that are fitted with every scene.
    others : sequence of Family
        Families that are fitted with nothing beside the edges, and with scenes that the first family does not exclude.
    """
    data = _Data.of(profiles, 0.0, 1.0, (), np.inf).with_discrepancy(discrepancy)
    coarse = _Data.of([_thinned(profile) for profile in profiles], 0.0, 1.0, (), np.inf).with_discrepancy(discrepancy)
    narrowest = min(_width(profile) for profile in profiles)
    fits = [_fit(family, data, data.start()) for family in families]
    for scene in SCENES:
        begun = []
        for own, inner_px, outer_px in scene.starts:
            start = data.start()
            start[0] = np.log(narrowest / START_WIDENED)
            start[SHARED : SHARED + OWN * len(profiles) : OWN] = np.where(data.is_outer, outer_px, inner_px)
            begin = np.array(families[0].mean), np.array(own)
            begun.append(_fit(families[0], coarse, start, scene, begin, FIRST_STEPS))
        best = max(begun, key=lambda fit: fit.log_evidence)
        for family in families:
            parameters = best.parameters if family is families[0] else np.array(family.mean)
            best = _fit(family, data, best.edges, scene, (parameters, best.beside))
            fits.append(best)
    least = max(fit.log_evidence for fit in fits) - HOPELESS
    begun = [fit for fit in fits if fit.family is families[0] and (fit.scene is NOTHING or fit.log_evidence > least)]
    for fit in begun:
        start = fit.edges
        fits += [_fit(family, data, start, fit.scene, (np.array(family.mean), fit.beside)) for family in others]
    return sorted(fits, key=lambda fit: -fit.log_evidence)


def _thinned(profile: EdgeProfile) -> EdgeProfile:
    """Profile with every third bin, from which a fit may begin."""
    away, level, u = (each[1::3] for each in (profile.away_px, profile.level, profile.u_level))
    return replace(profile, away_px=away, level=level, u_level=u, u_structure=profile.u_structure[1::3])


def fixed_family(response: CameraResponse) -> Family:
    """Family of one known curve."""
    light = _light(response)
    return Family(response.name, lambda _: light)


def family(name: str) -> Family:
    """Return the family of tone curves with a name in `FAMILIES`."""
    return next(each for each in FAMILIES if each.name == name)


def is_more_beside(profiles: Sequence[EdgeProfile], model_error: float, family: Family) -> bool:
    """Whether steps of light beside the edges would explain what the fit of a family leaves (score test)."""
    data = _Data.of(profiles, model_error, 1.0, (), np.inf).with_structure()
    fit = _fit(family, data, data.start())
    wider = fit.edges[SHARED + OWN - 1 : SHARED + OWN * len(profiles) : OWN]
    if abs(float(wider[~data.is_outer].mean() - wider[data.is_outer].mean())) > WIDER_INSIDE:
        return True
    unknowns = np.concatenate([fit.parameters, np.zeros(len(PROBE.mean)), fit.edges])
    residual = _residuals(fit.family, PROBE, data, unknowns[None])[0]
    jacobian = _jacobian(fit.family, PROBE, data, unknowns, residual)
    k, probes = len(fit.parameters), len(PROBE.mean)
    tried, own = jacobian[:, k : k + probes], np.delete(jacobian, np.s_[k : k + probes], axis=1)
    _, u = _priors(fit.family, NOTHING, data)
    hessian = own.T @ own + _precision(u, data)
    tried = tried / np.linalg.norm(tried, axis=0)
    mixed = own.T @ tried
    information = tried.T @ tried - mixed.T @ np.linalg.solve(hessian, mixed)
    variance, axes = np.linalg.eigh(information)
    is_told = variance > LEAST_TOLD * variance[-1]
    score = (axes.T @ (tried.T @ residual))[is_told] / np.sqrt(variance[is_told])
    return bool(score @ score > chi2.isf(FALSE_ALARMS, np.count_nonzero(is_told)))


@cache
def _tagged(name: str) -> tuple[Family, ...]:
    if not name or any(family.name == name for family in FAMILIES):
        return ()
    return (Family(name, lambda _: np.interp(LEVELS, standard_response(name).level, standard_response(name).light)),)


def probabilities(fits: Sequence[FamilyFit]) -> Floats:
    """Posterior probability of each fit."""
    others = len({fit.family.name for fit in fits} - {"linear"})
    prior = np.array(
        [
            fit.scene.probability * (LINEAR_PRIOR if fit.family.name == "linear" else (1.0 - LINEAR_PRIOR) / others)
            for fit in fits
        ]
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
        best: dict[str, tuple[FamilyFit, float]] = {}
        for fit, p in zip(fits, probabilities(fits), strict=True):
            chosen, so_far = best.get(fit.family.name, (fit, 0.0))
            best[fit.family.name] = (fit if fit.log_evidence > chosen.log_evidence else chosen, so_far + float(p))
        likely = [(fit, p) for fit, p in best.values() if p > LEAST_PROBABILITY]
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
    is_outer: NDArray[np.bool_]
    ends: Floats
    sigma: float
    bands: Floats
    u_lost: Floats
    structure: Floats
    whiten: tuple[Floats, ...] = ()

    @classmethod
    def of(
        cls,
        profiles: Sequence[EdgeProfile],
        model_error: float,
        scale: float,
        steps: Sequence[float],
        reach: float = 0.0,
    ) -> "_Data":
        sigma = float(np.median([_width(profile) for profile in profiles]))
        reach = reach or REACH_SIGMAS * sigma + REACH_EXTRA_PX
        away, level, u, edge, structure = [], [], [], [], []
        for k, profile in enumerate(profiles):
            near = np.abs(profile.away_px) < reach
            away.append(profile.away_px[near])
            level.append(profile.level[near])
            u.append(scale * np.hypot(profile.u_level[near], model_error * profile.contrast))
            edge.append(np.full(away[-1].size, k))
            structure.append(scale * profile.u_structure[near] if profile.u_structure.size else 0.0 * u[-1])
        return cls(
            np.concatenate(away),
            np.concatenate(level),
            np.concatenate(u),
            np.concatenate(edge),
            np.array([profile.side for profile in profiles]),
            np.array([profile.is_outer for profile in profiles]),
            np.array([profile.ends for profile in profiles]),
            sigma,
            _bands(away, len(steps)),
            _u_lost(sigma, float(np.median([profile.contrast for profile in profiles])), np.array(steps)),
            np.concatenate(structure),
        )

    def with_structure(self) -> "_Data":
        """Covariance of what lies on the edges, where there is any."""
        return self.with_discrepancy(0.0) if self.structure.any() else self

    def with_discrepancy(self, share: float) -> "_Data":
        """Add the structure on the edges, and what real edges differ from any model: a share of the contrast."""
        contrast = np.ptp(self.ends, axis=1)
        whiten = []
        for e in range(len(self.ends)):
            mine = self.edge == e
            apart = self.away[mine][:, None] - self.away[mine]
            covariance = np.diag(self.u[mine] ** 2) + (share * contrast[e]) ** 2 * np.exp(-0.5 * apart**2)
            own = self.structure[mine]
            covariance += own[:, None] * own * np.exp(-0.5 * (apart / STRUCTURE_PX) ** 2)
            whiten.append(np.linalg.inv(np.linalg.cholesky(covariance)))
        return replace(self, whiten=tuple(whiten))

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


def _fit(
    family: Family,
    data: _Data,
    start: Floats,
    scene: Scene = NOTHING,
    begin: tuple[Floats, Floats] | None = None,
    most_steps: int = MOST_STEPS,
) -> FamilyFit:
    """Levenberg-Marquardt fit, and Laplace's evidence at its result; `begin` has both parts' parameters."""
    k, edges, beside = len(family.mean), len(data.ends), len(scene.mean)
    curve, own = begin or (np.array(family.mean), np.array(scene.mean))
    unknowns = np.concatenate([curve, own, start])
    prior_mean, prior_u = _priors(family, scene, data)
    precision = _precision(prior_u, data)
    damping, residual = 1e-2, _residuals(family, scene, data, unknowns[None])[0]
    cost = _cost(residual, unknowns, prior_mean, precision)
    for _step in range(most_steps):
        jacobian = _jacobian(family, scene, data, unknowns, residual)
        gradient = jacobian.T @ residual + precision @ (unknowns - prior_mean)
        hessian = jacobian.T @ jacobian + precision
        gained = 0.0
        while damping < 1e6:
            step = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), -gradient)
            tried = unknowns + step
            left = _residuals(family, scene, data, tried[None])[0]
            tried_cost = _cost(left, tried, prior_mean, precision)
            if tried_cost < cost:
                gained, unknowns, residual, cost = cost - tried_cost, tried, left, tried_cost
                damping = max(0.1 * damping, 1e-9)
                break
            damping *= 10.0
        if gained < CONVERGED:
            break
    jacobian = _jacobian(family, scene, data, unknowns, residual)
    hessian = jacobian.T @ jacobian + precision
    covariance = np.asarray(np.linalg.pinv(hessian), dtype=np.float64)
    evidence = -cost - 0.5 * float(np.linalg.slogdet(hessian)[1]) - float(np.sum(np.log((*family.u, *scene.u))))
    count = np.bincount(data.edge, minlength=edges)
    chi = np.bincount(data.edge, residual**2, minlength=edges)
    at = k + beside + SHARED + OWN * np.arange(edges)
    return FamilyFit(
        family,
        unknowns[:k],
        covariance[:k, :k],
        unknowns[k + beside : k + beside + SHARED],
        np.sqrt(np.diag(covariance)[k + beside : k + beside + SHARED]),
        unknowns[k + beside :],
        evidence,
        chi / np.maximum(count - OWN, 1).astype(np.float64),
        float(np.sqrt(np.mean((residual * data.u) ** 2))),
        scene,
        unknowns[k : k + beside],
        unknowns[at],
        covariance[np.ix_(at, at)],
    )


def _priors(family: Family, scene: Scene, data: _Data) -> tuple[Floats, Floats]:
    """Means and standard deviations of all unknowns; infinite for the position and the plateaus."""
    own = np.array([np.inf, np.inf, np.inf, U_SLOPE, U_SLOPE, U_UNLIKE])
    edges, bands = len(data.ends), len(data.bands)
    shared_u = np.array([U_SIGMA, U_DISC, U_TAIL, U_TAIL, U_LENGTH])
    optics = [np.log(data.sigma), 0.0, 0.0, 0.0, 0.0]
    mean = np.concatenate([family.mean, scene.mean, optics, np.zeros(OWN * edges + bands)])
    return mean, np.concatenate([family.u, scene.u, shared_u, np.tile(own, edges), data.u_lost])


def _precision(u: Floats, data: _Data) -> Floats:
    """Inverse of the priors' covariance; both edges of a finger lie in one depth and have nearly the same blur."""
    precision = np.diag(np.where(np.isfinite(u), u**-2.0, 0.0) + 1e-9)
    if data.whiten:
        is_left = (data.side > 0.0) != data.is_outer
        same = U_UNLIKE**2 * (is_left[:, None] == is_left) + U_UNLIKE_INSIDE**2 * np.eye(len(is_left))
        end = precision.shape[0] - len(data.bands)
        at = np.arange(end - OWN * len(is_left) + OWN - 1, end, OWN)
        precision[np.ix_(at, at)] = np.linalg.inv(same)
    return precision


def _cost(residual: Floats, unknowns: Floats, mean: Floats, precision: Floats) -> float:
    away = unknowns - mean
    return float(0.5 * (residual @ residual + away @ precision @ away))


def _jacobian(family: Family, scene: Scene, data: _Data, unknowns: Floats, residual: Floats) -> Floats:
    """Derivatives of the residuals; an unknown of one edge moves that edge alone, so that all edges move at once."""
    common, edges = len(family.mean) + len(scene.mean) + SHARED, len(data.ends)
    own_end = common + OWN * edges
    moved = np.repeat(unknowns[None], common + OWN + len(data.bands), axis=0)
    moved[np.arange(common), np.arange(common)] += STEP
    for j in range(OWN):
        moved[common + j, common + j : own_end : OWN] += STEP
    lost = np.arange(len(data.bands))
    moved[common + OWN + lost, own_end + lost] += STEP
    change = (_residuals(family, scene, data, moved) - residual) / STEP
    jacobian = np.zeros((residual.size, unknowns.size))
    jacobian[:, :common], jacobian[:, own_end:] = change[:common].T, change[common + OWN :].T
    for e in range(edges):
        mine = data.edge == e
        jacobian[mine, common + OWN * e : common + OWN * (e + 1)] = change[common : common + OWN, mine].T
    return jacobian


def _residuals(family: Family, scene: Scene, data: _Data, sets: Floats) -> Floats:
    """Measured minus modelled level of every bin, in its standard uncertainties, for each set of unknowns."""
    k, beside, edges = len(family.mean), len(scene.mean), len(data.ends)
    common = k + beside + SHARED
    own_end = common + OWN * edges
    own = sets[:, common:own_end].reshape(len(sets), edges, OWN)
    at, dark, light, slope_dark, slope_light, unlike = (own[:, :, j][:, data.edge] for j in range(OWN))
    # The blurred step depends on few unknowns, which most sets of a derivative have in common.
    blur = np.concatenate((sets[:, k:common], own[:, :, 0], own[:, :, 5]), axis=1)
    _, first, place = np.unique(blur, axis=0, return_index=True, return_inverse=True)
    away, wider, shared = data.away - at[first], np.exp(unlike[first]), sets[first, k + beside : common]
    if not data.whiten and not beside:
        step = _step(away, wider, shared[:, :, None], data.side[data.edge])
    else:
        distances, weights = scene.steps(sets[first, k : k + beside], data.side, data.is_outer)
        step = _tabulated_steps(away, wider, shared, distances[:, data.edge], weights[:, data.edge], data)
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
    off = kept - data.level
    if not data.whiten:
        return np.asarray(off / data.u)
    ends = np.searchsorted(data.edge, np.arange(1, edges))
    parts = np.split(off, ends, axis=1)
    return np.concatenate([part @ own.T for part, own in zip(parts, data.whiten, strict=True)], axis=1)


def _tabulated_steps(
    away: Floats, wider: Floats, shared: Floats, distances: Floats, weights: Floats, data: _Data
) -> Floats:
    """Sum of steps at these distances from the edges, by a table of the edge spread function for each set of optics."""
    every, which = np.unique(shared, axis=0, return_inverse=True)
    widest = float(np.exp(min(every[:, 0].max() + max(every[:, [1, 4]].max(), 0.0), MOST_TABLED)))
    end = TABLE_EXTRA_PX + TABLE_SIGMAS * widest
    x = np.linspace(-end, end, 2 * round(end / TABLED_PX) + 1)
    one = np.ones((len(every), x.size))
    tables = _step(x * one, one, every[:, :, None], one)
    out = np.zeros_like(away)
    side = data.side[data.edge][:, None]
    for i, table in enumerate(tables):
        sets = which.ravel() == i
        # Widening acts on the optics, and not on the width of the pixel.
        variance = np.exp(2.0 * every[i, 0]) * (1.0 + 0.25 * np.exp(2.0 * every[i, 1]))
        narrower = np.sqrt((12.0 * variance + 1.0) / (12.0 * variance * wider[sets] ** 2 + 1.0))
        places = (away[sets][..., None] - distances[sets]) * narrower[..., None]
        # An edge that faces the other way sees the tails of the optics swapped.
        step = 0.5 + side * (np.interp(side * places, x, table) - 0.5)
        out[sets] = np.sum(weights[sets] * step, axis=-1)
    return out


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
