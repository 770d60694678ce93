"""Joint fit of optics, tone curve and what stands beside the edges to the mean profiles of several straight edges.

A codec by blocks quantises the coefficients of a cosine transform of the levels. The error of a coefficient far larger
than its quantiser's step differs from block to block and averages out, but smaller ones vanish in every block: the
codec filters the levels, symmetrically, and a profile that is odd in light looks more nearly odd in the levels. What
remains of each frequency is therefore unknown, as the optics are.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from calib.blurred_step import OPTICS, BlurredStep
from calib.camera_response import CameraResponse
from calib.edge_profile import EdgeProfile
from calib.edge_scene import NOTHING, Scene
from calib.tone_curves import LEVELS, Family

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

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
# A profile is used over this multiple of the blur plus these pixels, to either side; what is farther away, if it is
# used at all, in bins of three.
REACH_SIGMAS, REACH_EXTRA_PX, FAR = 4.0, 3.0, 3
# Steps of the Levenberg-Marquardt fit, change of the cost below which it has converged, and step of the derivatives.
MOST_STEPS, CONVERGED, STEP = 25, 0.02, 1e-4
# Largest reduction of the damping after a step, and the least damping.
EASIER, LEAST_DAMPING = 0.1, 1e-7
# Length over which what lies on an edge is correlated (pixels).
STRUCTURE_PX = 1.5
# What a codec leaves on an edge: length over which it is correlated (pixels), and how many times larger it is at the
# edge. Found by the evidence of recordings through x264 (constant rate factors of 16 to 26) and of JPEG pictures
# (quality 70 to 93).
CODEC_PX, CODEC_NEAR = 2.0, 5.0
# Numbers of unknowns of each edge: position, both plateaus as levels, slopes of both, ln of its own sigma over the
# common one.
OWN = 6
# Logarithm of the odds against pixels that were smoothed.
SMOOTHED_ODDS = float(np.log(150.0))
# Side of a codec's block (pixels), number of places of an edge in it, and smallest standard deviation of a lost share.
BLOCK_PX, PLACES, LEAST_LOST = 8, 32, 1e-3
ROOT_2PI = float(np.sqrt(2.0 * np.pi))


@dataclass(frozen=True, slots=True, eq=False)
class EdgeFit:
    """Fit of one family of tone curves, with something beside the edges, to all profiles.

    Parameters
    ----------
    family : Family
        The family.
    parameters, covariance : ndarray of float, shapes (k,) and (k, k)
        Parameters of the tone curve, and their covariance with everything else free.
    shared, u_shared : ndarray of float, shape (OPTICS,)
        Properties of the optics (see `blurred_step`), and their standard uncertainties.
    edges : ndarray of float, shape (OPTICS + edges * OWN + bands,)
        All unknowns but the parameters of the tone curve; the last are the shares of each frequency that a codec lost.
    log_evidence : float
        Logarithm of the evidence, up to a constant.
    misfit : ndarray of float, shape (edges,)
        Chi-square of each edge's bins, divided by their number less that of the unknowns of an edge.
    rms_level : float
        Root mean square of the residuals (share of full scale).
    scene : Scene
        What stands beside the edges.
    beside : ndarray of float, shape (m,)
        Parameters of the scene.
    at_px, at_covariance : ndarray of float, shapes (edges,) and (edges, edges)
        Positions of the edges, and their covariance with everything else free.
    by_pixels : bool
        See `EdgeData`.
    codec : float
        Standard deviation of what a codec leaves of a plateau's levels, with which the fit was made (share of the
        contrast).
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
    by_pixels: bool = False
    codec: float = 0.0

    def response(self) -> CameraResponse:
        """Tone curve of the fit."""
        return self.family.response(self.parameters)

    def outline_px(self, side: Floats, is_outer: Bools) -> Floats:
        """Distance of the outline of the whole part beyond each edge: the width of a side wall."""
        if not self.scene.has_wall:
            return np.zeros(side.size)
        distances, _ = self.scene.steps(self.beside[None], side, is_outer)
        return np.asarray(distances[0].max(axis=-1))

    def one_sigma(self) -> tuple[CameraResponse, ...]:
        """Tone curves one standard deviation away along each principal axis of the parameters' covariance."""
        if not self.parameters.size:
            return ()
        variance, axes = np.linalg.eigh(self.covariance)
        steps = np.sqrt(np.clip(variance, 0.0, None)) * axes
        return tuple(self.family.response(self.parameters + step) for step in steps.T)


