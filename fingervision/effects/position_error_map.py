"""Position error map: the stage has a position error that depends on the position but not on the direction."""

import numpy as np
from scipy.interpolate import CubicSpline

from fingervision.domain.effect import Array, DriveEffect, History, Stage, Values, curve_points
from fingervision.domain.parameter import Parameter

FEWEST_PLACES = 5
"""Smallest number of different inputs from which more than a straight line and a curvature can be estimated."""
TYPICAL_NODES = 65
TYPICAL_SEED = 230
"""Random seed of the representative curve for a map whose points are not given."""


def covariance(inputs_mm: Array, length_mm: float) -> Array:
    """Matern covariance of smoothness 5/2 and unit variance (Rasmussen & Williams 2006, 4.17); shape (k, k)."""
    far = np.sqrt(5.0) * np.abs(inputs_mm[:, None] - inputs_mm) / length_mm
    return np.asarray((1.0 + far + far**2 / 3.0) * np.exp(-far))


def without_line(inputs_mm: Array, read: Array | None = None) -> Array:
    """Projector that removes the mean and the linear trend from values at the given inputs; shape (k, k).

    Parameters
    ----------
    inputs_mm : ndarray of float, shape (k,)
        Inputs at which the values are given.
    read : ndarray of float, shape (n, k), or None
        Weights by which values at n further positions are interpolated from the k values; mean and trend are then taken
        over these positions. None to take them over the inputs.
    """
    line = np.stack([np.ones_like(inputs_mm), inputs_mm - inputs_mm.mean()], axis=1)
    weight = np.eye(inputs_mm.size) if read is None else read.T @ read
    return np.asarray(np.eye(inputs_mm.size) - line @ np.linalg.solve(line.T @ weight @ line, line.T @ weight))


def typical_curve(low_mm: float, high_mm: float, rms_mm: float, length_mm: float) -> tuple[Array, Array]:
    """Return a representative curve for a map of which only RMS and correlation length are known.

    The curve is random, but the same for the same arguments.
    """
    at = np.linspace(low_mm, high_mm, TYPICAL_NODES)
    root = np.linalg.cholesky(covariance(at, length_mm) + 1e-9 * np.eye(at.size))
    drawn = without_line(at) @ root @ np.random.default_rng(TYPICAL_SEED).standard_normal(at.size)
    return at, drawn * rms_mm / float(np.sqrt(np.mean(drawn**2)))


def act(input_mm: Array, history: History, values: Values) -> Array:
    """Apply the effect: add the stage's error at each position; beyond the ends of its curve, the error is constant."""
    at, errors = curve_points(values)
    if not at.size:
        if values["rms_mm"] == 0.0:
            return input_mm
        low, high = float(history.input_mm.min()), float(history.input_mm.max())
        at, errors = typical_curve(low, high, values["rms_mm"], values["length_mm"])
    return input_mm + np.asarray(CubicSpline(at, errors)(np.clip(input_mm, at[0], at[-1])), dtype=np.float64)


def narrow(history: History) -> tuple[Parameter, ...] | str:
    """Narrow the bounds of the parameters to what the given data can show."""
    places = np.unique(np.round(history.input_mm / max(1e-6 * history.input_span_mm, 1e-300)))
    if places.size < FEWEST_PLACES:
        return f"a map needs readings at {FEWEST_PLACES} or more different inputs, but the table has {places.size}"
    return EFFECT.parameters


EFFECT = DriveEffect(
    name="position_error_map",
    stage=Stage.DRIVE,
    order=53,
    words="the stage has the same error at every visit of a position",
    formula="u + f(u), f a Gaussian process without its mean and straight-line part",
    source="ISO 230-2:2014, mean bi-directional positional deviation; Rasmussen & Williams 2006",
    residual="the same curve over the input in both directions and in every run",
    parameters=(
        Parameter("rms_mm", "mm", 0.0, 1.0, "root mean square of the errors"),
        Parameter("length_mm", "mm", 1e-4, 1e4, "length over which the errors change", neutral=None, logarithmic=True),
    ),
    narrow=narrow,
    act=act,
    curve=True,
)
