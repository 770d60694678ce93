"""A condensed body in large rotation: linear elasticity in axes that rotate with its first coordinate frame.

The method is the corotational formulation of Crisfield (Non-linear Finite Element Analysis of Solids and Structures,
volume 1, section 7.3), for an element with any number of nodes: the energy is d' K d / 2, with K the stiffness matrix
and d the motions of the coordinate frames relative to the first one. Each coordinate frame is a connection point of the
body, with two displacements and a rotation.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def turned_axes(angle: float) -> Array:
    """Matrix of a rotation, shape (2, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


@dataclass(frozen=True, slots=True, eq=False)
class CorotationalBody:
    """One condensed body in large rotation.

    Parameters
    ----------
    places_mm : ndarray of float, shape (m, 2)
        Positions of the body's frames at rest.
    stiffness_n_mm : ndarray of float, shape (3 m, 3 m)
        Stiffness for small motions of the frames; rigid motions cause no force.
    """

    places_mm: Array
    stiffness_n_mm: Array

    def strained(self, moved: Array) -> Array:
        """Motions of the coordinate frames relative to the first one, shape (3 m,), from their absolute motions."""
        local = moved.reshape(-1, 3)
        at_rest = self.places_mm - self.places_mm[0]
        drift = local[:, :2] - local[0, :2]
        # R' (X + drift) - X is computed without subtracting large numbers: (R' - 1) X follows from the half angle.
        angle = local[0, 2]
        back = turned_axes(-angle)
        half = np.sin(0.5 * angle)
        less = 2.0 * half * (-half * np.eye(2) - np.cos(0.5 * angle) * _TURN)
        apart = local[:, 2] - angle
        return np.column_stack([drift @ back.T + at_rest @ less.T, apart]).ravel()

    def slope(self, moved: Array) -> Array:
        """Derivative of `strained` with respect to the frames' motions, shape (3 m, 3 m)."""
        local = moved.reshape(-1, 3)
        back = turned_axes(-float(local[0, 2]))
        chord = self.places_mm - self.places_mm[0] + local[:, :2] - local[0, :2]
        count = len(local)
        found = np.zeros((count, 3, count, 3))
        every = np.arange(1, count)
        found[every, :2, every, :2] = back
        found[every, 2, every, 2] = 1.0
        found[1:, :2, 0, :2] = -back
        found[1:, :2, 0, 2] = chord[1:] @ (-_TURN @ back).T
        found[1:, 2, 0, 2] = -1.0
        return found.reshape(local.size, local.size)

    def forces_n(self, moved: Array) -> tuple[Array, Array]:
        """Tangent stiffness, shape (3 m, 3 m), and forces, shape (3 m,), for given motions of the coordinate frames."""
        local = moved.reshape(-1, 3)
        loads = self.stiffness_n_mm @ self.strained(moved)
        slope = self.slope(moved)
        back = turned_axes(-float(local[0, 2]))
        chord = self.places_mm - self.places_mm[0] + local[:, :2] - local[0, :2]
        pulls = loads.reshape(-1, 3)[1:, :2]
        pulled = pulls @ (-_TURN @ back)
        by_turn = np.zeros((len(local), 3))
        by_turn[1:, :2] = pulled
        by_turn[0, :2] = -pulled.sum(axis=0)
        bent = np.zeros_like(slope)
        bent[:, 2] += by_turn.ravel()
        bent[2, :] += by_turn.ravel()
        bent[2, 2] -= float(np.sum(pulls * (chord[1:] @ back.T)))
        return slope.T @ self.stiffness_n_mm @ slope + bent, slope.T @ loads