@dataclass(frozen=True, slots=True, eq=False)
class EdgeData:
    """Bins of all profiles, one row for each edge; rows shorter than the longest have no weight at their ends.

    Parameters
    ----------
    away, level : ndarray of float, shape (edges, bins)
        Distance from the edge towards its light side (pixels), and level (share of full scale).
    u : ndarray of float, shape (edges, bins)
        Standard uncertainty of the level, without correlated parts; infinite where there is no bin.
    whiten : ndarray of float, shape (edges, bins, bins)
        Matrices that make the errors of an edge's bins independent and of unit variance.
    side : ndarray of float, shape (edges,)
        +1 if the light side has the larger coordinates, -1 otherwise.
    is_outer : ndarray of bool, shape (edges,)
        Whether an edge is that of an outer flank.
    ends : ndarray of float, shape (edges, 2)
        Levels of both plateaus.
    sigma : float
        Blur of the edges from their steepest places (pixels).
    bands : ndarray of float, shape (frequencies, edges, bins, bins)
        Matrices that take the levels to their part of each frequency of a codec's transform, and make it independent as
        `whiten` does.
    u_lost : ndarray of float, shape (frequencies,)
        Prior standard deviations of the shares that the codec has lost.
    log_scale : float
        Logarithm of the determinant of `whiten`, which is part of the evidence where uncertainties differ.
    are_alike : bool
        Whether both edges of a finger have nearly the same blur, because they lie in one depth.
    codec : float
        Standard deviation of what a codec leaves of a plateau's levels (share of the contrast).
    by_pixels : bool
        Whether pixels were smoothed, rather than the light on them.
    """

    away: Floats
    level: Floats
    u: Floats
    whiten: Floats
    side: Floats
    is_outer: Bools
    ends: Floats
    sigma: float
    bands: Floats
    u_lost: Floats
    log_scale: float
    are_alike: bool
    codec: float = 0.0
    by_pixels: bool = False

    @classmethod
    def of(
        cls,
        profiles: Sequence[EdgeProfile],
        model_error: float = 0.0,
        scale: float = 1.0,
        steps: Sequence[float] = (),
        *,
        discrepancy: float = 0.0,
        texture: float = 0.0,
        codec: float = 0.0,
        is_wide: bool = False,
        every: int = 1,
    ) -> "EdgeData":
        """Bins of profiles.

        Parameters
        ----------
        profiles : sequence of EdgeProfile
            At least one profile.
        model_error : float
            Standard deviation of a bin about the best model, independent of its neighbours (share of the contrast).
        scale : float
            Factor of all uncertainties.
        steps : sequence of float
            Steps of a codec's quantiser for the eight frequencies across an edge (shares of full scale).
        discrepancy : float
            Standard deviation about the best model that is smooth over a pixel (share of the contrast).
        texture : float
            Standard deviation of what lies on the finger, smooth as well (share of the contrast).
        codec : float
            Standard deviation of what a codec leaves of a plateau's levels (share of the contrast).
        is_wide : bool
            Whether all that is seen beside the edges is used.
        every : int
            Use one bin of so many, where a fit only begins.
        """
        widths = [edge_width(profile) for profile in profiles]
        sigma = float(np.median(widths))
        reach = REACH_SIGMAS * sigma + REACH_EXTRA_PX
        seen = [_merged(profile, reach, is_wide)[:, every // 2 :: every] for profile in profiles]
        sizes = [each.shape[1] for each in seen]
        away, level, u, structure = np.zeros((4, len(profiles), max(sizes)))
        u += np.inf
        whiten, log_scale = np.zeros((*away.shape, max(sizes))), 0.0
        for e, (profile, bins, n) in enumerate(zip(profiles, seen, sizes, strict=True)):
            away[e, :n], level[e, :n], u[e, :n], structure[e, :n] = bins
            away[e, n:] = away[e, n - 1]
            u[e] = scale * np.hypot(u[e], model_error * profile.contrast)
            apart = away[e, :n, None] - away[e, :n]
            covariance = np.diag(u[e, :n] ** 2)
            covariance += (discrepancy * profile.contrast) ** 2 * np.exp(-0.5 * apart**2)
            # The optics blur a texture of a pixel.
            on_finger = texture * profile.contrast * ndtr(-away[e, :n] / (sigma + 0.5))
            covariance += on_finger[:, None] * on_finger * np.exp(-0.5 * apart**2 / (1.0 + 2.0 * sigma**2))
            left = (
                codec
                * profile.contrast
                * np.sqrt(1.0 + CODEC_NEAR**2 * np.exp(-0.5 * (away[e, :n] / (sigma + 0.5)) ** 2))
            )
            covariance += left[:, None] * left * np.exp(-np.abs(apart) / CODEC_PX)
            own = scale * structure[e, :n]
            covariance += own[:, None] * own * np.exp(-0.5 * (apart / STRUCTURE_PX) ** 2)
            whiten[e, :n, :n] = np.linalg.inv(np.linalg.cholesky(covariance))
            log_scale += float(np.sum(np.log(np.diag(whiten[e, :n, :n]))))
        contrast = float(np.median([profile.contrast for profile in profiles]))
        return cls(
            away,
            level,
            u,
            whiten,
            np.array([profile.side for profile in profiles]),
            np.array([profile.is_outer for profile in profiles]),
            np.array([profile.ends for profile in profiles]),
            sigma,
            whiten @ _bands(away, sizes) if len(steps) else np.zeros((0, *whiten.shape)),
            _u_lost(sigma, contrast, np.array(steps)),
            log_scale,
            discrepancy > 0.0 or bool(structure.any()),
            codec,
        )

    def start(self) -> Floats:
        """Unknowns from which a fit begins, but those of the tone curve and of the scene."""
        own = np.zeros((len(self.ends), OWN))
        own[:, 1:3] = self.ends
        optics = [np.log(self.sigma / START_WIDENED), np.log(START_DISC), 0.0, 0.0, 0.0]
        return np.concatenate([optics, own.ravel(), np.zeros(len(self.bands))])

    def own_places(self) -> NDArray[np.intp]:
        """Places of each edge's unknowns in the vector of `start`, shape (edges, OWN)."""
        return OPTICS + np.arange(OWN * len(self.ends)).reshape(-1, OWN)


def _merged(profile: EdgeProfile, reach: float, is_wide: bool) -> Floats:
    """Distances, levels, their uncertainties and structure of the bins that are used; far ones are merged by threes."""
    structure = profile.u_structure if profile.u_structure.size else np.zeros(profile.away_px.size)
    every = np.array([profile.away_px, profile.level, profile.u_level, structure])
    is_near = np.abs(profile.away_px) < reach
    if not is_wide:
        return every[:, is_near]
    first, last = np.flatnonzero(is_near)[[0, -1]]
    parts = every[:, first % FAR : first], every[:, last + 1 : last + 1 + (every.shape[1] - last - 1) // FAR * FAR]
    dark, light = (
        part.reshape(4, -1, FAR).mean(axis=-1) / np.array([1.0, 1.0, FAR**0.5, 1.0])[:, None] for part in parts
    )
    return np.concatenate([dark, every[:, first : last + 1], light], axis=1)


def edge_width(profile: EdgeProfile) -> float:
    """Sigma of the edge from its steepest place: contrast / (sqrt(2 pi) slope)."""
    slope = np.gradient(profile.level, profile.away_px)
    steepest = float(np.median(np.sort(slope)[-3:]))
    return max(profile.contrast / (ROOT_2PI * max(steepest, 1e-9)), 0.5)


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


def _bands(away: Floats, sizes: Sequence[int]) -> Floats:
    """Matrices that take levels to their part of each frequency but the mean, averaged over all places of blocks.

    The mean over all places of the projection on a vector of a basis is the convolution with its autocorrelation,
    divided by the number of places.
    """
    kernels = np.array([np.correlate(basis, basis, "full") for basis in _cosines()[1:]]) / BLOCK_PX
    ways = range(1 - BLOCK_PX, BLOCK_PX)
    found = np.zeros((len(kernels), *away.shape, away.shape[1]))
    for e, n in enumerate(sizes):
        found[:, e, :n, :n] = np.tensordot(kernels, np.array([_moved(away[e, :n], way) for way in ways]), 1)
    return found


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


def fitted(
    family: Family,
    data: EdgeData,
    start: Floats,
    scene: Scene = NOTHING,
    begin: tuple[Floats, Floats] | None = None,
    most_steps: int = MOST_STEPS,
) -> EdgeFit:
    """Levenberg-Marquardt fit, and Laplace's evidence at its result.

    Parameters
    ----------
    family : Family
        Family of tone curves.
    data : EdgeData
        The profiles.
    start : ndarray of float
        Unknowns from which the fit begins, as of `EdgeData.start`.
    scene : Scene
        What stands beside the edges.
    begin : (ndarray of float, ndarray of float) or None
        Parameters of the tone curve and of the scene from which the fit begins; None for the prior means.
    most_steps : int
        Largest number of steps.
    """
    k, edges, beside = len(family.mean), len(data.ends), len(scene.mean)
    curve, own = begin or (np.array(family.mean), np.array(scene.mean))
    unknowns = np.concatenate([curve, own, start])
    mean, precision = prior_mean(family, scene, data), priors(family, scene, data)
    damping, seen = 1e-2, _Seen.of(family, scene, data, unknowns)
    residual = seen.residual(data)
    cost = _cost(residual, unknowns, mean, precision)
    for _step in range(most_steps):
        jacobian = _derivatives(family, scene, data, unknowns, seen)
        gradient = jacobian.T @ residual + precision @ (unknowns - mean)
        hessian = jacobian.T @ jacobian + precision
        gained, harder = 0.0, 2.0
        while damping < 1e6:
            step = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), -gradient)
            foretold = -float(step @ (gradient + 0.5 * hessian @ step))
            tried = unknowns + step
            new = _Seen.of(family, scene, data, tried)
            left = new.residual(data)
            tried_cost = _cost(left, tried, mean, precision)
            if tried_cost < cost:
                gained, unknowns, seen, residual, cost = cost - tried_cost, tried, new, left, tried_cost
                # Damping by how well the gain was foretold: Nielsen, IMM-REP-1999-05, Technical University of Denmark.
                damping = max(damping * max(EASIER, 1.0 - (2.0 * gained / foretold - 1.0) ** 3), LEAST_DAMPING)
                break
            # A smaller step would gain even less.
            if foretold < CONVERGED:
                break
            damping, harder = damping * harder, 2.0 * harder
        if gained < CONVERGED:
            break
    jacobian = _derivatives(family, scene, data, unknowns, seen)
    hessian = jacobian.T @ jacobian + precision
    size = np.sqrt(np.diag(hessian))
    covariance = np.linalg.inv(hessian / np.outer(size, size)) / np.outer(size, size)
    evidence = data.log_scale - cost - 0.5 * float(np.linalg.slogdet(hessian)[1])
    evidence -= float(np.sum(np.log((*family.u, *scene.u))))
    count = np.isfinite(data.u).sum(axis=1)
    chi = np.sum(residual.reshape(edges, -1) ** 2, axis=1)
    optics = np.s_[k + beside : k + beside + OPTICS]
    at = k + beside + data.own_places()[:, 0]
    return EdgeFit(
        family,
        unknowns[:k],
        covariance[:k, :k],
        unknowns[optics],
        np.sqrt(np.diag(covariance)[optics]),
        unknowns[k + beside :],
        evidence,
        chi / np.maximum(count - OWN, 1).astype(np.float64),
        float(
            np.sqrt(np.mean((residual.reshape(data.u.shape)[np.isfinite(data.u)] * data.u[np.isfinite(data.u)]) ** 2))
        ),
        scene,
        unknowns[k : k + beside],
        unknowns[at],
        covariance[np.ix_(at, at)],
        data.by_pixels,
        data.codec,
    )


def with_placed_edges(
    family: Family, data: EdgeData, start: Floats, scene: Scene, begin: tuple[Floats, Floats]
) -> Floats:
    """The unknowns with every edge where its own profile fits best: each step of a scene may be the one that was found.

    Parameters
    ----------
    family, data, start, scene, begin : Family, EdgeData, ndarray of float, Scene, (ndarray of float, ndarray of float)
        See `fitted`.
    """
    distances, weights = (each[0] for each in scene.steps(begin[1][None], data.side, data.is_outer))
    mean = np.einsum("en,en->e", distances, weights)
    tried = -np.stack([mean, distances.min(axis=-1), distances.max(axis=-1), np.zeros(mean.size)])
    squares, placed, at = [], start.copy(), data.own_places()[:, 0]
    for positions in tried:
        placed[at] = positions
        residual = _Seen.of(family, scene, data, np.concatenate([*begin, placed])).residual(data)
        squares.append(np.sum(residual.reshape(mean.size, -1) ** 2, axis=1))
    placed[at] = tried[np.argmin(squares, axis=0), np.arange(mean.size)]
    return placed


def with_smoothing(data: EdgeData, families: Sequence[Family]) -> EdgeData:
    """The same bins, and whether pixels were smoothed, which sharp edges tell.

    Parameters
    ----------
    data : EdgeData
        The profiles.
    families : sequence of Family
        Families of tone curves, one of which may be that of the camera.
    """
    smoothed = replace(data, by_pixels=True)
    by_light = max((fitted(each, data, data.start()) for each in families), key=lambda fit: fit.log_evidence)
    if float(np.mean(by_light.misfit)) < 1.0:
        return data
    by_pixels = max(fitted(each, smoothed, smoothed.start()).log_evidence for each in families)
    return smoothed if by_pixels - by_light.log_evidence > SMOOTHED_ODDS else data


def prior_mean(family: Family, scene: Scene, data: EdgeData) -> Floats:
    """Prior means of all unknowns."""
    optics = [np.log(data.sigma), 0.0, 0.0, 0.0, 0.0]
    return np.concatenate([family.mean, scene.mean, optics, np.zeros(OWN * len(data.ends) + len(data.bands))])


def priors(family: Family, scene: Scene, data: EdgeData) -> Floats:
    """Inverse of the prior covariance of all unknowns; nothing is known of positions and plateaus."""
    own = np.array([np.inf, np.inf, np.inf, U_SLOPE, U_SLOPE, U_UNLIKE])
    edges = len(data.ends)
    optics = np.array([U_SIGMA, U_DISC, U_TAIL, U_TAIL, U_LENGTH])
    u = np.concatenate([family.u, scene.u, optics, np.tile(own, edges), data.u_lost])
    precision = np.diag(np.where(np.isfinite(u), u**-2.0, 0.0) + 1e-9)
    if data.are_alike:
        is_left = (data.side > 0.0) != data.is_outer
        same = U_UNLIKE**2 * (is_left[:, None] == is_left) + U_UNLIKE_INSIDE**2 * np.eye(edges)
        at = len(family.mean) + len(scene.mean) + data.own_places()[:, -1]
        precision[np.ix_(at, at)] = np.linalg.inv(same)
    return precision


def _cost(residual: Floats, unknowns: Floats, mean: Floats, precision: Floats) -> float:
    away = unknowns - mean
    return float(0.5 * (residual @ residual + away @ precision @ away))


def _whitened(data: EdgeData, values: Floats) -> Floats:
    return np.asarray(data.whiten @ values[..., None])[..., 0]


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """Model of all profiles for one set of unknowns; arrays of shape (edges, bins) and (edges, bins, steps)."""

    place: Floats
    narrower: Floats
    step: Floats
    slope: Floats
    blurred: BlurredStep
    weights: Floats
    x: Floats
    sum: Floats
    share: Floats
    table: Floats
    ends: Floats
    out: Floats
    own: Floats
    lost: Floats

    @classmethod
    def of(cls, family: Family, scene: Scene, data: EdgeData, unknowns: Floats) -> "_Seen":
        k, m, edges = len(family.mean), len(scene.mean), len(data.ends)
        optics = unknowns[k + m : k + m + OPTICS]
        own_end = k + m + OPTICS + OWN * edges
        own = unknowns[k + m + OPTICS : own_end].reshape(edges, OWN)
        distances, weights = (each[0] for each in scene.steps(unknowns[None, k : k + m], data.side, data.is_outer))
        # Widening acts on the optics, and not on the width of the pixel.
        variance = 12.0 * np.exp(2.0 * optics[0]) * (1.0 + 0.25 * np.exp(2.0 * optics[1]))
        narrower = np.sqrt((variance + 1.0) / (variance * np.exp(2.0 * own[:, 5]) + 1.0))
        x = data.away - own[:, :1]
        place = (x[..., None] - distances[:, None]) * narrower[:, None, None]
        side = data.side[:, None, None]
        blurred = BlurredStep.of(optics, data.by_pixels)
        value, slope = blurred.at(side * place)
        # An edge that faces the other way sees the tails of the optics swapped.
        step = 0.5 + side * (value - 0.5)
        total = np.einsum("ebn,en->eb", step, weights)
        share = total + own[:, 3:4] * np.minimum(x, 0.0) * (1.0 - total) + own[:, 4:5] * np.maximum(x, 0.0) * total
        table = family.table(unknowns[:k])
        ends = np.interp(own[:, 1:3], LEVELS, table)
        out = np.interp(ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * share, table, LEVELS)
        lost = unknowns[own_end:]
        return cls(place, narrower, step, slope, blurred, weights, x, total, share, table, ends, out, own, lost)

    def residual(self, data: EdgeData) -> Floats:
        """Modelled minus measured level of every bin, made independent and of unit variance."""
        kept = _whitened(data, self.out - data.level) - np.tensordot(self.lost, self.by_lost(data), 1)
        return np.asarray(kept.ravel())

    def by_lost(self, data: EdgeData) -> Floats:
        """Each frequency's part of the levels, made independent, shape (frequencies, edges, bins)."""
        return np.asarray(data.bands @ self.out[..., None])[..., 0]


def derivatives(family: Family, scene: Scene, data: EdgeData, unknowns: Floats) -> tuple[Floats, Floats]:
    """Residuals, and their derivatives with respect to all unknowns, shape (edges * bins, unknowns)."""
    seen = _Seen.of(family, scene, data, unknowns)
    return seen.residual(data), _derivatives(family, scene, data, unknowns, seen)


def _derivatives(family: Family, scene: Scene, data: EdgeData, unknowns: Floats, seen: _Seen) -> Floats:
    k, m, edges = len(family.mean), len(scene.mean), len(data.ends)
    dark, light, own = seen.ends[:, :1], seen.ends[:, 1:], seen.own
    by_level = np.gradient(seen.table, LEVELS)
    # Levels beyond the scale are clipped.
    per_light = (seen.out > 0.0) * (seen.out < 1.0) / np.interp(seen.out, LEVELS, by_level)
    before, after = np.minimum(seen.x, 0.0), np.maximum(seen.x, 0.0)
    per_share = per_light * (light - dark)
    per_step = per_share * (1.0 - own[:, 3:4] * before + own[:, 4:5] * after)
    density = np.einsum("ebn,en->eb", seen.slope, seen.weights) * seen.narrower[:, None]
    tilt = own[:, 3:4] * (seen.x < 0.0) * (1.0 - seen.sum) + own[:, 4:5] * (seen.x > 0.0) * seen.sum
    ends_by_level = np.interp(own[:, 1:3], LEVELS, by_level)
    widened = np.einsum("ebn,en->eb", seen.slope * seen.place, seen.weights)
    variance = 1.0 - seen.narrower**2 / (
        1.0 + 12.0 * np.exp(2.0 * unknowns[k + m]) * (1.0 + 0.25 * np.exp(2.0 * unknowns[k + m + 1]))
    )
    own_columns = np.stack(
        [
            -per_step * density - per_share * tilt,
            per_light * (1.0 - seen.share) * ends_by_level[:, :1],
            per_light * seen.share * ends_by_level[:, 1:],
            per_share * before * (1.0 - seen.sum),
            per_share * after * seen.sum,
            -per_step * widened * variance[:, None],
        ]
    )
    columns = [_by_curve(family, seen, unknowns[:k])] if k else []
    if m:
        columns.append(per_step * _by_scene(scene, data, seen, unknowns[k : k + m]))
    side = data.side[:, None, None]
    by_optics = side * seen.blurred.by_optics(side * seen.place)
    columns.append(per_step * np.einsum("jebn,en->jeb", by_optics, seen.weights))
    shared, bins = k + m + OPTICS, data.away.shape[1]
    weigh = data.whiten - np.tensordot(seen.lost, data.bands, 1) if len(data.bands) else data.whiten
    common = weigh @ np.concatenate([*columns, own_columns]).transpose(1, 2, 0)
    every = np.concatenate([common, -seen.by_lost(data).transpose(1, 2, 0)], axis=2)
    jacobian = np.zeros((edges, bins, unknowns.size))
    jacobian[:, :, :shared] = every[:, :, :shared]
    for e in range(edges):
        jacobian[e, :, shared + OWN * e : shared + OWN * (e + 1)] = every[e, :, shared : shared + OWN]
    jacobian[:, :, shared + OWN * edges :] = every[:, :, shared + OWN :]
    return jacobian.reshape(edges * bins, -1)


def _by_curve(family: Family, seen: _Seen, parameters: Floats) -> Floats:
    """Derivatives of the levels with respect to the parameters of the tone curve, shape (k, edges, bins)."""
    found = []
    for change in STEP * np.eye(parameters.size):
        table = family.table(parameters + change)
        dark, light = (np.interp(seen.own[:, j : j + 1], LEVELS, table) for j in (1, 2))
        found.append((np.interp(dark + (light - dark) * seen.share, table, LEVELS) - seen.out) / STEP)
    return np.array(found)


def _by_scene(scene: Scene, data: EdgeData, seen: _Seen, parameters: Floats) -> Floats:
    """Derivatives of the sum of steps with respect to the parameters of the scene, shape (m, edges, bins)."""
    sets = parameters + STEP * np.concatenate([np.zeros((1, parameters.size)), np.eye(parameters.size)])
    distances, weights = scene.steps(sets, data.side, data.is_outer)
    by_distance, by_weight = ((each[1:] - each[0]) / STEP for each in (distances, weights))
    moving = by_distance * (weights[0] * seen.narrower[:, None])
    return np.asarray(np.einsum("ebn,jen->jeb", seen.step, by_weight) - np.einsum("ebn,jen->jeb", seen.slope, moving))
