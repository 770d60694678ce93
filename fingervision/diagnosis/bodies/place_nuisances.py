"""Nuisance parameters in addition to a faulty place: constants, rotations, bends, and errors of the drawing's model."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.bodies.body_prediction import FORCE, BodyPrediction
from fingervision.diagnosis.bodies.channel_noise import ChannelNoise
from fingervision.diagnosis.bodies.place_candidates import Candidate, mirror_of, mirrored_channels
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
"""Prior standard deviation of the coefficient of `BodyPrediction.by_edges`: the coefficient is 0 for poses of the
bodies' areas, 1 for poses from all straight edges, and perhaps two or three for poses from those edges that a picture
shows. The table does not state how the poses were measured."""
HINGE_ERROR, OWN_HINGE_ERROR = 0.01, 0.003
"""Relative errors of a hinge's stiffness: of the hinge tables compared with brick elements, including the root in the
body (`models/README.md`); and the part that is not shared with the hinge's mirror image."""
SCALE_ERROR = 3e-4
"""Relative uncertainty of the picture's scale, from a reference of 2 mm known to a micrometre and its edges
(measuring.md)."""


class RandomEffects:
    """Nuisance parameters with normal priors, beside which other signals are fitted.

    Parameters
    ----------
    columns : sequence of (ndarray of float, shape (n,), float)
        Whitened change of all rows per unit of each parameter, and the parameter's prior standard deviation; infinite
        if nothing is known.
    """

    def __init__(self, columns: Sequence[tuple[Array, float]]) -> None:
        whitened = np.array([column for column, _ in columns]).T
        self._unit = np.maximum(np.linalg.norm(whitened, axis=0), 1e-300)
        bounded = np.array([0.0 if not np.isfinite(sd) else 1.0 / sd for _, sd in columns])
        # A prior is one more row of the least-squares problem for each parameter.
        stacked = np.vstack([whitened / self._unit, np.diag(bounded / self._unit)])
        self._basis, self._triangle = np.linalg.qr(stacked)

    def _padded(self, signal: Array) -> Array:
        return np.concatenate([signal, np.zeros(self._basis.shape[0] - signal.size)])

    def beside(self, signal: Array) -> Array:
        """Project a whitened signal on the space orthogonal to the parameters."""
        padded = self._padded(signal)
        return np.asarray(padded - self._basis @ (self._basis.T @ padded))

    def shares(self, signal: Array) -> Array:
        """Fit the parameters to a whitened signal."""
        fitted = np.linalg.lstsq(self._triangle, self._basis.T @ self._padded(signal), rcond=None)[0]
        return np.asarray(fitted / self._unit)


class PlaceNuisances:
    """Regressors of the nuisance parameters, with prior standard deviations; infinite if nothing is known.

    Parameters
    ----------
    prediction : BodyPrediction
        The drawing over the inputs of the table.
    shape : (int, int)
        Numbers of rows and of channels.
    runs : tuple of slice
        Rows of each run.
    noise : ChannelNoise
        Joint noise of all channels.
    candidates : sequence of Candidate
        Candidates, whose hinges have errors of their own.
    """

    def __init__(
        self,
        prediction: BodyPrediction,
        shape: tuple[int, int],
        runs: tuple[slice, ...],
        noise: ChannelNoise,
        candidates: Sequence[Candidate],
    ) -> None:
        columns: list[Array] = []
        spread: list[float] = []
        n, count = shape
        slopes = prediction.linear().by_input[[prediction.answers.channels.index(c) for c in prediction.channels]]
        twins = mirrored_channels(prediction)
        for channel, name in enumerate(prediction.channels):
            for run in runs:
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
        hinges = {c.place: c.added(c.reference) / c.reference for c in candidates if c.part is DrawnPart.HINGE}
        for hinge, own in hinges.items():
            twin = mirrored(hinge)
            if twin != hinge and twin in hinges:
                columns.append(own)
                spread.append(OWN_HINGE_ERROR)
                own = own + hinges[twin]
            if hinge <= twin:
                columns.append(own)
                spread.append(HINGE_ERROR)
        whitened = np.array([noise.whitened(column) for column in columns]).T
        self._columns = columns
        self._is_free = [not np.isfinite(s) for s in spread]
        self._effects = RandomEffects(list(zip(whitened.T, spread, strict=True)))
        self._noise = noise

    def beside(self, signal: Array) -> Array:
        """Project a whitened signal on the space orthogonal to the nuisance parameters."""
        return self._effects.beside(signal)

    def unknown_part(self, rows: Array) -> Array:
        """Fit of the nuisance parameters to a residual; returns the part of constants, rotation and bend only.

        The returned array has shape (n, channels).

        Possible model errors are fitted too, but stay in the residual, because they may be the disagreement to be
        found.
        """
        shares = self._effects.shares(self._noise.whitened(rows))
        free = [s * column for s, column, is_free in zip(shares, self._columns, self._is_free, strict=True) if is_free]
        return np.asarray(np.sum(free, axis=0))
