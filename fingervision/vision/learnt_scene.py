"""Learn what stands beside the edges (side walls, bright lines, shadows) from the straight flanks in some frames."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ndtr

from calib.blurred_step import BlurredStep
from calib.camera_response import CameraResponse
from calib.edge_fit import EdgeFit
from calib.edge_profile import EdgeProfile
from calib.edge_response import UNCOVERED, probabilities
from calib.edge_scene import SCENES, Scene
from calib.scene_fit import fit_plain, fit_scenes, is_more_beside
from calib.tone_curves import Family, family, fixed_family
from fingervision.domain.camera import AddedLight, BesideEdges, Origin, ResponseEstimate
from fingervision.domain.frame import Coding
from fingervision.vision.edge_filters import PIXEL_VARIANCE
from fingervision.vision.flank_profiles import Seen, unclipped_profiles

Floats = NDArray[np.float64]

# Standard deviation of a profile about the best model, independent from bin to bin, as a share of its contrast: optics,
# JPEG of quality 85; what H.264 leaves is another matter (`CODEC_PX`).
MODEL_ERROR = {Coding.LOSSLESS: 0.001, Coding.INTRAFRAME: 0.004, Coding.INTERFRAME: 0.001}
# Standard deviation of a real edge about the best model, smooth over a pixel, as a share of its contrast: optics
# (0.003) with what real walls, lines and shadows differ from the models. What a codec leaves beside it (`CODEC_PX`).
DISCREPANCY, CODEC = 0.004, 0.002
# Steps of the quantiser for the eight frequencies across an edge, as shares of full scale: the luminance table of JPEG
# (ITU-T T.81, annex K.1, first row) at quality 75, the default of most programs, which halves it.
STEPS = {Coding.INTRAFRAME: tuple(0.5 * step / 255.0 for step in (16, 11, 10, 16, 24, 40, 51, 61))}
# Overshoot of an edge (share of its contrast) above which the camera sharpens: sharpening after the tone curve makes
# the profile even in the levels, and so imitates another response at a perfect fit.
MOST_OVERSHOOT = 0.03
# Extent of the profiles beyond the blur (pixels): the light comes back within this distance beside most shadows.
BESIDE_PX = 12.0
# Probability of nothing beside the edges above which nothing is learnt.
SURE = 0.99
# Extent and spacing of the light that is taken off the lines (pixels), and least weight of a fit that contributes.
ADDED_PX, ADDED_EVERY_PX, LEAST_WEIGHT = 30.0, 0.1, 1e-3
# Least standard uncertainty of an alternative (pixels).
LEAST_U_PX = 1e-6
# Standard uncertainty of the logarithm of a tip's blur, in general and where light beside the edges widens it.
U_TIP, U_TIP_LIGHT = 0.15, 0.25


def learnt_beside(
    seen: Sequence[Seen], response: ResponseEstimate, top_level: int, coding: Coding, *, are_dark: bool
) -> BesideEdges | None:
    """What stands beside the edges in some pictures; None if nothing does.

    Parameters
    ----------
    seen : sequence of (ndarray, EdgePoints)
        Pictures turned so that the tips point up, and the steps fitted in them.
    response : ResponseEstimate
        Response of the camera; where it is only assumed, plain edges behind another usual tone curve are a rival.
    top_level : int
        Full scale of the pictures.
    coding : Coding
        Compression of the pictures.
    are_dark : bool
        Whether the fingers are darker than the ground. On light ones, walls alone are known.
    """
    sight, own = FlankSight.of(seen, top_level, coding), fixed_family(response.curve)
    if not are_dark:
        sight, own = sight.inverted(response.curve), family("linear")
    if not sight.is_more_beside(own):
        return None
    is_assumed = response.origin is Origin.ASSUMED and are_dark
    rivals = [family(name) for name in ("linear", "srgb") if is_assumed and name != own.name]
    return told_beside(sight.fits([own, *rivals]), own.name, sight.profiles)


def told_beside(fits: Sequence[EdgeFit], curve: str, profiles: Sequence[EdgeProfile]) -> BesideEdges | None:
    """What stands beside the edges behind one tone curve, if that is more probable than plain edges behind any other.

    Otherwise plain edges stay where they are, and what would displace them is in their uncertainty.

    Parameters
    ----------
    fits : sequence of EdgeFit
        Fits of scenes and tone curves, the most probable first.
    curve : str
        Name of the tone curve that is used.
    profiles : sequence of EdgeProfile
        Profiles of dark fingers.
    """
    same = [fit for fit in fits if fit.family.name == curve]
    beside = beside_edges(same, profiles) if any(fit.scene.name for fit in same) else None
    told = sum(float(p) for p, fit in zip(probabilities(fits), fits, strict=True) if fit.scene.name)
    if beside is None or told > 0.5 or len(same) == len(fits):
        return beside
    return less_sure(None, float(np.hypot(beside.u_gap_px, sum(beside.inner_px))))


@dataclass(frozen=True, slots=True, eq=False)
class FlankSight:
    """The straight flanks with the ground beside them, as some frames show them.

    Parameters
    ----------
    profiles : list of EdgeProfile
        Profiles of dark fingers.
    coding : Coding
        Compression of the pictures.
    discrepancy : float
        Standard deviation of an edge about the best model, smooth over a pixel (share of its contrast).
    blurs_px : (float, float) or None
        Mean blur of inner flanks and of tips, pixel width included (pixels); None if the tips are not known.
    scenes : tuple of Scene
        What may stand beside the edges.
    """

    profiles: list[EdgeProfile]
    coding: Coding
    discrepancy: float
    blurs_px: tuple[float, float] | None = None
    scenes: tuple[Scene, ...] = SCENES

    @classmethod
    def of(cls, seen: Sequence[Seen], top_level: int, coding: Coding) -> "FlankSight":
        """Flanks as frames show them; see `learnt_beside`."""
        profiles = with_structure(unclipped_profiles(seen, top_level, BESIDE_PX), coding)
        flank, tip = np.sqrt(np.mean([edges.blur_px**2 for _, edges in seen], axis=(0, 1)) + PIXEL_VARIANCE)
        # Pixels that share their noise were processed (digital zoom, noise reduction, compression before), which
        # changes the edges as well; the discrepancy of a codec that predicts pictures contains this.
        shared = 1.0 if coding is Coding.INTERFRAME else float(np.median([edges.shared_on_both for _, edges in seen]))
        return cls(profiles, coding, DISCREPANCY * shared, (float(flank), float(tip)))

    def inverted(self, response: CameraResponse) -> "FlankSight":
        """Flanks of light fingers as those of dark ones in the negative of their light."""
        return replace(
            self,
            profiles=[_negative(profile, response) for profile in self.profiles],
            scenes=tuple(scene for scene in SCENES if scene.name in ("", "wall")),
        )

    @property
    def codec(self) -> float:
        """Standard deviation of what a codec leaves of a plateau's levels (share of the contrast)."""
        return 0.0 if self.coding is Coding.LOSSLESS else CODEC

    @property
    def can_tell(self) -> bool:
        """Whether both inner flanks and an outer one are in view: a wall is told by the flanks that do not show it.

        A camera that sharpens its pictures draws lines beside the edges itself.
        """
        inner = sum(not profile.is_outer for profile in self.profiles)
        return inner == 2 and len(self.profiles) > inner and overshoot(self.profiles) < MOST_OVERSHOOT

    def is_more_beside(self, family: Family) -> bool:
        """Whether the edges show more than steps of light behind this tone curve."""
        return self.can_tell and is_more_beside(
            self.profiles, MODEL_ERROR[Coding.LOSSLESS], family, STEPS.get(self.coding, ()), self.codec
        )

    def fits(self, families: Sequence[Family], others: Sequence[Family] = ()) -> list[EdgeFit]:
        """Fits of all scenes with the evidence of the tips, the most probable first; see `fit_scenes`.

        A wall is not seen at the tip, and motion does not widen it; shadows and bright lines are seen there as well, if
        not equally.
        """
        fits = fit_scenes(
            self.profiles,
            self.discrepancy,
            families,
            others,
            STEPS.get(self.coding, ()),
            codec=self.codec,
            scenes=self.scenes,
        )
        if self.blurs_px is None:
            return fits
        flank, tip = self.blurs_px
        sigma, disc = np.exp(fits[0].shared[:2])
        optics = float(np.sqrt(sigma**2 * (1.0 + 0.25 * disc**2) + PIXEL_VARIANCE))
        on_tip, elsewhere = (
            -0.5 * float(np.log(tip / expected) / u) ** 2 - float(np.log(u))
            for expected, u in ((flank, U_TIP_LIGHT), (optics, U_TIP))
        )
        found = [
            replace(fit, log_evidence=fit.log_evidence + (on_tip if fit.scene.is_on_tip else elsewhere)) for fit in fits
        ]
        return sorted(found, key=lambda fit: -fit.log_evidence)

    def plain(self, fits: Sequence[EdgeFit]) -> list[EdgeFit]:
        """Fits of a tone curve alone, the most probable first; see `fit_plain`."""
        return fit_plain(fits, self.profiles, MODEL_ERROR[Coding.LOSSLESS], STEPS.get(self.coding, ()), self.codec)


