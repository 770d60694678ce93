"""The bodies of a mechanism: the connected pieces of the drawing that remain when its flexures are removed."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.models.flexure_span import span_of
from fingervision.models.layers import Part, Sheet, parts_of, pieces_of, plan_of, points_in
from fingervision.models.mechanism import Mechanism
from fingervision.models.planar_region import Loop, PlanarRegion
from fingervision.models.plane_stress import PlaneStressPlate

# Pose of a body: the rigid motion that fits the motions of many of its points best.

Array = NDArray[np.float64]

MRAD = 1e3


@dataclass(frozen=True, slots=True)
class BodyPose:
    """Position and rotation of a body relative to rest.

    Parameters
    ----------
    x_mm, y_mm : float
        Displacement of the body's reference point (the centroid of its area as drawn), in the drawing's axes.
    angle_mrad : float
        Rotation from x towards y.
    """

    x_mm: float
    y_mm: float
    angle_mrad: float


def rigid_motion(places_mm: Array, moved_mm: Array, weights: Array, about_mm: Array, *, large: bool) -> BodyPose:
    """Fit the rigid motion that leaves the smallest weighted sum of squared distances.

    For large displacements, the rotation is computed by the method of Kabsch (1976), Acta Crystallographica A 32, 922,
    DOI 10.1107/S0567739476001873, in the plane. For small displacements, the rotation is linearised, so that the pose
    is proportional to the displacements.

    Parameters
    ----------
    places_mm, moved_mm : ndarray of float, shape (2, n)
        Positions of the points at rest, and their displacements.
    weights : ndarray of float, shape (n,)
        Weight of each point, such as the area that it represents; not all zero.
    about_mm : ndarray of float, shape (2,)
        Reference point whose motion is returned.
    large : bool
        Whether the displacements are large.
    """
    share = weights / weights.sum()
    middle = places_mm @ share
    arm = places_mm - middle[:, None]
    mean = moved_mm @ share
    there = moved_mm - mean[:, None]
    reach = about_mm - middle
    across = float(share @ (arm[0] * there[1] - arm[1] * there[0]))
    if not large:
        angle = across / float(share @ np.sum(arm**2, axis=0))
        x, y = mean + angle * np.array([-reach[1], reach[0]])
        return BodyPose(float(x), float(y), MRAD * angle)
    angle = float(np.arctan2(across, share @ np.sum(arm * (arm + there), axis=0)))
    turn = np.array([[np.cos(angle) - 1.0, -np.sin(angle)], [np.sin(angle), np.cos(angle) - 1.0]])
    x, y = mean + turn @ reach
    return BodyPose(float(x), float(y), MRAD * angle)


Flags = NDArray[np.bool_]

_ON = 1e-6
"""Distance from a face's box within which the outline counts as lying on it, as a share of the drawing's size."""


_KEPT: dict[Any, "tuple[LinkBody, ...]"] = {}
_MOST_KEPT = 8
"""Number of drawings whose bodies are kept: they take half a second to cut out."""


@dataclass(frozen=True, slots=True, eq=False)
class LinkBody:
    """One body of a mechanism.

    Parameters
    ----------
    name : str
        Name of the first named shape of the drawing that lies mostly in the body; letters, digits, `_` and `-` only, so
        that it can be part of a column's name.
    is_fixed : bool
        Whether a fixed face supports the body; its pose is then not computed.
    outline, holes : Loop, tuple of Loop
        Outline and holes of the body, without the flexures.
    centroid_mm : ndarray of float, shape (2,)
        Centroid of the body's area, the reference point of its pose.
    sheets : tuple of Sheet
        Parts of the layers in which the body lies.
    """

    name: str
    is_fixed: bool
    outline: Loop
    holes: tuple[Loop, ...]
    centroid_mm: Array
    sheets: tuple[Sheet, ...] = ()

    def holds(self, points_mm: Array, layer: int | None = None) -> Flags:
        """Whether points, shape (2, n), lie in the body, or in its part in one layer; arcs are replaced by chords."""
        if layer is None:
            return Part(self.outline, self.holes).holds(points_mm)
        own = [sheet.part.holds(points_mm) for sheet in self.sheets if sheet.layer == layer]
        return np.asarray(np.any([np.zeros(points_mm.shape[1], dtype=bool), *own], axis=0))


def bodies_of(mechanism: Mechanism) -> tuple[LinkBody, ...]:
    """Divide a mechanism, whose drawing is already checked, into its bodies; cached, because every model uses them."""
    region = mechanism.region
    key = (region.steps, region.marks_mm, mechanism.flexures, mechanism.body_names, mechanism.fixed, mechanism.layers)
    if key not in _KEPT:
        while len(_KEPT) >= _MOST_KEPT:
            _KEPT.pop(next(iter(_KEPT)))
        _KEPT[key] = _divided(mechanism, region)
    return _KEPT[key]


def _divided(mechanism: Mechanism, region: PlanarRegion) -> tuple[LinkBody, ...]:
    by_layer = mechanism.by_layer
    slabs = [(f.layer, span_of(f, by_layer[f.layer]).slab) for f in mechanism.flexures]
    cut = {
        layer: PlanarRegion((*own.steps, *((False, slab) for at, slab in slabs if at == layer)), own.marks_mm)
        for layer, own in by_layer.items()
    }
    found = []
    for sheets in pieces_of(cut, mechanism.joints):
        parts = parts_of(plan_of(sheets, region.marks_mm)) if len(sheets) > 1 else [sheets[0].part]
        loops = (parts[0].outline, *parts[0].holes)
        held = any(
            face.holds(side, _ON * region.size_mm).any() for face in mechanism.fixed for side in loops[0].sides_mm
        )
        found.append(LinkBody("", held, loops[0], loops[1:], _centroid_mm(loops), sheets))
    names = _names(mechanism, [body.outline for body in found])
    return tuple(replace(body, name=name) for body, name in zip(found, names, strict=True))


def plate_poses(
    plate: PlaneStressPlate, bodies: Sequence[LinkBody], moved_mm: Array, *, large: bool
) -> dict[str, BodyPose]:
    """Pose of every moving body, from the displacements of a mesh.

    Each midside node represents a third of each of its triangles, which integrates the quadratic displacements of a
    triangle exactly.

    Parameters
    ----------
    plate : PlaneStressPlate
        The mesh, with or without the flexures between the bodies.
    bodies : sequence of LinkBody
        Bodies.
    moved_mm : ndarray of float, shape (unknowns,)
        Displacements of the nodes.
    large : bool
        Whether the displacements are large.
    """
    return {name: rigid_motion(plate.nodes_mm, np.stack([moved_mm[plate.x_dofs], moved_mm[plate.y_dofs]]), weights,
                               centroid, large=large)
            for name, (weights, centroid) in body_weights(plate, bodies).items()}  # fmt: skip


def body_weights(plate: PlaneStressPlate, bodies: Sequence[LinkBody]) -> Mapping[str, tuple[Array, Array]]:
    """Area represented by each node, shape (nodes,), and the centroid, for every moving body."""
    corners = plate.nodes_mm[:, plate.corner_triangles]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    third = np.abs(one[0] * two[1] - one[1] * two[0]) / 6.0
    middles = corners.mean(axis=1)
    edges = plate.nodes_of_triangles[3:].T
    found: dict[str, tuple[Array, Array]] = {}
    for number, body in enumerate(bodies):
        if not body.is_fixed:
            own = body.holds(middles) if plate.pieces is None else plate.pieces == number
            shares = np.repeat(third[own], 3)
            weights = np.asarray(np.bincount(edges[own].ravel(), shares, plate.x_dofs.size), dtype=np.float64)
            found[body.name] = weights, body.centroid_mm
    return found


def column_name(name: str) -> str:
    """Name of a body in a form that can be part of a column's name."""
    return re.sub(r"[^0-9A-Za-z_-]+", "_", name).strip("_") or "body"


