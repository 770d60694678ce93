"""Out-of-plane motion of a mechanism with its drive fixed: natural modes, and the sag of a horizontal plate.

Fixed faces and driven faces are fixed in all directions. A sliding face is fixed in its constrained direction at
every depth, which on a plane of symmetry selects the symmetric modes.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.models.deep_plate import DeepPlate
from fingervision.models.elastic_mechanism import STANDARD_GRAVITY_MM_S2
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_faces import supports_of
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.triangulate import PlaneMesh, triangulate

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

MODE_ERROR, SAG_ERROR = 0.01, 0.02
"""Relative errors of frequency and sag: frequencies are within 0.2 % of CalculiX's wedge elements for hinges 1 to 20
times as wide as thick (`tests/benchmarks/models_three_dimensions.py`); anisotropic materials are not covered by this
comparison."""

_ACROSS, _BODY = 2.0, 0.05
"""Triangles across thin parts, and edge length over the body's size: the result is within 0.1 % of that of a mesh twice
as fine."""


@dataclass(frozen=True, slots=True)
class OutOfPlane:
    """Results for out-of-plane motion of a mechanism.

    Parameters
    ----------
    modes_hz : tuple of float
        First natural frequencies with the drive held.
    sag_mm : mapping of str to float
        Sag of every probe of a horizontal plate under its own weight, with the drive held.
    """

    modes_hz: tuple[float, ...]
    sag_mm: Mapping[str, float]


def out_of_plane(
    mechanism: Mechanism, count: int = 1, *, mesh: PlaneMesh | None = None, order: int | None = None
) -> OutOfPlane:
    """Compute modes and sag out of the plane.

    Parameters
    ----------
    mechanism : Mechanism
        The drawing.
    count : int
        Number of modes.
    mesh : PlaneMesh or None
        Triangles of the mechanism; None makes them.
    order : int or None
        Odd order of the polynomials through the depth; None for the default of `DeepPlate`.

    Raises
    ------
    DataError, ModelError
        If no part of the outline lies on a face.
    """
    region = mechanism.region
    size_mm = region.size_mm
    mesh = mesh or triangulate(region, _ACROSS, _BODY * size_mm)
    flat = PlaneStressPlate(mesh, mechanism.material, mechanism.plate_mm)
    supports = supports_of(flat, mechanism, size_mm)
    plate = DeepPlate(mesh, mechanism.material, mechanism.plate_mm, *(() if order is None else (order,)))
    held = [plate.coefficients(nodes, way) for nodes in supports.fixed for way in range(3)]
    held += [plate.coefficients(nodes, "xy".index(component)) for nodes, component in supports.slides]
    held += [plate.coefficients(nodes, way) for nodes in supports.driven for way in range(3)]
    body = plate.supported(np.concatenate(held))
    moved = body.sag(STANDARD_GRAVITY_MM_S2)
    sag_mm = {
        name: plate.middle_mm(moved, (abs(x) if mechanism.mirrored else x, y))
        for name, (x, y) in mechanism.probes.items()
    }
    return OutOfPlane(body.modes_hz(count), sag_mm)
