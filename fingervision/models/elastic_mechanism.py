"""An elastic model of a mechanism: what finite elements and frames of beams and bodies have in common.

A kind of model provides its equations (`driven`), the motion of any point, the stress and the poses of its bodies; the
state at an input, the natural modes and the reduction to modes follow from these for every kind.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from fingervision.domain.errors import ModelError
from fingervision.domain.gripper import PointMm
from fingervision.domain.made_again import MadeAgain
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_bodies import BodyPose, LinkBody, bodies_of
from fingervision.models.mechanism_equilibrium import DrivenMechanism, MechanismEquilibrium
from fingervision.models.modal_model import FreeModes, ModalModel, Observable

Array = NDArray[np.float64]

STANDARD_GRAVITY_MM_S2 = 9806.65


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
    faces_mm : mapping of str to float
        Motion of every driven face, along its direction; less than the input where an actuator yields.
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
    faces_mm: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))


_NOTHING_BENDS = 1e-11
"""Stiffness of the drive, over Young's modulus times the plate's thickness, below which it is rounding: a leaf of
thickness t and length L has about (t / L)^3, 1e-9 for 1000 times as long as thick."""
_STEP_OF_SIZE = 1e-5
"""Input, as a share of the drawing's size, by which the change of the largest stress is computed."""


@dataclass(frozen=True, slots=True)
class LargestStress:
    """Largest stress in the flexures: von Mises stress, or the nominal stress of a beam with its notch's factors.

    Parameters
    ----------
    mpa : float
        Stress.
    place_mm : (float, float)
        Position of the largest stress at rest (x, y).
    """

    mpa: float
    place_mm: PointMm


def named_by_drive(mechanism: Mechanism, values: Array) -> dict[str, float]:
    """Values of the driven faces, such as their forces (N), by the names of the faces."""
    return {drive.face.name: float(value) for drive, value in zip(mechanism.drives, values, strict=True)}


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


def changes(mechanism: Mechanism, probes_by: Mapping[str, Array]) -> dict[str, Array]:
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