def _names(mechanism: Mechanism, pieces: Sequence[Loop]) -> list[str]:
    """Name every piece by the first named shape that contains more than half of the piece's area.

    A piece of which no shape covers more than half takes the name of a shape that has no larger part in another piece,
    such as a bar that a notch divides in two. All other pieces are numbered.
    """
    names: dict[int, str] = {}
    halved: dict[int, str] = {}
    for (added, shape), name in zip(mechanism.bodies, mechanism.body_names, strict=False):
        if added and name:
            points = points_in(shape)
            share = [int(loop.holds(points).sum()) for loop in pieces]
            mostly = 2 * max(share) > points.shape[1]
            (names if mostly else halved).setdefault(int(np.argmax(share)), column_name(name))
    names = halved | names
    found: list[str] = []
    for number in range(len(pieces)):
        name = names.get(number, f"body_{number + 1}")
        same = sum(other == name or other.startswith(f"{name}_part") for other in found)
        found.append(f"{name}_part{same + 1}" if same else name)
    return found


def _centroid_mm(loops: Sequence[Loop]) -> Array:
    """Centroid of an area by Green's formula; holes run in the opposite direction and are subtracted."""
    area, moment = 0.0, np.zeros(2)
    for loop in loops:
        a, b = loop.corners_mm, np.roll(loop.corners_mm, -1, axis=1)
        cross = a[0] * b[1] - a[1] * b[0]
        area += 0.5 * float(cross.sum())
        moment += (a + b) @ cross / 6.0
    return np.asarray(moment / area)
