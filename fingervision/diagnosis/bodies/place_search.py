"""Search for the hinge, link or pivot that explains poses and gap, and for indistinguishable alternatives."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from fingervision.diagnosis.bodies.body_prediction import BodyPrediction
from fingervision.diagnosis.bodies.channel_noise import channel_noise
from fingervision.diagnosis.bodies.place_candidates import PAIRS, Candidate, candidates_of
from fingervision.diagnosis.bodies.place_findings import Fitted, PlaceFindings, apart, smallest_sizes
from fingervision.diagnosis.bodies.place_nuisances import PlaceNuisances
from fingervision.domain.drawing_form import DrawnPart

Array = NDArray[np.float64]

ALIKE = 12.0
"""Squared whitened distance below which two explanations count as indistinguishable, as in
`inference/ambiguity_set`."""
NOT_REFUTED = 6.0
"""Increase of chi-square over the best explanation below which the data do not reject an explanation (Cox, 1961)."""
FALSE_CLAIMS = 0.02
"""False positive rate: share of tables with noise alone in which the largest gain exceeds the threshold."""
DRAWS = 4000
"""Draws of noise: the 98 % quantile is then the eightieth largest value, and the probability of exceeding it is known
to a ninth."""
REFINED = 0.25
"""Ratio to the largest gain below which a candidate is not refined."""
STRUCTURE = 1e-3
"""Significance level below which the residual of an explanation contains structure."""
STRUCTURE_SHARE = 0.05
"""Structure relative to the explained part that is attributed to the inexact form of the explanation (`STANDING_SHARE`
for the gap)."""
PLAYS_MM = np.geomspace(0.002, 0.5, 25)
"""Plays that are tried, in steps of a quarter, from a fifteenth of a pixel at 34 px/mm to the catalogue's bound."""
STEPS = 4
"""Number of refinements of a size: each changes the size by a factor of at most 1.4, so that four refinements cover the
interval between two plays that are tried."""


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
        shape = (self.residual.shape[0], self.residual.shape[1])
        self._nuisances = PlaceNuisances(prediction, shape, runs, self.noise, self.candidates)
        self._left = self._nuisances.beside(self.noise.whitened(self.residual))

    def signature(self, candidate: Candidate, size: float) -> Array:
        """Change of the prediction by a candidate of a given size, whitened, orthogonal to the nuisance parameters."""
        return self._nuisances.beside(self.noise.whitened(candidate.added(size)))

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
        """Fit the size of a play by a scan, because the inputs at which the play is taken up depend on its size."""
        left, found = self._left, []
        for play_mm in PLAYS_MM:
            unit = self.signature(candidate, float(play_mm)) / play_mm
            norm = float(unit @ unit)
            ratio = float(unit @ left) / max(norm * play_mm, 1e-300)
            # The gain is that of the play at its full size, without a fitted factor: it is largest where the residual
            # requires about this play.
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
        # The noise is estimated too, so that Hotelling's T-squared replaces chi-square.
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
                probes.append(self._nuisances.beside(self.noise.whitened(own)))
        basis, values, _ = np.linalg.svd(np.array(probes).T, full_matrices=False)
        basis = basis[:, values > 1e-6 * values.max()]
        total = float(np.sum((basis.T @ left) ** 2))
        return total if total > float(chdtri(basis.shape[1], STRUCTURE)) else 0.0

    def run(self, rng: np.random.Generator) -> PlaceFindings:
        """Run the search for a faulty place."""
        first = [self.fit(candidate) for candidate in self.candidates]
        limit = self.limit(rng, first)
        top = max(f.gain for f in first)
        looked = [self.refined(f) if f.gain > max(REFINED * top, limit / 2.0) else f for f in first]
        best = max(looked, key=lambda f: f.gain)
        smallest = smallest_sizes(looked, limit)
        claims = best.gain > limit
        singles = [f for f in looked if f.candidate.part not in PAIRS]
        # Two links that differ together must gain significantly more than every single place.
        one = max(singles, key=lambda f: f.gain)
        best = one if best.gain - one.gain < NOT_REFUTED else best
        among = singles if best is one else looked
        members = [best, *(f for f in among if f is not best and self._alike(best, f))] if claims else []
        structure = self.structure(self._left - best.signature if claims else self._left)
        explained = best.candidate.added(best.size) if claims else np.zeros_like(self.residual)
        unknown = self._nuisances.unknown_part(self.residual - explained)
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
        """Whether two given explanations are indistinguishable in the data."""
        if best.gain - other.gain < NOT_REFUTED:
            return True
        return other.gain > best.gain / 3.0 and min(apart(best, other), apart(other, best)) < ALIKE
