"""Quadratic triangles of a plane body: exact outline, Delaunay triangulation, and nodes that repel each other.

The outline is divided into edges of the required size, and its nodes stay fixed. Inner nodes start on squares of the
required size and move under forces along the edges (Persson and Strang, A simple mesh generator in MATLAB, SIAM Review
46 (2004) 329), are triangulated again as they move, and are finally placed at the area-weighted mean of their
triangles' circumcentres (Alliez et al., Variational tetrahedral meshing, ACM Transactions on Graphics 24 (2005) 617, in
the plane). Midside nodes lie on the arcs of the outline.
"""

from fingervision.domain.errors import ModelError
from fingervision.models.mesh_size import size_field
from fingervision.models.node_relaxation import MOST_NODES, relaxed_nodes, seeded_nodes
from fingervision.models.outline_division import (
    divided_outline,
    flat_sides,
    halved,
    missing_sides,
    outline_points,
    with_middles,
)
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_mesh import LEAST_QUALITY, PlaneMesh

__all__ = ["LEAST_QUALITY", "PlaneMesh", "triangulate"]

_MENDING = 12
_REFINED = 4
"""Rounds of dividing the outline at flat triangles; at sharp corners of the outline triangles must stay flat."""


def triangulate(region: PlanarRegion, across: float, body_mm: float) -> PlaneMesh:
    """Mesh a plane body.

    Parameters
    ----------
    region : PlanarRegion
        The body.
    across : float
        Number of triangles across thin material.
    body_mm : float
        Largest edge length.

    Raises
    ------
    ModelError
        If the body's finest part is so small compared with its size that too many triangles would be needed.
    """
    field = size_field(region, across, body_mm)
    sides = divided_outline(region, field)
    refined = 0
    for _ in range(_MENDING):
        inside = seeded_nodes(region, field, outline_points(sides))
        if inside.shape[1] + len(sides) > MOST_NODES:
            raise ModelError(
                f"The body must be meshed by at most {MOST_NODES} nodes, but {inside.shape[1] + len(sides)} are "
                "needed: its thinnest part is too thin for the size of the body."
            )
        corners, triangles = relaxed_nodes(region, field, outline_points(sides), inside)
        missing = missing_sides(sides, triangles)
        if not missing and refined < _REFINED:
            # Flat triangles whose corners all lie on the outline show that its edges differ too much in length there.
            missing, refined = flat_sides(sides, corners, triangles), refined + 1
        if not missing:
            return with_middles(corners, triangles, sides)
        sides = halved(sides, missing)
    raise ModelError("The outline could not be meshed; check that its shapes do not nearly touch each other.")
