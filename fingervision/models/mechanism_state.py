"""State of a mechanism at one input, as computed by every kind of model."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from fingervision.models.mechanism import Mechanism
from fingervision.models.rigid_motion import BodyPose


@dataclass(frozen=True, slots=True)
class MechanismState:
    """State of a mechanism at one input.

    Parameters
    ----------
    input_mm, force_n : float
        Motion of the drive along its direction, and the drive's force in that direction.
    probes_mm : dict of str to (float, float)
        Displacements of the probes.
    pairs_mm : dict of str to float
        Distance of each pair of probes.
    stress_mpa : float
        Largest stress in the flexures: the von Mises stress, excluding points within half a thickness of sharp corners,
        where the stress is unbounded; or the nominal stress of beams, with the notch's factors.
    displacement_mm : ndarray of float, shape (unknowns,)
        Displacements of every node; for a lumped model, of every coordinate frame.
    contact_n : dict of str to float
        Force of every contact pair.
    bodies : mapping of str to BodyPose
        Poses of the bodies that move.
    """

    input_mm: float
    force_n: float
    probes_mm: dict[str, tuple[float, float]]
    pairs_mm: dict[str, float]
    stress_mpa: float
    displacement_mm: Any
    contact_n: dict[str, float]
    bodies: Mapping[str, BodyPose] = field(default_factory=lambda: MappingProxyType({}))


def pair_distances_mm(
    mechanism: Mechanism, probes_mm: dict[str, tuple[float, float]], *, large: bool
) -> dict[str, float]:
    """Distances of the pairs of probes (mm), negative where the probes have passed each other.

    For small displacements the distance changes linearly with the displacements, along the line that joins the probes
    at rest.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    probes_mm : dict of str to (float, float)
        Displacements of the mechanism's probes.
    large : bool
        Whether the displacements are large.
    """
    found = {}
    for name, (a, b) in mechanism.pairs.items():
        apart = np.array(mechanism.probes[b]) - mechanism.probes[a]
        moved = np.array(probes_mm[b]) - probes_mm[a]
        length = np.hypot(*apart)
        along = length + moved @ apart / length
        found[name] = float(np.copysign(np.hypot(*(apart + moved)), along) if large else along)
    return found
