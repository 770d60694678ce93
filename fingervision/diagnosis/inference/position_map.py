"""A map of position errors added to an explanation: a Gaussian process judged by its marginal likelihood.

The map is a random effect (Rasmussen & Williams 2006, chapter 2): its curve is integrated out, and the log determinant
penalises its flexibility. Mean and straight line are removed from the map, because offsets and ratios are effects of
the catalogue.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from fingervision.diagnosis.inference.hypothesis import Explanation, Problem
from fingervision.diagnosis.inference.measuring_chain import MeasuringChain
from fingervision.diagnosis.inference.random_effect import (
    MAP,
    RandomEffect,
    estimated_coefficients,
    gains_by_size,
    normal_equations,
)
from fingervision.domain.effect import Array, History, curve_values
from fingervision.domain.parameter import Estimate
from fingervision.effects.position_error_map import EFFECT, covariance, without_line

NAME = EFFECT.name
SET_POINTS = 60
"""Number of different inputs up to which each input is a node of the curve; for more inputs, the nodes are
equidistant."""
NODES = 13
"""Number of nodes of a curve over many inputs: about the number of positions at which error maps are tabulated."""
SMOOTH = 0.1
"""Shortest correlation length of a map as a share of the range: faster changes are either periodic, or not a property
of the position that could have been measured in advance."""
PASSES = 1.8
"""Least ratio of travel to range, so that each position was passed twice: an error seen once is not known to be
repeatable."""
LARGEST = 0.1
"""Largest RMS size of a map as a share of the range: a stage that is farther from its scale follows another one."""
LENGTHS, SIZES = 10, 25
"""Numbers of correlation lengths and sizes that are tried."""
EVENLY = 200
"""Number of positions that represent the range of a continuous motion, so many that the two ends do not have too much
weight."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PositionMap(RandomEffect):
    """A map of position errors of the stage as a random effect.

    Parameters
    ----------
    nodes_mm : ndarray of float, shape (k,)
        Inputs at the nodes of the curve.
    root_mm : ndarray of float, shape (k, k)
        Matrix that converts independent standard normal numbers to the curve at the nodes.
    rms_mm, length_mm : Estimate
        Root mean square of the curve (before estimation, of the process), and correlation length of the process.
    """

    nodes_mm: Array
    root_mm: Array
    rms_mm: Estimate
    length_mm: Estimate

    @property
    def curve_mm(self) -> Array:
        """The estimated curve at the nodes, shape (k,)."""
        return np.asarray(self.root_mm @ self.coefficients, dtype=np.float64)

    def values(self) -> dict[str, float]:
        """Parameter values of the effect: RMS size, correlation length and points of the curve."""
        described = {"rms_mm": self.rms_mm.value, "length_mm": self.length_mm.value}
        return described | curve_values(self.nodes_mm.tolist(), self.curve_mm.tolist())

    def refitted(self, problem: Problem, explanation: Explanation) -> "PositionMap":
        """Estimate the map's curve for an explanation."""
        best, covariance_of_best = estimated_coefficients(problem, explanation, MAP)
        curve = self.root_mm @ best
        rms = float(np.sqrt(np.mean(curve**2)))
        # Propagate the curve's posterior covariance to its root mean square, by the derivative with respect to the
        # curve.
        slope = self.root_mm.T @ (curve / (curve.size * max(rms, 1e-300)))
        u = float(np.sqrt(max(float(slope @ covariance_of_best @ slope), 0.0)))
        return replace(self, coefficients=best, rms_mm=Estimate(rms, u, "mm"))


def why_no_map(history: History) -> str | None:
    """Reason why the data cannot show a repeatable map, from their history along the path; None if they can."""
    narrowed = EFFECT.search(history)
    if isinstance(narrowed, str):
        return narrowed
    if history.time_s is None:
        return "the table has no time_s, so that it is unknown how often each position was passed"
    if history.commanded:
        # A commanded stage is seen where it rests: what lies between two set-points is passed, but hardly read.
        holds = sum(1 + int(np.count_nonzero(np.diff(history.input_mm[run]))) for run in history.runs)
        if holds < PASSES * np.unique(history.input_mm).size:
            return "most set-points were commanded only once, so that the repeatability of their errors is unknown"
    if history.travel_mm < PASSES * history.input_span_mm:
        return "each position was passed only once, so that the repeatability of its error is unknown"
    return None


