"""Vibration of a lumped mechanism: condensed bodies with their own modes, joined by flexures with mass.

The bodies' own vibration modes with fixed frames are added to the condensed motions (Craig and Bampton, AIAA Journal 6
(1968) 1313). The unknowns are the motions of all coordinate frames, followed by the amplitudes of the bodies' own
modes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, csr_matrix, diags, hstack, identity

from fingervision.models.body_assembly import BodyAssembly
from fingervision.models.condensed_bodies import OwnModes, own_modes
from fingervision.models.mechanism_equilibrium import DrivenMechanism, Gaps

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SegmentMass:
    """Mass (t) of a flexure's segment of a given length, divided between the coordinate frames at its two ends."""

    ends: tuple[int, int]
    mass_t: float
    length_mm: float


def frame_vibration(
    assembly: BodyAssembly, driven: DrivenMechanism, masses: Sequence[SegmentMass], count: int
) -> tuple[tuple[OwnModes, ...], DrivenMechanism]:
    """Add masses, and `count` own modes of every body, to the equations of frames joined by flexures.

    Parameters
    ----------
    assembly : BodyAssembly
        The condensed bodies.
    driven : DrivenMechanism
        The equations of the frames' motions.
    masses : sequence of SegmentMass
        Masses of the flexures' segments.
    count : int
        Number of own modes of every body.

    Returns
    -------
    tuple of OwnModes, DrivenMechanism
        The own modes of every body, and the system of all unknowns.
    """
    inner = tuple(own_modes(assembly.plate, body, count) for body in assembly.bodies)
    squared = np.concatenate([own.squared for own in inner])
    size, more = driven.unknowns, squared.size
    mass = np.zeros((size + more, size + more))
    at = size
    for body, modes in zip(assembly.bodies, inner, strict=True):
        dofs, own = body.unknowns, np.arange(at, at + modes.squared.size)
        mass[np.ix_(dofs, dofs)] += body.mass_t
        mass[own, own] = 1.0
        mass[np.ix_(dofs, own)], mass[np.ix_(own, dofs)] = modes.coupling_t, modes.coupling_t.T
        at += own.size
    for segment in masses:
        for node in segment.ends:
            place = np.arange(3 * node, 3 * node + 3)
            mass[place, place] += 0.5 * segment.mass_t * np.array([1.0, 1.0, segment.length_mm**2 / 12.0])

    def tangent(moved: Array) -> tuple[csr_matrix, Array]:
        stiffness, force = driven.tangent(moved[:size])
        whole = block_diag([stiffness, diags(squared)], format="csr") if more else stiffness
        return csr_matrix(whole), np.append(force, squared * moved[size:])

    def with_more(gaps: Callable[[Array], Gaps], moved: Array) -> Gaps:
        gap, slope, bend = gaps(moved[:size])
        return (
            gap,
            csr_matrix(hstack([slope, csr_matrix((gap.size, more))])),
            lambda forces: csr_matrix(block_diag([bend(forces), csr_matrix((more, more))])),
        )

    return inner, replace(
        driven,
        tangent=tangent,
        internal=lambda moved: tangent(moved)[1],
        motions=csr_matrix(block_diag([driven.motions, identity(more)])),
        by_drive=np.vstack([driven.by_drive, np.zeros((more, driven.by_drive.shape[1]))]),
        mass=lambda: csr_matrix(mass),
        gaps=tuple(partial(with_more, gaps) for gaps in driven.gaps),
    )