def _negative(profile: EdgeProfile, response: CameraResponse) -> EdgeProfile:
    light = np.interp(profile.level, response.level, response.light)
    slope = np.interp(profile.level, response.level, np.gradient(response.light, response.level))
    u, structure = slope * profile.u_level, slope * profile.u_structure if profile.u_structure.size else np.zeros(0)
    return EdgeProfile(
        -profile.away_px[::-1], 1.0 - light[::-1], u[::-1], -profile.side, profile.is_outer, structure[::-1]
    )


def overshoot(profiles: Sequence[EdgeProfile]) -> float:
    """How far edges overshoot their plateaus, as a camera that sharpens makes them (share of the contrast)."""
    return float(np.median([profile.overshoot for profile in profiles]))


def with_structure(profiles: Sequence[EdgeProfile], coding: Coding) -> list[EdgeProfile]:
    """Profiles with what lies on the edges; without it after a lossy codec, whose blocks are as long as their parts.

    What an edge has of it may be hidden by its noise: it has as much as all have in the mean, or its own.
    """
    known = [profile for profile in profiles if profile.u_structure.any()]
    if coding is not Coding.LOSSLESS or not known:
        return [replace(profile, u_structure=np.zeros(0)) for profile in profiles]

    def with_mean(profile: EdgeProfile) -> EdgeProfile:
        each = [np.interp(profile.away_px, one.away_px, one.u_structure**2 / one.contrast**2) for one in known]
        mean = profile.contrast * np.sqrt(np.sum(each, axis=0) / len(profiles))
        own = profile.u_structure if profile.u_structure.size else 0.0
        return replace(profile, u_structure=np.maximum(own, mean))

    return [with_mean(profile) for profile in profiles]


