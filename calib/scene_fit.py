"""Evidence for what stands beside the edges: each scene fitted with each family of tone curves."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from calib.edge_fit import (
    MOST_STEPS,
    SMOOTHED_ODDS,
    START_WIDENED,
    EdgeData,
    EdgeFit,
    derivatives,
    edge_width,
    fitted,
    prior_mean,
    priors,
    with_placed_edges,
    with_smoothing,
)
from calib.edge_profile import EdgeProfile
from calib.edge_scene import NOTHING, PAIRS, PROBE, SCENES, Scene
from calib.tone_curves import Family

Floats = NDArray[np.float64]

# Steps after which the best of several starts is chosen; one bin of so many is used for them.
FIRST_STEPS, COARSE = 7, 3
# Difference in log evidence beyond which a fit does not go on: from few bins to all, or from one tone curve to further
# ones, which gain less than this.
HOPELESS = 20.0
# Difference of the blurs of inner and outer edges (ln sigma) above which a wall narrower than the blur is possible: it
# is four times the precision of recordings without a wall.
WIDER_INSIDE = 0.02
# Mean chi-square of a bin above which two things at once are tried.
LEAVES_MORE = 1.1
# Discrepancies of real edges from the models, in units of the usual one, that are tried while more is left: each is as
# many times less probable as its square. Number of fits that are made again with them, plain edges apart.
DISCREPANCIES, MOST_AGAIN = (2.0, 4.0, 8.0, 16.0), 4
# Whether real edges differ so on the finger alone (its texture), or everywhere.
ON_FINGER = (False, True)
# Rate of false alarms of the score test, and least information of a direction as a share of the largest.
FALSE_ALARMS, LEAST_TOLD = 1e-3, 1e-3


def fit_scenes(
    profiles: Sequence[EdgeProfile],
    discrepancy: float,
    families: Sequence[Family],
    others: Sequence[Family] = (),
    steps: Sequence[float] = (),
    *,
    codec: float = 0.0,
    scenes: Sequence[Scene] = SCENES,
) -> list[EdgeFit]:
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
    steps : sequence of float
        Steps of a codec's quantiser for the eight frequencies across an edge (shares of full scale); empty without one.
    codec : float
        Standard deviation of what a codec leaves of a plateau's levels (share of the contrast).
    scenes : sequence of Scene
        What may stand beside the edges; pairs are tried if all may.
    """
    data = EdgeData.of(profiles, steps=steps, discrepancy=discrepancy, codec=codec, is_wide=True)
    coarse = EdgeData.of(profiles, steps=steps, discrepancy=discrepancy, codec=codec, is_wide=True, every=COARSE)
    narrowest = min(edge_width(profile) for profile in profiles)

    plain = [fitted(family, data, data.start()) for family in families]
    fits = [*plain, *_fits(scenes, families, data, coarse, narrowest)]
    best = max(fits, key=lambda fit: fit.log_evidence)
    smoothed = replace(data, by_pixels=True)
    again = [_refitted(best, smoothed), *(fitted(family, smoothed, smoothed.start()) for family in families)]
    if max(fit.log_evidence for fit in again) - best.log_evidence > SMOOTHED_ODDS:
        data, coarse = smoothed, replace(coarse, by_pixels=True)
        fits = [*again, *(_refitted(fit, smoothed) for fit in _possible(fits) if fit is not best)]
    best = max(fits, key=lambda fit: fit.log_evidence)
    if scenes is SCENES and float(np.mean(best.misfit)) > LEAVES_MORE:
        fits += _fits(PAIRS, families[:1], data, coarse, narrowest)
    begun = [fit for fit in _possible(fits) if fit.family is families[0]]
    for fit in begun:
        fits += [fitted(each, data, fit.edges, fit.scene, (np.array(each.mean), fit.beside)) for each in others]
    fits += _less_exact(fits, profiles, discrepancy, steps, codec, by_pixels=data.by_pixels)
    return sorted(fits, key=lambda fit: -fit.log_evidence)


def fit_plain(
    fits: Sequence[EdgeFit],
    profiles: Sequence[EdgeProfile],
    model_error: float,
    steps: Sequence[float] = (),
    codec: float = 0.0,
) -> list[EdgeFit]:
    """Fits with nothing beside the edges, and these again with edges as exact as the models: they tell the tone curve.

    Parameters
    ----------
    fits : sequence of EdgeFit
        Fits of `fit_scenes`.
    model_error : float
        Standard deviation of a bin about the best model, independent of its neighbours (share of the contrast), where
        edges are as exact as the models.
    profiles, steps, codec : sequence of EdgeProfile, sequence of float, float
        See `fit_scenes`.
    """
    plain = sorted((fit for fit in fits if fit.scene is NOTHING), key=lambda fit: fit.log_evidence)
    data = EdgeData.of(profiles, model_error, steps=steps, codec=codec, is_wide=True)
    exact = replace(data, by_pixels=plain[-1].by_pixels)
    again = [_refitted(fit, exact) for fit in {fit.family.name: fit for fit in plain}.values()]
    return sorted([*plain, *again], key=lambda fit: -fit.log_evidence)