def likeliest_map(problem: Problem, explanation: Explanation) -> tuple[PositionMap, float]:
    """Find the most probable RMS size and correlation length of a map for an explanation.

    Parameters
    ----------
    problem : Problem
        Estimation problem without a map.
    explanation : Explanation
        Explanation whose residual the map should explain.

    Returns
    -------
    found : PositionMap
        The most probable map.
    gain : float
        Reduction of -2 log of the marginal likelihood, minus the map's penalty.
    """
    history = problem.chain.history
    nodes_mm = set_points(history)
    raw = map_columns(problem.chain, nodes_mm)
    gram, aim = normal_equations(problem, explanation, raw)
    spacing = float(np.median(np.diff(nodes_mm)))
    shortest = spacing if nodes_mm.size < NODES else SMOOTH * history.input_span_mm
    lengths = np.geomspace(shortest, max(history.input_span_mm, 2.0 * shortest), LENGTHS)
    scale = 1.0 / max(float(np.sqrt(np.trace(gram) / nodes_mm.size)), 1e-300)
    sizes = np.minimum(scale * np.geomspace(0.1, 1e4, SIZES), LARGEST * history.input_span_mm)
    gains = np.empty((LENGTHS, SIZES))
    roots = []
    straightened = without_line(nodes_mm, _places(history, nodes_mm))
    for i, length in enumerate(lengths):
        root = straightened @ np.linalg.cholesky(covariance(nodes_mm, length) + 1e-9 * np.eye(nodes_mm.size))
        roots.append(root)
        gains[i] = gains_by_size(root.T @ gram @ root, root.T @ aim, sizes)
    i, j = divmod(int(np.argmax(gains)), SIZES)
    # The penalty is that of two fitted numbers, size and length.
    choice = 2.0 * float(np.log(max(2, problem.measured.size)))
    root_mm = sizes[j] * roots[i]
    inner = np.eye(nodes_mm.size) + root_mm.T @ gram @ root_mm
    coefficients = np.linalg.solve(inner, root_mm.T @ aim)
    weight = np.exp(0.5 * (gains - gains.max()))
    weight /= weight.sum()
    found = PositionMap(
        nodes_mm=nodes_mm,
        root_mm=root_mm,
        columns_mm=raw @ root_mm,
        rms_mm=_estimate(float(sizes[j]), np.log(sizes), weight.sum(axis=0)),
        length_mm=_estimate(float(lengths[i]), np.log(lengths), weight.sum(axis=1)),
        price=float(np.linalg.slogdet(inner)[1]) + choice,
        coefficients=coefficients,
    )
    return found, float(gains[i, j]) - choice


def _estimate(value: float, logarithms: Array, weight: Array) -> Estimate:
    """The most probable value with its posterior standard deviation, which is at least the grid's spacing."""
    mean = float(weight @ logarithms)
    spread = float(np.sqrt(weight @ (logarithms - mean) ** 2 + np.diff(logarithms)[0] ** 2 / 12.0))
    return Estimate(value, value * spread, "mm")


def set_points(history: History) -> Array:
    """Inputs at the nodes of a curve over the position: each one if there are few, else equidistant."""
    near = max(1e-6 * history.input_span_mm, 1e-300)
    _, first = np.unique(np.round(history.input_mm / near), return_index=True)
    places = history.input_mm[first]
    if places.size <= SET_POINTS:
        return np.asarray(places)
    return np.linspace(float(places[0]), float(places[-1]), NODES)


def map_columns(chain: MeasuringChain, nodes_mm: Array) -> Array:
    """Change of the stacked prediction by a unit error of the stage at each node; shape (channels * n, k)."""
    history = chain.history
    inputs = np.clip(history.input_mm, nodes_mm[0], nodes_mm[-1])
    return chain.slope[:, None] * np.tile(_basis(nodes_mm, inputs), (chain.slope.size // inputs.size, 1))


def _basis(nodes_mm: Array, inputs_mm: Array) -> Array:
    """Share of each node's error in the stage's error at given inputs; shape (n, k)."""
    return np.asarray(CubicSpline(nodes_mm, np.eye(nodes_mm.size))(inputs_mm), dtype=np.float64)


def _places(history: History, nodes_mm: Array) -> Array | None:
    """Positions over which a map has zero mean and zero slope: the set-points, or the range of a continuous motion."""
    if nodes_mm.size != NODES and history.dwell_s > 0.0:
        return None
    return _basis(nodes_mm, np.linspace(nodes_mm[0], nodes_mm[-1], EVENLY))
