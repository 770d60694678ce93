"""Search for the hinge, link or pivot that explains poses and gap, and for indistinguishable alternatives."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from fingervision.diagnosis.bodies.body_prediction import FORCE, BodyPrediction
from fingervision.diagnosis.bodies.channel_noise import ChannelNoise, channel_noise
from fingervision.diagnosis.bodies.place_candidates import PAIRS, Candidate, candidates_of, mirror_of, mirrored_channels
from fingervision.domain.drawing_form import DrawnPart

Array = NDArray[np.float64]

SLOPE_ERROR, OWN_SLOPE_ERROR = 1e-4, 3e-5
"""Relative model error of a drawing's lumped response in any channel, as a share of the largest slope with the same
unit; and the part of this error that is not shared with the mirror image of the channel. Compared with finite elements,
poses of the published sample are within 5e-5, and its halves agree to 2e-6 (`tests/models/test_body_poses.py` tests
3e-4 for every drawing)."""
FORCE_SLOPE_ERROR = 0.05
"""Relative uncertainty of the force: the modulus of a printed or rolled sheet is not known better (mechanics.md,
section 5)."""
BY_EDGES = 3.0
"""Prior standard deviation of the coefficient of `BodyPrediction.by_edges`: it is 0 for poses of the bodies' areas, 1
for poses from all straight edges, and may be two or three for poses from those edges that a picture shows. The table
does not say which applies."""
HINGE_ERROR, OWN_HINGE_ERROR = 0.01, 0.003
"""Relative errors of a hinge's stiffness: of the hinge tables compared with brick elements, including the root in the
body (`models/README.md`); and the part not shared with the hinge's mirror image."""
SCALE_ERROR = 3e-4
"""Relative uncertainty of the picture's scale, from a reference of 2 mm known to a micrometre and its edges
(measuring.md)."""
ALIKE = 12.0
"""Squared whitened distance below which two explanations count as indistinguishable, as in
`inference/ambiguity_set`."""
NOT_REFUTED = 6.0
"""Increase of chi-square over the best explanation below which the data do not reject an explanation (Cox, 1961)."""
FALSE_CLAIMS = 0.02
"""False positive rate: share of tables with noise alone in which the largest gain exceeds the threshold."""
DRAWS = 4000
"""Draws of noise: the 98 % quantile is then the eightieth largest, and known to a ninth of the tail's probability."""
REFINED = 0.25
"""Gain relative to the largest one below which a candidate is not refined."""
STRUCTURE = 1e-3
"""Significance level below which the residual of an explanation contains structure."""
STRUCTURE_SHARE = 0.05
"""Structure relative to the explained part that is attributed to the inexact form of the explanation (`STANDING_SHARE`
for the gap)."""
FORM_ERROR = 0.03
"""Relative standard uncertainty of a size due to the form of its explanation: condensed bodies and lumped flexures
compared with finite elements of the changed outline, where estimated plays are up to 4 % and lengths up to 3 % wrong; 2
% covered 84 % of 56 plays (`python -m tests.benchmarks.which_hinge` prints the coverage)."""
PLAYS_MM = np.geomspace(0.002, 0.5, 25)
"""Plays that are tried: from a fifteenth of a pixel at 34 px/mm to the catalogue's bound, a quarter apart."""
STEPS = 4
"""Refinements of a size: each changes it by 1.4 at most, so that four cover the quarter between two plays tried."""


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
        """Standard uncertainty of the fitted size, including the inexactness of the explanation's formula."""
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