def beside_edges(fits: Sequence[EdgeFit], profiles: Sequence[EdgeProfile]) -> BesideEdges | None:
    """Mean over fits of one tone curve by their evidence; None if nothing is there, or nothing known explains it."""
    misfit = max(float(np.mean(fits[0].misfit)), 1.0)
    evidence = np.array([fit.log_evidence / misfit + np.log(fit.scene.probability) for fit in fits])
    weight = np.exp(evidence - evidence.max())
    weight /= weight.sum()
    nothing = sum(float(w) for w, fit in zip(weight, fits, strict=True) if not fit.scene.name)
    if nothing > SURE:
        return None
    best = max(zip(weight, fits, strict=True), key=lambda each: each[0] * bool(each[1].scene.name))[1]
    side = np.array([profile.side for profile in profiles])
    is_outer = np.array([profile.is_outer for profile in profiles])
    # The ground lies to the right of the left finger's inner edge and of the right finger's outer one.
    finger = np.where((side > 0.0) == ~is_outer, 0, 1)
    place = {(int(k), bool(o)): i for i, (k, o) in enumerate(zip(finger, is_outer, strict=True))}
    at = np.array([fit.at_px for fit in fits])
    far = np.array([fit.at_px + fit.outline_px(side, is_outer) for fit in fits])

    def mean(values: Floats, is_outer: bool) -> tuple[float, float]:
        left, right = (float(weight @ values[:, place[k, is_outer]]) if (k, is_outer) in place else 0.0 for k in (0, 1))
        return left, right

    def u_sum(values: Floats) -> float:
        ends = [place[0, False], place[1, False]]
        sums = values[:, ends].sum(axis=1)
        own = np.array([misfit * fit.at_covariance[np.ix_(ends, ends)].sum() for fit in fits])
        own += np.array([(fit.scene.u_form * np.abs(fit.at_px[ends]).sum()) ** 2 for fit in fits])
        return _covering_u(sums - weight @ sums, np.sqrt(own), weight)

    inner, outer = mean(at, False), mean(at, True)
    # A wall or a light from one side displaces the sides that show it, and what all sides have in common also the tips.
    common = np.zeros_like(at)
    for own, fit in zip(common, fits, strict=True):
        if fit.scene.name == "wall":
            continue
        ends = [
            [fit.at_px[i] for (k, outer), i in place.items() if k == finger and (outer or not fit.scene.has_wall)]
            for finger in (0, 1)
        ]
        own[[place[0, False], place[1, False]]] = [min(each, key=abs, default=0.0) for each in ends]
    name = best.scene.name
    return BesideEdges(
        name,
        float(sum(w for w, fit in zip(weight, fits, strict=True) if fit.scene.name == name)),
        inner,
        outer,
        mean(far, False),
        mean(common, False),
        u_sum(at),
        u_sum(far),
        _added(fits, weight, side, is_outer, place) if best.scene.is_all_round else None,
    )