def _refitted(fit: EdgeFit, data: EdgeData, most_steps: int = MOST_STEPS) -> EdgeFit:
    """The same fit to other data, which begins where it ended."""
    return fitted(fit.family, data, fit.edges, fit.scene, (fit.parameters, fit.beside), most_steps)


def _less_exact(
    fits: Sequence[EdgeFit],
    profiles: Sequence[EdgeProfile],
    discrepancy: float,
    steps: Sequence[float],
    codec: float,
    *,
    by_pixels: bool,
) -> list[EdgeFit]:
    """The most probable fits and plain edges again, if real edges differ more from the models than usual ones."""
    found: list[EdgeFit] = []
    best = sorted(fits, key=lambda fit: -fit.log_evidence)
    plain = next(fit for fit in best if fit.scene is NOTHING)
    for on_finger in ON_FINGER:
        tried = [*best[:MOST_AGAIN], *([] if plain in best[:MOST_AGAIN] else [plain])]
        for times in DISCREPANCIES:
            is_explained = float(np.mean(tried[0].misfit)) < LEAVES_MORE
            tried = [fit for fit in tried if fit.scene is NOTHING or not is_explained]
            if is_explained and all(float(np.mean(fit.misfit)) < LEAVES_MORE for fit in tried):
                break
            size = 1.0 if on_finger else times
            # A part of what is left is independent from bin to bin, as what the pixels of a sharp edge leave.
            data = EdgeData.of(
                profiles,
                0.0 if on_finger else 0.5 * size * discrepancy,
                steps=steps,
                discrepancy=size * discrepancy,
                texture=times * discrepancy if on_finger else 0.0,
                codec=size * codec,
                is_wide=True,
            )
            data = replace(data, by_pixels=by_pixels)
            tried = sorted(_possible([_refitted(fit, data) for fit in tried]), key=lambda fit: -fit.log_evidence)
            found += [replace(fit, log_evidence=fit.log_evidence - 2.0 * float(np.log(times))) for fit in tried]
    return found


def _possible(fits: Sequence[EdgeFit]) -> list[EdgeFit]:
    """Plain edges, and the fits that are not hopeless beside the most probable one."""
    least = max(fit.log_evidence for fit in fits) - HOPELESS
    return [fit for fit in fits if fit.scene is NOTHING or fit.log_evidence > least]


def _fits(
    scenes: Sequence[Scene], families: Sequence[Family], data: EdgeData, coarse: EdgeData, narrowest_px: float
) -> list[EdgeFit]:
    """Fits of the scenes with each family: of few bins from every start, of all bins where these are not hopeless."""
    begun = []
    for scene in scenes:
        best = max(
            (_begun(scene, own, families[0], coarse, narrowest_px) for own in scene.starts),
            key=lambda fit: fit.log_evidence,
        )
        begun += [
            best,
            *(
                _refitted(replace(best, family=each, parameters=np.array(each.mean)), coarse, FIRST_STEPS)
                for each in families[1:]
            ),
        ]
    return [_refitted(fit, data) for fit in _possible(begun)]


def _begun(scene: Scene, own: tuple[float, ...], family: Family, coarse: EdgeData, narrowest_px: float) -> EdgeFit:
    """First steps of a fit of a scene from one of its starts."""
    start = coarse.start()
    start[0] = np.log(narrowest_px / START_WIDENED)
    begin = np.array(family.mean), np.array(own)
    placed = with_placed_edges(family, coarse, start, scene, begin)
    return fitted(family, coarse, placed, scene, begin, FIRST_STEPS)


def is_more_beside(
    profiles: Sequence[EdgeProfile],
    model_error: float,
    family: Family,
    steps: Sequence[float] = (),
    codec: float = 0.0,
) -> bool:
    """Whether steps of light beside the edges would explain what the fit of a family leaves (score test)."""
    data = with_smoothing(EdgeData.of(profiles, model_error, steps=steps, codec=codec, is_wide=True), [family])
    fit = fitted(family, data, data.start())
    wider = fit.edges[data.own_places()[:, -1]]
    if abs(float(wider[~data.is_outer].mean() - wider[data.is_outer].mean())) > WIDER_INSIDE:
        return True
    k, probes = len(fit.parameters), len(PROBE.mean)
    unknowns = np.concatenate([fit.parameters, np.zeros(probes), fit.edges])
    residual, jacobian = derivatives(family, PROBE, data, unknowns)
    tried, own = jacobian[:, k : k + probes], np.delete(jacobian, np.s_[k : k + probes], axis=1)
    precision = priors(family, NOTHING, data)
    tried = tried / np.linalg.norm(tried, axis=0)
    mixed = own.T @ tried
    taken_up = np.linalg.solve(own.T @ own + precision, mixed)
    # What the fit itself has left to gain is not the scene's.
    own_unknowns = np.concatenate([fit.parameters, fit.edges])
    left = own.T @ residual + precision @ (own_unknowns - prior_mean(family, NOTHING, data))
    variance, axes = np.linalg.eigh(tried.T @ tried - mixed.T @ taken_up)
    is_told = variance > LEAST_TOLD * variance[-1]
    score = (axes.T @ (tried.T @ residual - taken_up.T @ left))[is_told] / np.sqrt(variance[is_told])
    return bool(score @ score > chdtri(np.count_nonzero(is_told), FALSE_ALARMS))
