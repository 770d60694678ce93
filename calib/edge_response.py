"""Camera response from the shape of straight edges: the evidence for families of tone curves.

The optics and the pixels blur light, and a symmetric blur gives an edge whose profile is odd about the edge in light,
but not in the stored levels. Profiles of several edges are fitted at once, in light, for every family of tone curves;
the evidence of each fit by Laplace's method (MacKay 2003, Information Theory, Inference and Learning Algorithms,
chapter 27) gives the probability of the family. A single family with free parameters would not do: the curve
F(l) = Phi(Phi^-1(l) + d) turns an edge into the same edge displaced by d sigma, so that the smoothness of few families
decides, and the quality of the fit does not. The side of a tail of the optics is fixed in the picture, while that of a
tone curve is fixed to the dark side of each edge.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calib.camera_response import CameraResponse
from calib.edge_fit import EdgeData, EdgeFit, fitted, with_smoothing
from calib.edge_profile import EdgeProfile
from calib.tone_curves import FAMILIES, LEVELS, Family, curve_response, family

Floats = NDArray[np.float64]

# Prior probability of a linear camera; the other families share the rest. Machine vision cameras are linear, others
# are not.
LINEAR_PRIOR = 0.5
# Least probability of a family that counts, and probability from which nothing else is averaged with a standard curve.
LEAST_PROBABILITY, CERTAIN = 1e-3, 0.99
# Probability of what may lie beyond two standard uncertainties, and weight with which they reach a single alternative.
UNCOVERED, REACHED = 0.05, 0.25


def fit_families(
    profiles: Sequence[EdgeProfile],
    model_error: float,
    scale: float = 1.0,
    tagged: str = "",
    steps: Sequence[float] = (),
    codec: Sequence[float] = (0.0,),
) -> list[EdgeFit]:
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
    codec : sequence of float
        Standard deviations of what a codec leaves of a plateau's levels (shares of the contrast), all as probable.
    """
    families = list(FAMILIES)
    if tagged and all(each.name != tagged for each in FAMILIES):
        families.append(family(tagged))
    fits = [
        fit for each in codec for fit in _fits(EdgeData.of(profiles, model_error, scale, steps, codec=each), families)
    ]
    return sorted(fits, key=lambda fit: -fit.log_evidence)


def _fits(data: EdgeData, families: Sequence[Family]) -> list[EdgeFit]:
    """Fit of every family to the same data."""
    data = with_smoothing(data, [each for each in families if not each.mean])
    fits: list[EdgeFit] = []
    for each in families:
        # Edges and optics are nearly the same for all curves, but there are several optima: a curve with parameters
        # begins where the best one has ended, and the best one that is curved.
        curved = [fit for fit in fits if fit.family.name != "linear"]
        begun = [max(of, key=lambda fit: fit.log_evidence) for of in (fits, curved)] if each.mean else []
        starts = {id(fit): fit.edges for fit in begun}.values() or [data.start()]
        found = [fitted(each, data, start) for start in starts]
        fits.append(max(found, key=lambda fit: fit.log_evidence))
    return fits


def probabilities(fits: Sequence[EdgeFit]) -> Floats:
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
    def of(cls, fits: Sequence[EdgeFit]) -> "ResponsePosterior":
        """Average over families, and over the parameters of each."""
        best: dict[str, tuple[EdgeFit, float]] = {}
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
        others = _covering(curve, [(fit.response(), p) for fit, p in likely if fit.response() is not curve])
        return cls(curve, (*others, *((other, p) for fit, p in likely for other in fit.one_sigma())))


def _covering(used: CameraResponse, others: list[tuple[CameraResponse, float]]) -> list[tuple[CameraResponse, float]]:
    """Weights of other curves, of which one is so far away that the others beyond it are hardly ever true.

    The variance of a few alternatives does not reach an improbable one (JCGM 101:2008, 5.3.4: coverage interval).
    """

    def half(curve: CameraResponse) -> float:
        return float(np.interp(0.5, curve.level, curve.light))

    def away(each: tuple[CameraResponse, float]) -> float:
        return -abs(half(each[0]) - half(used))

    others, beyond = sorted(others, key=away), 0.0
    for place, (other, p) in enumerate(others):
        beyond += p
        if beyond > UNCOVERED:
            return [*others[:place], (other, max(p, REACHED)), *others[place + 1 :]]
    return others
