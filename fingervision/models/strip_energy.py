"""Load on a leaf or straight neck: bending with ends that rotate against each other or that sway, and stretching.

The plate's width restrains rotation of the ends, sway and stretching differently (`strip_width`). The strain energies
of a bar follow from the rotations of its ends, the rotation of its chord and its elongation (Timoshenko, Strength of
Materials): each is E I / (2 L) times a square, see `used_in_plate`. The models need only the fractions of the three
strain energies, and restraint of the bar hardly changes these fractions.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from fingervision.models.flexure import Flexure
from fingervision.models.flexure_span import FlexureSpan
from fingervision.models.plane_stress import PlaneStressPlate

Array = NDArray[np.float64]

_ACROSS = 0.4
"""Distance from the axis, as a share of the thickness, of the two points that define a section's rotation."""
_LEAST = 1e-3
"""Share of the whole strain energy below which a strip keeps its assumed fractions; these then change the force by less
than 1e-4."""


def used_in_plate(flexure: Flexure, plate: PlaneStressPlate, moved: Array, whole_n_mm: float) -> Flexure:
    """Set the fractions of a strip's strain energy (three deformations) from the displacements of a meshed plate.

    A strip with a negligible part of the whole energy is left unchanged, because its fractions would be determined by
    rounding errors.
    """
    length, t = flexure.bent_mm, flexure.thickness_mm
    along, across = (np.subtract(flexure.point_mm(*way), flexure.at_mm) for way in ((1.0, 0.0), (0.0, 1.0)))
    shifts, turns = [], []
    for x in (-0.5 * length, 0.5 * length):
        low, high = (plate.rows_at(flexure.point_mm(x, side * _ACROSS * t)) @ moved for side in (-1.0, 1.0))
        shifts.append(0.5 * (low + high))
        turns.append(float(along @ (low - high)) / (2.0 * _ACROSS * t))
    apart = shifts[1] - shifts[0]
    chord = float(across @ apart) / length
    parts = np.array(
        [
            (turns[1] - turns[0]) ** 2,
            3.0 * (turns[0] + turns[1] - 2.0 * chord) ** 2,
            12.0 * (float(along @ apart) / t) ** 2,
        ]
    )
    return _with(
        flexure, parts * plate.material.youngs_modulus_mpa * plate.plate_mm * t**3 / (24.0 * length), whole_n_mm
    )


def used_in_frame(span: FlexureSpan, end_loads: Array, plate: PlaneStressPlate, whole_n_mm: float) -> Flexure:
    """Set the fractions of a strip's strain energy from the loads at the ends of its segments; see `used_in_plate`."""
    tension, first, last = float(end_loads[:, 0].mean()), -float(end_loads[0, 1]), float(end_loads[-1, 2])
    t = span.flexure.thickness_mm
    parts = np.array([(0.5 * (first + last)) ** 2, (0.5 * (first - last)) ** 2 / 3.0, (tension * t) ** 2 / 12.0])
    stiffness = plate.material.youngs_modulus_mpa * plate.plate_mm * t**3 / (6.0 * span.flexure.bent_mm)
    return _with(span.flexure, parts / stiffness, whole_n_mm)


def _with(flexure: Flexure, energies_n_mm: Array, whole_n_mm: float) -> Flexure:
    total = float(energies_n_mm.sum())
    if total <= _LEAST * whole_n_mm:
        return flexure
    bent, swayed, stretched = (energies_n_mm / total).tolist()
    return replace(flexure, used=(bent, swayed, stretched))