class ElasticMechanism(MadeAgain, ABC):
    """Elastic model of a drawn mechanism.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    """

    kind: str

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism = mechanism

    @property
    @abstractmethod
    def driven(self) -> DrivenMechanism:
        """The mechanism as a system whose equilibria can be computed."""

    @cached_property
    def bodies(self) -> tuple[LinkBody, ...]:
        """The bodies that the flexures join."""
        return bodies_of(self.mechanism)

    def vibrating(self, count: int) -> DrivenMechanism:
        """Return the mechanism as a system with masses, whose first `count` modes can be computed.

        Its first unknowns are those of `driven`, which may have all masses.
        """
        del count
        return self.driven

    @property
    def in_plane_stress(self) -> "ElasticMechanism | None":
        """The same model without the restraint of the flexures by the plate's width; None if it has no such model."""
        return None

    @property
    @abstractmethod
    def swaying(self) -> "ElasticMechanism":
        """The half of a mirrored drawing whose other half moves the same way sideways (`Mechanism.swaying`)."""

    @abstractmethod
    def motion_mm(self, moved: Array, point: PointMm, *, large: bool) -> Array:
        """Displacement of a point of the drawn bodies, shape (2,), or of every column of small displacements."""

    @abstractmethod
    def pulled(self, direction: PointMm, system: DrivenMechanism) -> Array:
        """Displacements of a rigid translation of the whole mechanism by a vector."""

    @abstractmethod
    def peak_stress(self, moved: Array, *, large: bool = False) -> LargestStress:
        """Largest stress in the flexures at given displacements; small ones are added to the shape at rest."""

    @abstractmethod
    def drawn_poses(self, moved: Array, *, large: bool) -> Mapping[str, BodyPose]:
        """Poses of the drawn bodies."""

    @property
    @abstractmethod
    def contact_points_mm(self) -> tuple[Array, ...]:
        """Points of every contact that may touch, in the order of its gaps, shape (2, k) each."""

    @abstractmethod
    def mode_lines(self) -> tuple[Array, NDArray[np.int64]]:
        """Lines to plot, shape (n, 2, 2), and the indices of their ends' motions (x and y) in a mode shape."""

    @property
    @abstractmethod
    def _errors(self) -> tuple[float, float]:
        """Relative errors of force and stress."""

    @property
    def force_error(self) -> float:
        """Relative error of the force per input.

        The change of the stiffness by a preload has the same relative error as the elastic stiffness, so that it counts
        for more the nearer the preload comes to buckling.
        """
        system = self.driven
        if system.unloaded is None:
            return self._errors[0]
        changed = system.unloaded.input_stiffness_n_mm / system.input_stiffness_n_mm - 1.0
        return self._errors[0] * (1.0 + abs(changed))

    @property
    def stress_error(self) -> float:
        """Relative error of the stress in the flexures."""
        return self._errors[1]

    @property
    def stiffness_n_mm(self) -> float:
        """Force at the drive per 1 mm of input, at rest (N/mm).

        Raises
        ------
        ModelError
            If the drive moves the whole mechanism, or a part of it, without bending anything.
        """
        found, mechanism = self.driven.input_stiffness_n_mm, self.mechanism
        stiff = mechanism.material.youngs_modulus_mpa * mechanism.plate_mm
        moved = max((abs(drive.per_input) for drive in mechanism.drives), default=0.0)
        if not np.any(self.driven.rest_mm) and abs(found) < _NOTHING_BENDS * stiff * moved**2:
            raise ModelError(
                f"The drive of {mechanism.name} must bend its flexures, but moves bodies without bending anything: "
                "hold a body with a [[fixed]] or [[slide]] face, and check what the slides hold."
            )
        return found

    def touch_input_mm(self) -> dict[str, float]:
        """Input nearest to zero at which each contact first touches, in small displacements.

        Contacts that never touch are left out.
        """
        names = [contact.name for contact in self.mechanism.contacts]
        return {n: at for n, at in zip(names, self.driven.touch_inputs_mm(), strict=True) if at is not None}

    @cached_property
    def input_at_yield_mm(self) -> float:
        """Input nearest to rest at which the flexures yield, in small displacements.

        Raises
        ------
        ModelError
            If the preload alone makes them yield.
        """
        system, limit = self.driven, self.mechanism.material.yield_mpa
        if not np.any(system.rest_mm):
            return limit / self.stress_mpa_per_mm
        at_rest = self.peak_stress(system.rest_mm).mpa
        if at_rest >= limit:
            raise ModelError(
                f"The preload of {self.mechanism.name} must leave its flexures below the yield stress of {limit:g} "
                f"MPa, but stresses them by {at_rest:.4g} MPa; press less."
            )

        def over(input_mm: float) -> float:
            return self.peak_stress(system.rest_mm + input_mm * system.unit_displacement).mpa - limit

        # The stress is a convex function of the input: it exceeds every limit, the farther the input the more.
        farthest = limit / self.stress_mpa_per_mm
        while min(over(farthest), over(-farthest)) <= 0.0:
            farthest *= 2.0
        return min((float(brentq(over, 0.0, sign * farthest)) for sign in (1.0, -1.0)), key=abs)

    @cached_property
    def stress_mpa_per_mm(self) -> float:
        """Largest stress per 1 mm of input, or by how much the input raises the largest stress of a preload."""
        system = self.driven
        if not np.any(system.rest_mm):
            return self.peak_stress(system.unit_displacement).mpa
        at_rest, step_mm = self.peak_stress(system.rest_mm).mpa, _STEP_OF_SIZE * self.mechanism.region.size_mm
        ends = (system.rest_mm + way * step_mm * system.unit_displacement for way in (1.0, -1.0))
        return (max(self.peak_stress(end).mpa for end in ends) - at_rest) / step_mm

    def state(self, input_mm: float, *, large_rotation: bool = False, contact: bool = False) -> MechanismState:
        """Find the equilibrium at one input."""
        found = self.driven.equilibrium(input_mm, large_rotation=large_rotation, contact=contact)
        return self.seen(input_mm, found, large=large_rotation)

    def drive_states(self) -> tuple[MechanismState, ...]:
        """Small displacements per 1 mm of one driven face after another, with all other driven faces at rest."""
        return tuple(self.seen(1.0, found, large=False) for found in self.driven.by_one_drive())

    def seen(self, input_mm: float, found: MechanismEquilibrium, *, large: bool) -> MechanismState:
        """Everything that follows from the displacements of one equilibrium."""
        mechanism, moved = self.mechanism, found.displacement
        probes = self.probes_mm(moved, large=large)
        pressed = {
            c.name: float(part.sum()) / mechanism.halves
            for c, part in zip(mechanism.contacts, found.pressed_n, strict=False)
        }
        stress = self.peak_stress(moved, large=large)
        return MechanismState(
            input_mm,
            found.force_n,
            probes,
            pair_distances_mm(mechanism, probes, large=large),
            stress.mpa,
            moved,
            pressed,
            self.poses(moved, large=large),
            named_by_drive(mechanism, found.drives_n),
            named_by_drive(mechanism, self.driven.face_motions(moved - self.driven.rest_mm, input_mm)),
        )

    def probes_mm(self, moved: Array, *, large: bool) -> dict[str, tuple[float, float]]:
        """Displacements of the probes."""
        found = self._of_probes(lambda point: self.motion_mm(moved, point, large=large))
        return {name: (float(x), float(y)) for name, (x, y) in found.items()}

    def pairs_mm(self, moved: Array, *, large: bool) -> dict[str, float]:
        """Distances of the pairs of probes (mm)."""
        return pair_distances_mm(self.mechanism, self.probes_mm(moved, large=large), large=large)

    def probes_by(self, columns: Array) -> dict[str, Array]:
        """Small motion of every probe by each column of displacements, shape (2, k)."""
        return self._of_probes(lambda point: self.motion_mm(columns, point, large=False))

    def _of_probes(self, motion: Callable[[PointMm], Array]) -> dict[str, Array]:
        found = {}
        for name, (x, y) in self.mechanism.probes.items():
            moved = motion((abs(x) if self.mechanism.mirrored else x, y))
            if self.mechanism.mirrored and x < 0.0:
                moved = np.stack([-moved[0], moved[1]])
            found[name] = moved
        return found

    def poses(self, moved: Array, *, large: bool) -> dict[str, BodyPose]:
        """Poses of the bodies that move; those of the left half of a mirrored drawing are mirror images.

        A body on the symmetry axis moves along the axis only, although each of its halves alone would also bend
        sideways, against the other half.
        """
        found: dict[str, BodyPose] = {}
        for name, pose in self.drawn_poses(moved, large=large).items():
            if not self.mechanism.mirrored:
                found[name] = pose
            elif name.startswith("right_"):
                mirrored = BodyPose(0.0 - pose.x_mm, pose.y_mm, 0.0 - pose.angle_mrad)
                found |= {f"left_{name.removeprefix('right_')}": mirrored, name: pose}
            else:
                found[name] = BodyPose(0.0, pose.y_mm, 0.0)
        return found

    def under_weight(self, direction: PointMm) -> Array:
        """Displacements under one standard gravity in the plane, with the drive fixed."""
        system = self.vibrating(0)
        return system.under_load(STANDARD_GRAVITY_MM_S2 * (system.mass_t @ self.pulled(direction, system)))

    def modes_hz(self, *, drive_held: bool, count: int = 3) -> tuple[float, ...]:
        """First natural frequencies in the plane, with the drive fixed or free to move along its direction (Hz)."""
        rad_s, _, _ = self.vibrating(count).modes(drive_held=drive_held, count=count)
        return tuple((rad_s / (2.0 * np.pi)).tolist())

    def modes(self, *, drive_held: bool, count: int) -> tuple[Array, Array]:
        """First natural modes in the plane: angular frequencies in rad/s, and by column the motions of `mode_lines`."""
        rad_s, shapes, _ = self.vibrating(count).modes(drive_held=drive_held, count=count)
        return rad_s, self.line_motions(shapes)

    def line_motions(self, shapes: Array) -> Array:
        """Motions to which the indices of `mode_lines` refer, by column."""
        return shapes

    def modal_model(self, count: int) -> ModalModel:
        """Reduce the mechanism to its static shape and its first `count` modes with the drive fixed.

        The observable of a pair of probes is their distance, see `state`.
        """
        system = self.vibrating(count)
        rad_s, shapes, _ = system.modes(drive_held=True, count=count)
        static = np.zeros(system.unknowns)
        static[: self.driven.unknowns] = self.driven.unit_displacement
        inertia = system.mass_t @ static
        rest = self.state(0.0)
        at_rest = {f"{name}_mm": length for name, length in rest.pairs_mm.items()} | {
            f"{name}_{axis}_mm": part
            for name, at in rest.probes_mm.items()
            for axis, part in zip("xy", at, strict=True)
        }
        by_case = changes(self.mechanism, self.probes_by(np.column_stack([static, shapes])))
        return ModalModel(
            stiffness_n_mm=self.stiffness_n_mm,
            mass_t=float(static @ inertia),
            rad_s=rad_s,
            participation=shapes.T @ inertia,
            face_per_input=self._face_per_input,
            force_share=self._force_share,
            rest_force_n=rest.force_n,
            observed={name: Observable(at_rest[name], float(by[0]), by[1:]) for name, by in by_case.items()},
        )

    @property
    def _face_per_input(self) -> float:
        """Motion of the driven faces per 1 mm of input, weighted by their `per_input`; 1 for a stage."""
        system = self.driven
        moved = system.face_motions(system.unit_displacement, 1.0)
        return float(system.per_input @ moved) / float(system.per_input @ system.per_input)

    @property
    def _force_share(self) -> float:
        """Spring over push of a soft actuator, by which vibration changes its force; 1 for a stage."""
        soft = [drive.spring_n_mm / drive.push_n for drive in self.mechanism.drives if drive.is_soft]
        return soft[0] if soft else 1.0

    def free_modes(self, count: int) -> FreeModes:
        """Return the vibration modes with the drive free to move along its direction."""
        rad_s, shapes, drive = self.vibrating(count).modes(drive_held=False, count=count)
        return FreeModes(rad_s, drive, changes(self.mechanism, self.probes_by(shapes)))
