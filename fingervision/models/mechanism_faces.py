"""Nodes of a meshed mechanism that are fixed, slide or are driven, and a test whether these supports suffice."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DataError
from fingervision.models.mechanism import Drive, Face, Mechanism
from fingervision.models.plane_stress import PlaneStressPlate

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_ON = 1e-7
"""Distance from a face's box within which a node counts as lying on the face, as a share of the body's size."""

_LEVER = 1e-6
"""Lever arms across a component that are shorter than this share of the face's extent do not prevent rotation."""


def nodes_on(plate: PlaneStressPlate, face: Face, mechanism: Mechanism, size_mm: float) -> Indices:
    """Nodes of the outline inside a face's box.

    Raises
    ------
    DataError
        If no part of the outline lies in the box.
    """
    x, y = plate.nodes_mm
    x0, x1, y0, y1 = face.box_mm
    near = _ON * size_mm
    outline = np.unique(plate.outline_edges)
    inside = (x >= x0 - near) & (x <= x1 + near) & (y >= y0 - near) & (y <= y1 + near)
    nodes = outline[inside[outline]]
    if nodes.size < 2:
        raise DataError(
            f"face {face.name} of {mechanism.name} must hold a part of the outline, but its box "
            f"[{x0:g}, {x1:g}, {y0:g}, {y1:g}] mm holds none."
        )
    return np.asarray(nodes)


def mean_weights(plate: PlaneStressPlate, nodes: Indices) -> Array:
    """Weights of the nodes in the mean motion of a face (those of a uniform load), shape (k,), with sum 1."""
    edges = plate.outline_edges[:, np.all(np.isin(plate.outline_edges, nodes), axis=0)]
    x, y = plate.nodes_mm
    length = np.hypot(x[edges[1]] - x[edges[0]], y[edges[1]] - y[edges[0]])
    total = np.zeros(x.size)
    for row, share in zip(edges, (1.0 / 6.0, 1.0 / 6.0, 4.0 / 6.0), strict=True):
        np.add.at(total, row, share * length)
    weights = total[nodes]
    return np.asarray(weights / weights.sum() if weights.sum() > 0.0 else np.full(nodes.size, 1.0 / nodes.size))


def moves_in_the_mean(plate: PlaneStressPlate, nodes: Indices, drive: Drive) -> bool:
    """Whether a drive prescribes the mean motion of its face, not the motion of every node.

    A face that may turn moves in the mean. So does a face that may slide and is parallel to its drive, because
    prescribing the motion along it at every node would let it rotate by stretching alone; `turns` then decides whether
    its mean rotation is free.
    """
    components = driven_components(drive)
    places = plate.nodes_mm[:, nodes]
    spread = np.ptp(places, axis=1)
    parallel = len(components) == 1 and spread["yx".index(components[0])] < _LEVER * np.hypot(*spread)
    return bool(drive.turns == "free" or parallel)


def driven_components(drive: Drive) -> tuple[str, ...]:
    """Components that a drive prescribes: x and y if the face is guided, else that of the drive."""
    if drive.across == "held":
        return "x", "y"
    return ("x",) if drive.direction[0] != 0.0 else ("y",)


def per_input_of(mechanism: Mechanism) -> Array:
    """Motion of every driven face per 1 mm of input, shape (drives,)."""
    return np.array([drive.per_input for drive in mechanism.drives])


@dataclass(frozen=True, slots=True, eq=False)
class Supports:
    """Nodes on the supported and driven faces of a mechanism.

    Parameters
    ----------
    fixed : tuple of ndarray of int
        Nodes of every fixed face.
    slides : tuple of (ndarray of int, str)
        Nodes of every sliding face, with the component that is fixed.
    driven : tuple of ndarray of int
        Nodes of every driven face.
    """

    fixed: tuple[Indices, ...]
    slides: tuple[tuple[Indices, str], ...]
    driven: tuple[Indices, ...]


def supports_of(plate: PlaneStressPlate, mechanism: Mechanism, size_mm: float) -> Supports:
    """Find the nodes on every supported or driven face.

    Raises
    ------
    DataError
        If a face contains no node, a driven face is fixed or shares nodes with another one, or no face is fixed.
    """
    fixed = tuple(nodes_on(plate, face, mechanism, size_mm) for face in mechanism.fixed)
    slides = tuple((nodes_on(plate, face, mechanism, size_mm), held) for face, held in mechanism.slides)
    driven = tuple(nodes_on(plate, drive.face, mechanism, size_mm) for drive in mechanism.drives)
    if not fixed and not slides and len(driven) == 1:
        raise DataError(f"{mechanism.name} must have a [[fixed]] face, but has none.")
    held = {"x": list(fixed), "y": list(fixed)}
    for nodes, component in slides:
        held[component].append(nodes)
    for place, (drive, own) in enumerate(zip(mechanism.drives, driven, strict=True)):
        for component, share in zip("xy", drive.direction, strict=True):
            both = component in driven_components(drive) and any(np.intersect1d(n, own).size for n in held[component])
            if both and share * drive.per_input != 0.0:
                raise DataError(
                    f"The drive of {mechanism.name} must be free to move, but its face {drive.face.name} is fixed too."
                )
        for other, theirs in zip(mechanism.drives[:place], driven[:place], strict=True):
            if np.intersect1d(own, theirs).size:
                raise DataError(
                    f"Driven faces {other.face.name} and {drive.face.name} of {mechanism.name} must be apart, but "
                    "share a part of the outline; shorten one of their boxes, or leave one of them out."
                )
    return Supports(fixed, slides, driven)
