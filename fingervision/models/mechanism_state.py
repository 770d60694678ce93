"""State of a mechanism at one input, as computed by every kind of model."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_equilibrium import MechanismEquilibrium
from fingervision.models.modal_model import Observable
from fingervision.models.rigid_motion import BodyPose


@dataclass(frozen=True, slots=True)
class MechanismState:
    """State of a mechanism at one input.

    Parameters
    ----------
    input_mm, force_n : float
        Input, and the force that does its work: for one driven face, this is the force along its direction; for
        several, it is the sum of their forces, each times the motion of its face per 1 mm of input.
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
    drives_n : mapping of str to float
        Force at every driven face, along its direction.
    """

    input_mm: float
    force_n: float
    probes_mm: dict[str, tuple[float, float]]
    pairs_mm: dict[str, float]
    stress_mpa: float
    displacement_mm: Any
    contact_n: dict[str, float]
    bodies: Mapping[str, BodyPose] = field(default_factory=lambda: MappingProxyType({}))
    drives_n: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))


def named_forces_n(mechanism: Mechanism, forces_n: NDArray[np.float64]) -> dict[str, float]:
    """Forces of the driven faces (N), by the names of the faces."""
    return {drive.face.name: float(force) for drive, force in zip(mechanism.drives, forces_n, strict=True)}


def state_in_equilibrium(
    mechanism: Mechanism,
    input_mm: float,
    found: MechanismEquilibrium,
    probes_mm: dict[str, tuple[float, float]],
    stress_mpa: float,
    bodies: Mapping[str, BodyPose],
    *,
    large: bool,
) -> MechanismState:
    """State of a mechanism in an equilibrium, with the quantities that the kind of model derives from displacements.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    input_mm : float
        Input.
    found : MechanismEquilibrium
        Displacements and forces.
    probes_mm, stress_mpa, bodies
        As in `MechanismState`.
    large : bool
        Whether the distances of the pairs are those of displaced points, instead of linear in the displacements.
    """
    pressed = {c.name: float(part.sum()) for c, part in zip(mechanism.contacts, found.pressed_n, strict=False)}
    return MechanismState(
        input_mm,
        found.force_n,
        probes_mm,
        pair_distances_mm(mechanism, probes_mm, large=large),
        stress_mpa,
        found.displacement,
        pressed,
        bodies,
        named_forces_n(mechanism, found.drives_n),
    )


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


def changes(mechanism: Mechanism, probes_by: Mapping[str, NDArray[np.float64]]) -> dict[str, NDArray[np.float64]]:
    """Small changes of every pair's distance and every probe's position, by column name.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    probes_by : mapping of str to ndarray of float, shape (2, k)
        Small motion of every probe along x and y, in k cases.

    Returns
    -------
    dict of str to ndarray of float, shape (k,)
        `NAME_mm` of the pairs, then `NAME_x_mm` and `NAME_y_mm` of the probes.
    """
    found = {}
    for name, (a, b) in mechanism.pairs.items():
        apart = np.array(mechanism.probes[b]) - mechanism.probes[a]
        found[f"{name}_mm"] = apart @ (probes_by[b] - probes_by[a]) / np.hypot(*apart)
    for name, moved in probes_by.items():
        found |= {f"{name}_{axis}_mm": row for axis, row in zip("xy", moved, strict=True)}
    return found


def observables(mechanism: Mechanism, probes_by: Mapping[str, NDArray[np.float64]]) -> dict[str, Observable]:
    """Outputs of a modal model; the first of the k cases is 1 mm of input, the other cases are the modes."""
    rest_mm = {
        f"{name}_mm": float(np.hypot(*(np.array(mechanism.probes[b]) - mechanism.probes[a])))
        for name, (a, b) in mechanism.pairs.items()
    }
    return {
        name: Observable(rest_mm.get(name, 0.0), float(change[0]), change[1:])
        for name, change in changes(mechanism, probes_by).items()
    }
