"""Predict every channel of a measured table from the drawing, unchanged or with one hinge or link changed."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fingervision.models.mechanism_bodies import column_name
from fingervision.models.place_answers import AS_DRAWN, LinearAnswer, PlaceAnswers, PlaceChanges

Array = NDArray[np.float64]

_BENT_NODES = (-1.0, -0.5, 0.35, 0.7, 1.0)
"""Positions, as shares of the input's range on either side, at which equilibria in the deformed shape are computed."""
_SLIP_NODES = np.geomspace(1e-3, 1e3, 121)
"""Inputs relative to the play's radius at which the slip of a pivot is tabulated; beyond the last input, the pin lies
at the edge of its hole."""
FORCE = "force_n"


@dataclass(frozen=True, eq=False)
class BodyPrediction:
    """Prediction of a drawing at the inputs of a table, in the measured channels.

    Parameters
    ----------
    answers : PlaceAnswers
        The drawing.
    channels : tuple of str
        Names of the table's channels in the drawing.
    input_mm : ndarray of float, shape (n,)
        Input that the mechanism received.
    """

    answers: PlaceAnswers
    channels: tuple[str, ...]
    input_mm: Array
    _cache: dict[object, LinearAnswer] = field(default_factory=dict)

    @cached_property
    def _places(self) -> list[int]:
        return [self.answers.channels.index(name) for name in self.channels]

    def linear(self, changes: PlaceChanges = AS_DRAWN) -> LinearAnswer:
        """Predict all channels for small displacements, with some hinges or links changed; results are cached."""
        key = (
            tuple(sorted(changes.stiffness.items())),
            tuple(sorted(changes.moved_mm.items())),
            tuple(sorted(changes.probes_mm.items())),
        )
        if key not in self._cache:
            self._cache[key] = self.answers.answer(changes)
        return self._cache[key]

    @cached_property
    def drawn(self) -> Array:
        """Predict all channels with the unchanged drawing, for small displacements; shape (n, channels)."""
        return np.outer(self.input_mm, self.linear().by_input[self._places])

    def changed(self, changes: PlaceChanges) -> Array:
        """Change of the prediction caused by changed hinges and links, shape (n, channels)."""
        return np.outer(self.input_mm, (self.linear(changes).by_input - self.linear().by_input)[self._places])

    @cached_property
    def bent(self) -> Array:
        """Change of the prediction if equilibrium is computed in the deformed shape, shape (n, channels).

        The change by large rotation is interpolated by a polynomial of order 2 to 4 in the input.
        """
        model, names = self.answers.model, self.answers.channels
        reach = float(np.abs(self.input_mm).max())
        low = float(np.clip(-self.input_mm.min() / reach, 0.0, 1.0))
        high = float(np.clip(self.input_mm.max() / reach, 0.0, 1.0))
        inputs = [share * reach * (high if share > 0.0 else low) for share in _BENT_NODES]
        inputs = [value for value in inputs if abs(value) > 0.05 * reach]
        rows = []
        for value in inputs:
            state = model.state(value, large_rotation=True)
            found: dict[str, float] = {FORCE: state.force_n}
            for name, pose in state.bodies.items():
                for part in ("x_mm", "y_mm", "angle_mrad"):
                    found[f"{name}.{part}"] = getattr(pose, part)
            for name, (x, y) in state.probes_mm.items():
                found |= {f"{name}_x_mm": x, f"{name}_y_mm": y}
            pairs = self.answers.mechanism.pairs
            probes = self.answers.mechanism.probes
            for name, length in state.pairs_mm.items():
                a, b = (np.array(probes[end]) for end in pairs[name])
                found[f"{name}_mm"] = length - float(np.hypot(*(b - a)))
            for place, hinge in enumerate(self.answers.mechanism.flexures):
                first, last = (self._angle_of(found, body) for body in self.answers.ends(place))
                found[f"{hinge.name}.angle_mrad"] = last - first
            small = value * self.linear().by_input
            rows.append([found[name] - small[place] for place, name in enumerate(names)])
        u = np.array(inputs) / reach
        powers = np.stack([u**2, u**3, u**4], axis=1)[:, : min(3, u.size)]
        shape = np.linalg.lstsq(powers, np.array(rows), rcond=None)[0][:, self._places]
        w = self.input_mm / reach
        return np.asarray(np.stack([w**2, w**3, w**4], axis=1)[:, : shape.shape[0]] @ shape)

    def _angle_of(self, found: dict[str, float], body: int) -> float:
        """Rotation of a body (rad), which is given by its number; 0 for a fixed body."""
        assembly = self.answers.model.assembly
        nodes = np.flatnonzero(assembly.piece == body)
        middle = assembly.plate.nodes_mm[:, nodes].mean(axis=1)
        bodies = self.answers.model.bodies
        nearest = min(bodies, key=lambda each: float(np.hypot(*(each.centroid_mm - middle))))
        return found.get(f"{nearest.name}.angle_mrad", 0.0)

    @cached_property
    def by_edges(self) -> Array:
        """Change of the prediction if poses are measured from edges in a picture, shape (n, channels)."""
        return np.outer(self.input_mm, self.answers.by_edges[self._places])

    def slipped(self, flexure: int, play_mm: float) -> Array:
        """Change of the prediction caused by play in a pivot, shape (n, channels); see `slip_mm`."""
        slip = slip_mm(self.linear(), flexure, self.input_mm, play_mm)
        return np.asarray(slip @ self.linear().by_slip[flexure][self._places].T)

    def turned(self) -> Array:
        """Change of the prediction per 1 rad of rotation of the drawing in the picture, shape (n, channels)."""
        out = np.zeros_like(self.drawn)
        for place, name in enumerate(self.channels):
            for own, other, sign in ((".x_mm", ".y_mm", -1.0), (".y_mm", ".x_mm", 1.0)):
                if name.endswith(own) and (partner := name.removesuffix(own) + other) in self.answers.channels:
                    source = self.answers.channels.index(partner)
                    out[:, place] = sign * self.input_mm * self.linear().by_input[source]
        return out


