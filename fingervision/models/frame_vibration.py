"""Vibration of a lumped mechanism: condensed bodies with their own modes, joined by flexures with mass.

The bodies' own vibration modes with fixed frames are added to the condensed motions (Craig and Bampton, AIAA Journal 6
(1968) 1313). The unknowns are the motions of all coordinate frames, followed by the amplitudes of the bodies' own
modes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from fingervision.models.body_assembly import BodyAssembly
from fingervision.models.condensed_bodies import OwnModes, own_modes

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class SegmentMass:
    """Mass (t) of a flexure's segment of a given length, divided between the coordinate frames at its two ends."""

    ends: tuple[int, int]
    mass_t: float
    length_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class FrameVibration:
    """Mass and stiffness of a lumped mechanism with its bodies' own modes.

    Parameters
    ----------
    assembly : BodyAssembly
        The condensed bodies.
    own : tuple of OwnModes
        The own modes of every body.
    stiffness_n_mm, mass_t : ndarray of float, shape (n, n)
        Matrices of all unknowns, fixed and driven ones included.
    free : ndarray of int
        Unknowns that are neither fixed nor driven.
    by_input : ndarray of float, shape (n,)
        Prescribed motion per 1 mm of input.
    """

    assembly: BodyAssembly
    own: tuple[OwnModes, ...]
    stiffness_n_mm: Array
    mass_t: Array
    free: Indices
    by_input: Array

    def modes(self, *, drive_held: bool, count: int) -> tuple[Array, Array, Array]:
        """First natural modes in the plane.

        Returns
        -------
        rad_s : ndarray of float, shape (count,)
            Angular frequencies, in rising order.
        shapes : ndarray of float, shape (n, count)
            Mode shapes of unit modal mass.
        drive : ndarray of float, shape (count,)
            Motion of the input in each mode; zero with the drive held.
        """
        columns = np.eye(self.mass_t.shape[0])[:, self.free]
        if not drive_held:
            columns = np.column_stack([columns, self.by_input])
        K, M = columns.T @ self.stiffness_n_mm @ columns, columns.T @ self.mass_t @ columns
        # Solve the reciprocal eigenvalue problem: masses may be zero, whereas the stiffness is positive definite.
        last = K.shape[0] - 1
        inverse, sought = eigh(M, K, subset_by_index=(last + 1 - count, last))
        inverse, sought = inverse[::-1], sought[:, ::-1] / np.sqrt(inverse[::-1])
        drive = np.zeros(count) if drive_held else sought[-1]
        return np.asarray(1.0 / np.sqrt(inverse)), np.asarray(columns @ sought), drive

    def field(self, shapes: Array) -> Array:
        """Small displacements of every node of the bodies, shape (unknowns of the plate, k), from the frames' motions.

        Parameters
        ----------
        shapes : ndarray of float, shape (n, k)
            By column, motions of the frames and coordinates of the bodies' own modes.
        """
        at = self.frames
        found = np.zeros((self.assembly.plate.unknowns, shapes.shape[1]))
        for body, own in zip(self.assembly.bodies, self.own, strict=True):
            inner = np.arange(at, at + own.squared.size)
            found += body.shapes_mm @ shapes[body.unknowns] + own.shapes_mm @ shapes[inner]
            at += inner.size
        return found

    @property
    def frames(self) -> int:
        """Number of motions of all coordinate frames."""
        return int(self.mass_t.shape[0]) - sum(own.squared.size for own in self.own)


def frame_vibration(
    assembly: BodyAssembly,
    stiffness_n_mm: Array,
    masses: Sequence[SegmentMass],
    free: Indices,
    by_input: Array,
    count: int,
) -> FrameVibration:
    """Assemble mass and stiffness.

    Parameters
    ----------
    assembly : BodyAssembly
        The condensed bodies.
    stiffness_n_mm : ndarray of float, shape (m, m)
        Stiffness matrix of the frames' motions.
    masses : sequence of SegmentMass
        Masses of the flexures' segments.
    free : ndarray of int
        Motions of the frames that are neither fixed nor driven.
    by_input : ndarray of float, shape (m,)
        Prescribed motion of the frames per 1 mm of input.
    count : int
        Number of own modes of every body.
    """
    inner = tuple(own_modes(assembly.plate, body, count) for body in assembly.bodies)
    size = by_input.size
    total = size + sum(own.squared.size for own in inner)
    mass, stiffness = np.zeros((total, total)), np.zeros((total, total))
    stiffness[:size, :size] = stiffness_n_mm
    at = size
    for body, modes in zip(assembly.bodies, inner, strict=True):
        dofs, own = body.unknowns, np.arange(at, at + modes.squared.size)
        mass[np.ix_(dofs, dofs)] += body.mass_t
        mass[own, own], stiffness[own, own] = 1.0, modes.squared
        mass[np.ix_(dofs, own)], mass[np.ix_(own, dofs)] = modes.coupling_t, modes.coupling_t.T
        at += own.size
    for segment in masses:
        for node in segment.ends:
            place = np.arange(3 * node, 3 * node + 3)
            mass[place, place] += 0.5 * segment.mass_t * np.array([1.0, 1.0, segment.length_mm**2 / 12.0])
    every = np.concatenate([free, np.arange(size, total)])
    return FrameVibration(assembly, inner, stiffness, mass, every, np.append(by_input, np.zeros(total - size)))
