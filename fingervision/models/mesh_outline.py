"""Mesh of the gripper's right half: curved quadratic triangles, fine at the notches."""

import importlib.util
from dataclasses import dataclass
from math import cos, radians, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import FingervisionError
from fingervision.domain.gripper import Gripper, PointMm

_RING_MM = 0.6


@dataclass(frozen=True, slots=True)
class ElementSize:
    """Edge lengths of the triangles.

    Parameters
    ----------
    notch_mm : float
        Along the notches.
    body_mm : float
        Far from them.
    """

    notch_mm: float
    body_mm: float


@dataclass(frozen=True, slots=True, eq=False)
class PlaneMesh:
    """Quadratic triangles in the plane; curved edges follow the notches.

    Parameters
    ----------
    nodes_mm : ndarray of float, shape (2, n)
        Places of corners and edge midpoints.
    triangles : ndarray of int, shape (6, m)
        Corners 0, 1, 2 and the midpoints of the edges 01, 12, 02.
    """

    nodes_mm: NDArray[np.float64]
    triangles: NDArray[np.int64]


def notch_centres_mm(gripper: Gripper) -> tuple[PointMm, ...]:
    """Centres of the four discs that cut the two hinges: radius + thickness / 2 to either side of each axis."""
    offset_mm = gripper.hinge.radius_mm + gripper.hinge.thickness_mm / 2.0
    lever = gripper.lever
    centres: list[PointMm] = []
    for (x_mm, y_mm), axis_deg in (
        (lever.hinge1_mm, lever.hinge1_axis_deg),
        (lever.hinge2_mm, lever.hinge2_axis_deg),
    ):
        across = (-sin(radians(axis_deg)), cos(radians(axis_deg)))
        centres += [(x_mm + side * offset_mm * across[0], y_mm + side * offset_mm * across[1]) for side in (-1, 1)]
    return tuple(centres)


def mesh_outline(gripper: Gripper, size: ElementSize) -> PlaneMesh:
    """Mesh the right half of a gripper with gmsh.

    Parameters
    ----------
    gripper : Gripper
        The drawing.
    size : ElementSize
        Edge lengths.

    Returns
    -------
    PlaneMesh
        One connected body.

    Raises
    ------
    FingervisionError
        Where gmsh is not installed, or the notches cut the body in two.
    """
    if importlib.util.find_spec("gmsh") is None:
        raise FingervisionError(
            "A gripper other than the reference must be meshed by gmsh, but gmsh is not installed; "
            "install it with: pip install 'fingervision[gmsh]'."
        )
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("half")
        _cut_half(gmsh.model.occ, gripper)
        _refine(gmsh, gripper, size)
        gmsh.model.mesh.generate(2)
        gmsh.model.mesh.setOrder(2)
        return _read(gmsh.model.mesh)
    except FingervisionError:
        raise
    except Exception as error:
        # gmsh raises the bare class, with a sentence of its own.
        raise FingervisionError(f"gmsh could not mesh the right half: {error}; check the links.") from error
    finally:
        gmsh.finalize()


def _polygon(occ: Any, corners_mm: list[PointMm]) -> int:
    points = [occ.addPoint(x, y, 0.0) for x, y in corners_mm]
    lines = [occ.addLine(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
    return int(occ.addPlaneSurface([occ.addCurveLoop(lines)]))


def _bar_corners_mm(x0: float, y0: float, x1: float, y1: float, width_mm: float) -> list[PointMm]:
    length = np.hypot(x1 - x0, y1 - y0)
    nx, ny = -(y1 - y0) / length * width_mm / 2.0, (x1 - x0) / length * width_mm / 2.0
    return [(x0 - nx, y0 - ny), (x1 - nx, y1 - ny), (x1 + nx, y1 + ny), (x0 + nx, y0 + ny)]


def _box_corners_mm(x0: float, x1: float, y0: float, y1: float) -> list[PointMm]:
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def _cut_half(occ: Any, gripper: Gripper) -> None:
    links = gripper.links
    outlines = [
        _box_corners_mm(*links.pillar_and_root_mm),
        _bar_corners_mm(*links.shuttle_from_mm, *links.shuttle_to_mm, links.shuttle_width_mm),
        _box_corners_mm(*links.drive_block_mm),
        _bar_corners_mm(*links.cross_bar_mm, links.cross_bar_width_mm),
        _bar_corners_mm(*links.finger_mm, links.finger_width_mm),
        list(links.tip_polygon_mm),
    ]
    surfaces = [(2, _polygon(occ, corners)) for corners in outlines]
    whole, _ = occ.fuse(surfaces[:1], surfaces[1:])
    radius_mm = gripper.hinge.radius_mm
    cutters = [(2, occ.addDisk(x, y, 0.0, radius_mm, radius_mm)) for x, y in notch_centres_mm(gripper)]
    far_mm = gripper.body.width_mm + gripper.body.height_mm
    cutters.append((2, occ.addRectangle(-far_mm, -far_mm, 0.0, far_mm, 3.0 * far_mm)))
    half, _ = occ.cut(whole, cutters)
    occ.synchronize()
    if len(half) != 1:
        raise FingervisionError(
            f"The right half must be one body, but the links and notches leave {len(half)} pieces; "
            "check that the links overlap and that no notch cuts through one of them."
        )


def _refine(gmsh: Any, gripper: Gripper, size: ElementSize) -> None:
    arcs = []
    for _, curve in gmsh.model.getEntities(1):
        if gmsh.model.getType(1, curve) in ("Circle", "Ellipse"):
            arcs.append(curve)
    field = gmsh.model.mesh.field
    distance = field.add("Distance")
    field.setNumbers(distance, "CurvesList", arcs)
    field.setNumber(distance, "Sampling", 400)
    threshold = field.add("Threshold")
    field.setNumber(threshold, "InField", distance)
    field.setNumber(threshold, "SizeMin", size.notch_mm)
    field.setNumber(threshold, "SizeMax", size.body_mm)
    field.setNumber(threshold, "DistMin", _RING_MM * gripper.hinge.thickness_mm)
    field.setNumber(threshold, "DistMax", 6.0 * gripper.hinge.thickness_mm)
    field.setAsBackgroundMesh(threshold)
    for option in ("MeshSizeFromPoints", "MeshSizeFromCurvature", "MeshSizeExtendFromBoundary"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)


def _read(mesh: Any) -> PlaneMesh:
    tags, coordinates, _ = mesh.getNodes()
    places = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    _, _, connections = mesh.getElements(2)
    triangles = np.asarray(connections[0], dtype=np.int64).reshape(-1, 6).T
    used = np.unique(triangles)
    places[used] = np.arange(used.size)
    place_of_tag = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    place_of_tag[tags.astype(np.int64)] = np.arange(tags.size)
    nodes_mm = coordinates.reshape(-1, 3)[place_of_tag[used], :2].T
    return PlaneMesh(np.ascontiguousarray(nodes_mm), places[triangles])