def slip_mm(answer: LinearAnswer, flexure: int, input_mm: Array, play_mm: float) -> Array:
    """Displacement of a pin in a pivot with play, along x and y, without friction; shape (n, 2).

    The pin takes the position in its hole with the least elastic energy: with the force F on the pin per unit of input
    u, and the stiffness S against a displacement s, the energy s S s / 2 - u F s is minimised over the disc of half the
    play (a trust-region problem: More and Sorensen (1983), SIAM Journal on Scientific and Statistical Computing 4, 553,
    DOI 10.1137/0904038). Near zero load the pin follows the load; under larger loads the pin lies against the hole, on
    the side to which the load points.

    Parameters
    ----------
    answer : LinearAnswer
        Linear response of the mechanism.
    flexure : int
        The pivot.
    input_mm : ndarray of float, shape (n,)
        Inputs.
    play_mm : float
        Full width of the play.
    """
    radius = 0.5 * play_mm
    if radius <= 0.0:
        return np.zeros((input_mm.size, 2))
    stiffness, vectors = np.linalg.eigh(answer.slip_stiffness[flexure])
    load = vectors.T @ answer.load_by_input[flexure]
    nodes = _SLIP_NODES

    def length(beyond: Array) -> Array:
        return np.asarray(np.hypot(*(nodes * (load / (stiffness + beyond[:, None])).T)))

    # Find the root by bisection, which is as fast here as Newton's iteration on 1 / |s|.
    low = np.zeros(nodes.size)
    high = nodes * float(np.hypot(*load)) + 1e-12
    outside = length(low) > 1.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        above = length(middle) > 1.0
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    beyond = np.where(outside, 0.5 * (low + high), 0.0)
    unit = (vectors @ (nodes[:, None] * load / (stiffness + beyond[:, None])).T).T
    away = np.abs(input_mm) / radius
    grid = np.concatenate([[0.0], nodes])
    table = np.vstack([np.zeros((1, 2)), unit])
    rows = np.stack([np.interp(away, grid, table[:, k]) for k in range(2)], axis=1)
    return np.asarray(radius * np.sign(input_mm)[:, None] * rows)


def known_channels(answers: PlaceAnswers, measured: Sequence[str]) -> dict[str, str]:
    """Match the channels of a table to names in the drawing; only letters, digits and `_` are compared."""
    own = {column_name(name): name for name in answers.channels}
    return {name: own[column_name(name)] for name in measured if column_name(name) in own}