def _added(
    fits: Sequence[EdgeFit],
    weight: Floats,
    side: Floats,
    is_outer: NDArray[np.bool_],
    place: dict[tuple[int, bool], int],
) -> AddedLight:
    """Mean light that those fits add to a finger's own step which add it all round."""
    away = np.arange(-ADDED_PX, ADDED_PX, ADDED_EVERY_PX)
    total, width, seen = np.zeros((side.size, away.size)), 0.0, 0.0
    for fit, own in zip(fits, weight, strict=True):
        if not fit.scene.is_all_round or own < LEAST_WEIGHT:
            continue
        at, share = (each[0] for each in fit.scene.steps(fit.beside[None], side, is_outer))
        step = BlurredStep.of(fit.shared, fit.by_pixels)
        blurred, _ = step.at(side[:, None, None] * (away[:, None] - at[:, None]))
        alone, _ = step.at(side[:, None] * away)
        blurred, alone = 0.5 + side[:, None, None] * (blurred - 0.5), 0.5 + side[:, None] * (alone - 0.5)
        total += own * (np.einsum("ebn,en->eb", blurred, share) - alone)
        width += own * float(np.exp(fit.shared[0]) * np.sqrt(1.0 + 0.25 * np.exp(2.0 * fit.shared[1])))
        seen += own
    total /= seen
    # The zero of a profile is the left finger's inner edge with outward light, and the right one's mirrored.
    flanks = [
        [total[place[k, outer]] if (k, outer) in place else total[place[k, False]] for outer in (False, True)]
        for k in (0, 1)
    ]
    shares = np.array([[inner, outer, 0.5 * (inner + outer)] for inner, outer in flanks])
    return AddedLight(away, shares, width / seen)


def u_of_rivals_px(
    fits: Sequence[EdgeFit], used: Sequence[EdgeFit], profiles: Sequence[EdgeProfile], curve: str
) -> float:
    """Standard uncertainty of the gap, because something beside the edges with another tone curve explains them too.

    Parameters
    ----------
    fits : sequence of EdgeFit
        Fits of scenes and tone curves.
    used : sequence of EdgeFit
        Fits that told the tone curve.
    profiles : sequence of EdgeProfile
        Profiles of dark fingers.
    curve : str
        Name of the tone curve that is used.
    """
    inner = ~np.array([profile.is_outer for profile in profiles])
    probability, weight = probabilities(fits), probabilities(used)
    own = [(p, fit.at_px[inner].sum()) for p, fit in zip(weight, used, strict=True) if fit.family.name == curve]
    rivals = [(p, fit) for p, fit in zip(probability, fits, strict=True) if fit.family.name != curve and fit.scene.name]
    if not own or not rivals:
        return 0.0
    at = float(np.average([each for _, each in own], weights=[max(p, 1e-300) for p, _ in own]))
    away = np.array([fit.at_px[inner].sum() - at for _, fit in rivals])
    u_px = np.sqrt([fit.at_covariance[np.ix_(inner, inner)].sum() for _, fit in rivals])
    return _u_beside(away, u_px, np.array([p for p, _ in rivals]))


def _covering_u(away: Floats, own: Floats, probability: Floats) -> float:
    """Half of what 95 % of the probability of alternatives lies within, about their mean.

    Few alternatives far apart are no normal distribution: their standard deviation neither covers the farther ones nor
    says how sure the others are (JCGM 101:2008, 5.3.4: coverage interval). Each has its own standard uncertainty.
    """
    own = np.maximum(own, LEAST_U_PX)

    def beyond(half_px: float) -> float:
        return float(probability @ (ndtr((away - half_px) / own) + ndtr((-away - half_px) / own))) - UNCOVERED

    return 0.5 * float(brentq(beyond, 0.0, np.max(np.abs(away) + 10.0 * own)))


def _u_beside(away: Floats, own: Floats, probability: Floats) -> float:
    """Standard deviation of rivals about a value that is kept; half of where one lies that is not excluded by 20:1."""
    ends = np.abs(away) + 2.0 * own
    order = np.argsort(ends)[::-1]
    farthest = ends[order][np.cumsum(probability[order]) > UNCOVERED]
    deviation = float(np.sqrt(probability @ (away**2 + own**2)))
    return max(deviation, 0.5 * float(farthest[0])) if farthest.size else deviation


def less_sure(beside: BesideEdges | None, u_px: float) -> BesideEdges | None:
    """What stands beside the edges, with a further uncertainty of the gap; nothing with it where nothing is known."""
    if not u_px:
        return beside
    nowhere = (0.0, 0.0)
    known = beside or BesideEdges("", 0.0, nowhere, nowhere, nowhere, nowhere, 0.0, 0.0)
    return replace(
        known,
        u_gap_px=float(np.hypot(known.u_gap_px, u_px)),
        u_outline_px=float(np.hypot(known.u_outline_px, u_px)),
    )
