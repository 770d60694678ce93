"""Learn a camera's response and point spread from the straight flanks in some frames of a recording."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calib.camera_response import CURVES, standard_response
from calib.edge_fit import EdgeFit
from calib.edge_profile import EdgeProfile
from calib.edge_response import ResponsePosterior, fit_families, probabilities
from calib.tone_curves import family
from fingervision.domain.camera import (
    CameraModel,
    CameraQuantity,
    Origin,
    OtherResponse,
    PointSpread,
    ResponseEstimate,
)
from fingervision.domain.frame import Coding
from fingervision.vision.flank_profiles import Seen, unclipped_profiles
from fingervision.vision.learnt_scene import (
    MODEL_ERROR,
    MOST_OVERSHOOT,
    STEPS,
    SURE,
    FlankSight,
    less_sure,
    overshoot,
    told_beside,
    u_of_rivals_px,
    with_structure,
)

# Ratio of the residuals to their uncertainty above which no family explains the edges.
MOST_MISFIT = 1.3
# Negative share of the point spread's tails from which the camera sharpens: no optics takes light away.
NEGATIVE_TAILS = 0.08
# Share of a curve's displacement of an edge that is added to the uncertainty for curves of no family: their error in
# recordings of log, film and S-curves (tests/benchmarks/unknown_cameras.py).
FOREIGN_CURVE = {Coding.LOSSLESS: 0.08, Coding.INTRAFRAME: 0.15, Coding.INTERFRAME: 0.15}
# What codecs leave on an edge (see `EdgeData`), from the finest to the coarsest.
CODECS = (0.0005, 0.001, 0.002, 0.004, 0.008)
# Probability of nothing beside the edges below which a tone curve does not explain them alone (20:1).
UNLIKELY = 0.05
REMEDY = "calibrate with bars of three widths, give the curve with --response, or switch the picture profile off"
NO_FLANKS = (
    "The camera's response could not be learnt, because no straight flank of a finger shows both its plateaus "
    f"unclipped and with enough contrast: u_shift_px contains another usual response. Lower the exposure, or {REMEDY}."
)
SHARPENED = (
    "The camera sharpens its pictures (its point spread has negative tails, {share:.0%} of the light), which hides its "
    "tone curve: nothing is corrected, and u_shift_px contains a usual tone curve. Switch sharpening off, or "
    f"{REMEDY}."
)
MISFIT = (
    "The shape of the edges is that of no usual tone curve (the residuals are {misfit:.1f} times their uncertainty), "
    f"as after local tone mapping: nothing is corrected, and u_shift_px contains a usual tone curve; {REMEDY}."
)


def learnt_camera(
    seen: Sequence[Seen], prior: CameraModel, top_level: int, coding: Coding, *, are_dark: bool = False
) -> CameraModel:
    """Camera with the response and the point spread that straight flanks show.

    Parameters
    ----------
    seen : sequence of (ndarray, EdgePoints)
        Pictures turned so that the tips point up, and the edges fitted in them.
    prior : CameraModel
        The camera before; its response is kept if it is known.
    top_level : int
        Full scale of the pictures.
    coding : Coding
        Compression of the pictures.
    are_dark : bool
        Whether the fingers are surely darker than the ground, so that what stands beside their edges can be told.

    Returns
    -------
    CameraModel
        The prior with a learnt response; or with the assumed one and a sentence on why it could not be learnt.
    """
    sight = FlankSight.of(seen, top_level, coding) if are_dark else None
    return learnt_from_profiles(unclipped_profiles(seen, top_level), prior, coding, sight)


def learnt_from_profiles(
    profiles: list[EdgeProfile], prior: CameraModel, coding: Coding, sight: FlankSight | None = None
) -> CameraModel:
    """Camera as the mean profiles of unclipped flanks show it, also with more of the ground; see `learnt_camera`."""
    if not profiles:
        return _not_learnt(prior, NO_FLANKS, 1.0 / 3.0)
    profiles = with_structure(profiles, coding)
    beyond = overshoot(profiles)
    prior = replace(prior, sharpening=CameraQuantity(beyond, MODEL_ERROR[coding], Origin.LEARNT))
    if beyond > MOST_OVERSHOOT:
        return _not_learnt(prior, SHARPENED.format(share=beyond), 1.0)
    assumed = prior.response.curve
    fits, misfit = _fitted(profiles, coding, assumed.name if assumed.name in CURVES else "")
    # With a stated response, what stands beside the edges is learnt by itself (`learnt_scene`).
    is_known = prior.response.is_known
    scenes, bare = ([], 1.0) if is_known or sight is None else _with_scenes(fits, sight)
    if bare < UNLIKELY:
        fits, misfit = scenes, _misfit(scenes)
    if misfit > MOST_MISFIT:
        return _not_learnt(prior, MISFIT.format(misfit=misfit), 1.0)
    best = fits[0]
    tails, u_tails = float(best.shared[2:4].sum()), float(np.hypot(*best.u_shared[2:4]))
    if tails < -max(NEGATIVE_TAILS, 2.0 * u_tails):
        return _not_learnt(prior, SHARPENED.format(share=-tails), 1.0)
    camera = replace(
        prior,
        point_spread=_point_spread(best),
        discrepancy=CameraQuantity(
            max(misfit, 1.0) * float(np.hypot(MODEL_ERROR[coding], best.codec)), None, Origin.LEARNT
        ),
    )
    used = _alike(scenes, sight) if scenes and sight is not None else fits
    if not is_known:
        camera = _with_response(camera, used, coding)
    if bare > SURE or sight is None:
        return camera
    if camera.response.curve is assumed:
        camera = replace(camera, beside=told_beside(scenes, assumed.name, sight.profiles))
    u_px = u_of_rivals_px(scenes, used, sight.profiles, camera.response.curve.name)
    return replace(camera, beside=less_sure(camera.beside, u_px))


def _alike(fits: Sequence[EdgeFit], sight: FlankSight) -> Sequence[EdgeFit]:
    """Fits with something beside the edges, or without, whatever is more probable.

    The mean of a curve that explains the edges alone and of one that needs something beside them explains nothing.
    """
    told = sum(float(p) for p, fit in zip(probabilities(fits), fits, strict=True) if fit.scene.name)
    return [fit for fit in fits if fit.scene.name] if told > 0.5 else sight.plain(fits)


def _with_response(camera: CameraModel, fits: Sequence[EdgeFit], coding: Coding) -> CameraModel:
    """Camera with the response of the fits."""
    white, response = camera.response.curve.white, _response(fits, coding)
    if response.curve.white != white:  # a video of studio range stays clipped at its white
        response = replace(response, curve=replace(response.curve, white=white))
    return replace(camera, response=response)


def _fitted(profiles: list[EdgeProfile], coding: Coding, tagged: str) -> tuple[list[EdgeFit], float]:
    """Fits of all flanks; of the outer ones alone if the inner ones, which side walls spoil, do not agree with them.

    What a codec has lost is inferred only where the optics nearly explain the edges: a coarser quantiser than that of
    `STEPS` shows as a misfit.
    """
    codec = CODECS if coding is Coding.INTERFRAME else (0.0,)
    fits = fit_families(profiles, MODEL_ERROR[coding], tagged=tagged, codec=codec)
    misfit = _misfit(fits)
    outer = [profile for profile in profiles if profile.is_outer]
    if misfit > MOST_MISFIT and 0 < len(outer) < len(profiles):
        profiles = outer
        fits = fit_families(profiles, MODEL_ERROR[coding], tagged=tagged, codec=codec)
        misfit = _misfit(fits)
    if misfit <= MOST_MISFIT and coding in STEPS:
        fits = fit_families(profiles, MODEL_ERROR[coding], tagged=tagged, steps=STEPS[coding])
        misfit = _misfit(fits)
    return fits, misfit


def _with_scenes(fits: Sequence[EdgeFit], sight: FlankSight) -> tuple[list[EdgeFit], float]:
    """Fits with what may stand beside the edges, and the probability of nothing; none if nothing explains the edges."""
    # A tone curve with free parameters imitates what stands beside the edges.
    if not sight.can_tell or not (fits[0].parameters.size or sight.is_more_beside(fits[0].family)):
        return [], 1.0
    always = [family("linear"), family("srgb")]
    found = sight.fits(always, list(dict.fromkeys(fit.family for fit in fits if fit.family not in always)))
    bare = sum(float(p) for p, fit in zip(probabilities(found), found, strict=True) if not fit.scene.name)
    return ([], 1.0) if _misfit(found) > MOST_MISFIT else (found, bare)


def _misfit(fits: Sequence[EdgeFit]) -> float:
    return float(np.sqrt(np.mean(fits[0].misfit)))


def _response(fits: Sequence[EdgeFit], coding: Coding) -> ResponseEstimate:
    """Response of the fits, with what they leave open and what they do not know."""
    found = ResponsePosterior.of(fits)
    others = [OtherResponse(other, weight) for other, weight in found.others]
    if found.curve is not standard_response("linear"):
        others.append(OtherResponse(standard_response("linear"), FOREIGN_CURVE[coding] ** 2))
    if coding is Coding.INTERFRAME:
        # Such a codec takes from an edge the detail in which a tone curve shows: the true one may be anything between
        # the learnt one and the usual one (a rectangular distribution, JCGM 100:2008, 4.3.7).
        others.append(OtherResponse(standard_response("srgb"), 1.0 / 3.0))
    return ResponseEstimate(found.curve, tuple(others), Origin.LEARNT)


def _point_spread(fit: EdgeFit) -> PointSpread:
    sigma, disc, length = (float(np.exp(fit.shared[j])) for j in (0, 1, 4))
    known = CameraQuantity(sigma, sigma * float(fit.u_shared[0]), Origin.LEARNT)
    return PointSpread(known, sigma * disc, (float(fit.shared[2]), float(fit.shared[3])), sigma * length)


def _not_learnt(prior: CameraModel, words: str, weight: float) -> CameraModel:
    """Prior camera with a sentence; a camera that processes its pictures surely has a tone curve (weight 1)."""
    if prior.response.is_known:
        return prior
    others = tuple(replace(other, weight=max(other.weight, weight)) for other in prior.response.others)
    return replace(prior, response=replace(prior.response, others=others, words=words))