class PlaceSearch:
    """Compares poses and other measured channels with the drawing, and fits candidates to the difference.

    Parameters
    ----------
    prediction : BodyPrediction
        The drawing over the inputs of the table.
    measured : ndarray of float, shape (n, channels)
        Measured values.
    runs : tuple of slice
        Rows of each run.
    floors : ndarray of float, shape (channels,)
        Least noise of each channel.
    timed : bool
        Whether the rows are in order of time.
    """

    def __init__(
        self, prediction: BodyPrediction, measured: Array, runs: tuple[slice, ...], floors: Array, *, timed: bool
    ) -> None:
        self.prediction, self.measured, self.runs = prediction, measured, runs
        self.residual = measured - prediction.drawn
        self.noise = channel_noise(self.residual, prediction.input_mm, runs, floors, timed=timed)
        self.candidates = candidates_of(prediction)
        self._nuisances()
        self._left = self._beside(self.noise.whitened(self.residual))

    def _nuisances(self) -> None:
        """Regressors of the nuisance parameters, with prior standard deviations (infinite without prior knowledge)."""
        prediction, columns, spread = self.prediction, [], []
        n, count = self.residual.shape
        slopes = prediction.linear().by_input[[prediction.answers.channels.index(c) for c in prediction.channels]]
        twins = mirrored_channels(prediction)
        for channel, name in enumerate(prediction.channels):
            for run in self.runs:
                own = np.zeros((n, count))
                own[run, channel] = 1.0
                columns.append(own)
                spread.append(np.inf)
            largest = [abs(s) for s, c in zip(slopes, prediction.channels, strict=True) if c[-4:] == name[-4:]]
            size = (FORCE_SLOPE_ERROR if name == FORCE else SLOPE_ERROR) * max(largest)
            twin, sign = twins.get(name, (name, 1.0))
            own = np.zeros((n, count))
            own[:, channel] = prediction.input_mm
            if twin != name:
                columns.append(own)
                spread.append(OWN_SLOPE_ERROR / SLOPE_ERROR * size)
                own = own.copy()
                own[:, prediction.channels.index(twin)] = sign * prediction.input_mm
            if name <= twin:
                columns.append(own)
                spread.append(size)
        is_mm = np.array([name.endswith("_mm") for name in prediction.channels])
        columns += [prediction.bent, prediction.drawn * is_mm]
        spread += [np.inf, SCALE_ERROR]
        if np.any(prediction.by_edges):
            columns.append(prediction.by_edges)
            spread.append(BY_EDGES)
        turned = prediction.turned()
        if np.any(turned):
            columns.append(turned)
            spread.append(np.inf)
        mirrored = mirror_of(prediction)
        hinges = {c.place: c.added(c.reference) / c.reference for c in self.candidates if c.part is DrawnPart.HINGE}
        for hinge, own in hinges.items():
            twin = mirrored(hinge)
            if twin != hinge and twin in hinges:
                columns.append(own)
                spread.append(OWN_HINGE_ERROR)
                own = own + hinges[twin]
            if hinge <= twin:
                columns.append(own)
                spread.append(HINGE_ERROR)
        whitened = np.array([self.noise.whitened(column) for column in columns]).T
        size = np.maximum(np.linalg.norm(whitened, axis=0), 1e-300)
        bounded = np.array([0.0 if not np.isfinite(s) else 1.0 / s for s in spread])
        self._columns, self._unit = columns, size
        self._is_free = [not np.isfinite(s) for s in spread]
        stacked = np.vstack([whitened / size, np.diag(bounded / size)])
        self._basis, self._triangle = np.linalg.qr(stacked)
        self._rows = whitened.shape[0]

    def _beside(self, signal: Array) -> Array:
        """Project a whitened signal on the space orthogonal to the nuisance parameters."""
        padded = np.concatenate([signal, np.zeros(self._basis.shape[0] - signal.size)])
        return np.asarray(padded - self._basis @ (self._basis.T @ padded))

    def _unknown_part(self, rows: Array) -> Array:
        """Fit the nuisance parameters to a residual, and return the fitted constants, rotation and bend only.

        The result has shape (n, channels).

        Possible model errors are fitted too but are not returned, because they may be the disagreement that is searched
        for.
        """
        padded = np.concatenate([self.noise.whitened(rows), np.zeros(self._basis.shape[0] - self._rows)])
        shares = np.linalg.lstsq(self._triangle, self._basis.T @ padded, rcond=None)[0] / self._unit
        free = [s * column for s, column, is_free in zip(shares, self._columns, self._is_free, strict=True) if is_free]
        return np.asarray(np.sum(free, axis=0))

    def signature(self, candidate: Candidate, size: float) -> Array:
        """Whitened change of the prediction by a candidate of a given size, orthogonal to the nuisance parameters."""
        return self._beside(self.noise.whitened(candidate.added(size)))

    def fit(self, candidate: Candidate) -> Fitted:
        """Fit a candidate's size to the residual, using its signature at the reference size."""
        left = self._left
        if candidate.part is DrawnPart.PIVOT:
            return self._fit_play(candidate)
        unit = self.signature(candidate, candidate.reference) / candidate.reference
        return self._fitted(candidate, unit, left)

    def _fitted(self, candidate: Candidate, unit: Array, left: Array) -> Fitted:
        norm = float(unit @ unit)
        if norm <= 0.0:
            return Fitted(candidate, 0.0, np.inf, 0.0, np.zeros_like(left))
        own = candidate.parameter
        size = float(np.clip(unit @ left / norm, own.lower, own.upper))
        signature = size * unit
        gain = float(left @ left - np.sum((left - signature) ** 2))
        return Fitted(candidate, size, norm**-0.5, max(gain, 0.0), signature)

    def _fit_play(self, candidate: Candidate) -> Fitted:
        """Fit the size of a play by a scan, because the width of the play decides at which inputs it is crossed."""
        left, found = self._left, []
        for play_mm in PLAYS_MM:
            unit = self.signature(candidate, float(play_mm)) / play_mm
            norm = float(unit @ unit)
            ratio = float(unit @ left) / max(norm * play_mm, 1e-300)
            # A width explains itself where what is left asks for about that width.
            signature = play_mm * unit
            found.append((float(2.0 * signature @ left - signature @ signature), float(play_mm), norm, ratio))
        gain, size, norm, ratio = max(found)
        for _ in range(STEPS):
            trial = float(np.clip(size * np.clip(ratio, 0.7, 1.4), PLAYS_MM[0], PLAYS_MM[-1]))
            unit = self.signature(candidate, trial) / trial
            better = float(2.0 * trial * (unit @ left) - trial**2 * (unit @ unit))
            if better <= gain:
                break
            gain, size, norm = better, trial, float(unit @ unit)
            ratio = float(unit @ left) / max(norm * trial, 1e-300)
        signature = self.signature(candidate, size)
        return Fitted(candidate, size, max(norm, 1e-300) ** -0.5, max(gain, 0.0), signature)

    def refined(self, fitted: Fitted) -> Fitted:
        """Refit a candidate with its signature at the fitted size, until the size no longer changes."""
        if fitted.candidate.part is DrawnPart.PIVOT:
            return fitted
        for _ in range(STEPS):
            if fitted.size == 0.0:
                return fitted
            unit = self.signature(fitted.candidate, fitted.size) / fitted.size
            again = self._fitted(fitted.candidate, unit, self._left)
            settled = abs(again.size - fitted.size) < 0.1 * again.u
            fitted = again
            if settled:
                break
        return fitted

    def limit(self, rng: np.random.Generator, first: Sequence[Fitted]) -> float:
        """Reduction of chi-square that the best of all candidates seldom exceeds in noise alone."""
        units = np.array([f.signature / np.linalg.norm(f.signature) for f in first if np.any(f.signature)])
        if not units.size:
            return float("inf")
        values, vectors = np.linalg.eigh(units @ units.T)
        draws = rng.standard_normal((DRAWS, values.size)) * np.sqrt(np.maximum(values, 0.0)) @ vectors.T
        quantile = float(np.quantile(np.max(draws**2, axis=1), 1.0 - FALSE_CLAIMS))
        # The noise is estimated too: Hotelling's T-squared instead of chi-square.
        count, degrees = self.noise.mixing.shape[1], self.noise.degrees
        return float(quantile * degrees / max(degrees - count - 1, 1))

    def structure(self, left: Array) -> float:
        """Gain in chi-square by generic shapes (bends, kinks and directions of every channel) in the residual."""
        u = self.prediction.input_mm
        reach = max(float(np.abs(u).max()), 1e-12)
        shapes = [u / reach, (u / reach) ** 2, np.abs(u) / reach, np.tanh(8.0 * u / reach)]
        probes = []
        for channel in range(self.residual.shape[1]):
            for shape in shapes:
                own = np.zeros_like(self.residual)
                own[:, channel] = shape
                probes.append(self._beside(self.noise.whitened(own)))
        basis, values, _ = np.linalg.svd(np.array(probes).T, full_matrices=False)
        basis = basis[:, values > 1e-6 * values.max()]
        total = float(np.sum((basis.T @ left) ** 2))
        return total if total > float(chi2.isf(STRUCTURE, basis.shape[1])) else 0.0

    def run(self, rng: np.random.Generator) -> PlaceFindings:
        """Run the search for a faulty place."""
        first = [self.fit(candidate) for candidate in self.candidates]
        limit = self.limit(rng, first)
        top = max(f.gain for f in first)
        looked = [self.refined(f) if f.gain > max(REFINED * top, limit / 2.0) else f for f in first]
        best = max(looked, key=lambda f: f.gain)
        smallest = _smallest(looked, limit)
        claims = best.gain > limit
        singles = [f for f in looked if f.candidate.part not in PAIRS]
        # Two links that are off together must gain more than chance over every single place.
        one = max(singles, key=lambda f: f.gain)
        best = one if best.gain - one.gain < NOT_REFUTED else best
        among = singles if best is one else looked
        members = [best, *(f for f in among if f is not best and self._alike(best, f))] if claims else []
        structure = self.structure(self._left - best.signature if claims else self._left)
        explained = best.candidate.added(best.size) if claims else np.zeros_like(self.residual)
        unknown = self._unknown_part(self.residual - explained)
        return PlaceFindings(
            members=tuple(sorted(members, key=lambda f: -f.gain)),
            limit=limit,
            structure=structure if not claims or structure > STRUCTURE_SHARE * best.gain else 0.0,
            smallest=smallest,
            noise=self.noise,
            before=self.residual - unknown,
            after=self.residual - explained - unknown,
        )

    def _alike(self, best: Fitted, other: Fitted) -> bool:
        """Whether these data cannot distinguish two given explanations."""
        if best.gain - other.gain < NOT_REFUTED:
            return True
        return other.gain > best.gain / 3.0 and min(apart(best, other), apart(other, best)) < ALIKE


def apart(truth: Fitted, other: Fitted) -> float:
    """Squared whitened distance of an explanation from another one, minimised over the size of the other."""
    norm = float(other.signature @ other.signature)
    if norm <= 0.0:
        return float(truth.signature @ truth.signature)
    shared = float(truth.signature @ other.signature) ** 2 / norm
    return float(truth.signature @ truth.signature) - shared


def _smallest(fitted: Sequence[Fitted], limit: float) -> dict[str, tuple[Candidate, float]]:
    found: dict[str, tuple[Candidate, float]] = {}
    for each in fitted:
        size = float(np.sqrt(limit)) * each.u
        key = each.candidate.key
        if np.isfinite(size) and (key not in found or size < found[key][1]):
            found[key] = each.candidate, size
    return found
