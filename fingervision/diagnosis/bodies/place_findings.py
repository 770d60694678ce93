"""Candidates with their fitted sizes, and the result of the search for a faulty place."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.bodies.channel_noise import ChannelNoise
from fingervision.diagnosis.bodies.place_candidates import Candidate

Array = NDArray[np.float64]

FORM_ERROR = 0.01
"""Relative standard uncertainty of a size due to the form of its explanation: condensed bodies and lumped flexures
compared with finite elements of the changed outline (`python -m tests.benchmarks.which_hinge`), where plays are 0.2 to
1.2 % and lengths up to 0.8 % wrong. Errors of hinge stiffness, slopes and scale have regressors (`place_nuisances`)."""


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A candidate with its fitted size.

    Parameters
    ----------
    candidate : Candidate
        The candidate explanation.
    size, u : float
        Fitted size with its standard uncertainty from noise and nuisance parameters.
    gain : float
        Reduction of chi-square.
    signature : ndarray of float
        Explained change, whitened and orthogonal to the nuisance parameters.
    """

    candidate: Candidate
    size: float
    u: float
    gain: float
    signature: Array

    @property
    def u_stated(self) -> float:
        """Standard uncertainty of the size, including the inexactness of the effect's formula."""
        return hypot(self.u, FORM_ERROR * self.size)


@dataclass(frozen=True, slots=True, eq=False)
class PlaceFindings:
    """Result of the search for a faulty place.

    Parameters
    ----------
    members : tuple of Fitted
        The best explanation and all explanations that the data cannot distinguish from it; empty if there is nothing to
        explain.
    limit : float
        Reduction of chi-square required for a claim.
    structure : float
        Chi-square of generic shapes in the residual of the best explanation, if significant; otherwise 0.
    smallest : dict of str to (Candidate, float)
        Detection limit of every candidate.
    noise : ChannelNoise
        Joint noise of all channels.
    before, after : ndarray of float, shape (n, channels)
        Residuals without and with the best explanation, with constants and the drawing's position in the picture
        fitted.
    """

    members: tuple[Fitted, ...]
    limit: float
    structure: float
    smallest: dict[str, tuple[Candidate, float]]
    noise: ChannelNoise
    before: Array
    after: Array


def apart(truth: Fitted, other: Fitted) -> float:
    """Squared whitened distance of one explanation from another, minimised over the size of the other explanation."""
    norm = float(other.signature @ other.signature)
    if norm <= 0.0:
        return float(truth.signature @ truth.signature)
    shared = float(truth.signature @ other.signature) ** 2 / norm
    return float(truth.signature @ truth.signature) - shared


def smallest_sizes(fitted: Sequence[Fitted], limit: float) -> dict[str, tuple[Candidate, float]]:
    """Detection limit of every candidate: the smallest size whose gain in chi-square reaches the limit."""
    found: dict[str, tuple[Candidate, float]] = {}
    for each in fitted:
        size = float(np.sqrt(limit)) * each.u
        key = each.candidate.key
        if np.isfinite(size) and (key not in found or size < found[key][1]):
            found[key] = each.candidate, size
    return found
