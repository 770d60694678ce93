"""Outlines and meshes of plane bodies: closed formulas for areas, and convergence rates of elements."""

from dataclasses import replace

import numpy as np
import pytest
import skfem
from scipy.sparse.linalg import splu

from fingervision.domain.errors import DataError
from fingervision.domain.gripper import Gripper, Material
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_shapes import Ellipse, Polygon, Shape, bar, box
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.reference_mesh import ElementSize, mesh_outline
from fingervision.models.triangulate import LEAST_QUALITY, PlaneMesh, triangulate

AREA = 1e-6
"""Relative tolerance of areas: quadratic edges follow an arc to 1e-5 of its radius, and arcs are a part of the
outline."""


def region(*steps: tuple[bool, Shape]) -> PlanarRegion:
    return PlanarRegion(steps)


def area_mm2(mesh: PlaneMesh) -> float:
    basis = skfem.Basis(skfem.MeshTri2(mesh.nodes_mm, mesh.triangles), skfem.ElementTriP2(), intorder=4)
    return float(basis.dx.sum())


BODIES = {
    "square with a round hole": (region((True, box(0, 4, 0, 4)), (False, Ellipse((2, 2), (1, 1)))), 16 - np.pi, 2),
    "square with an oblique ellipse": (
        region((True, box(0, 4, 0, 4)), (False, Ellipse((2, 2), (1.5, 0.5), 30.0))),
        16 - 0.75 * np.pi,
        2,
    ),
    "two boxes that share a side": (region((True, box(0, 1, 0, 1)), (True, box(1, 2, 0, 1))), 2.0, 1),
    "crossed bars": (region((True, bar(-3, 0, 3, 0, 1)), (True, bar(0, -3, 0, 3, 1))), 11.0, 1),
    "neck of two discs": (
        region((True, box(-5, 5, -2, 2)), (False, Ellipse((0, 2.1), (2, 2))), (False, Ellipse((0, -2.1), (2, 2)))),
        40 - 2 * (2 * np.pi - 2 * (0.1 * np.sqrt(4 - 0.01) + 4 * np.arcsin(0.05)) / 2),
        1,
    ),
    "a disc laid on a bar": (
        region((True, box(-4, 4, 0, 1)), (True, Ellipse((0, 1), (1, 1)))),
        8 + np.pi / 2,
        1,
    ),
}


@pytest.mark.parametrize("name", BODIES)
def test_area_and_loops_and_quality(name: str) -> None:
    body, area, loops = BODIES[name]
    assert len(body.loops) == loops
    mesh = triangulate(body, 4.0, 0.4)
    assert area_mm2(mesh) == pytest.approx(area, rel=AREA * 10.0)
    assert mesh.quality().min() > LEAST_QUALITY


@pytest.mark.parametrize("axis_deg", [100.0, 150.0])
@pytest.mark.parametrize("beside_mm", [-3e-6, -1e-5, 1e-5])
def test_a_slot_that_passes_close_by_a_corner_closes_the_outline(axis_deg: float, beside_mm: float) -> None:
    # The corner of the box and the disc's cut, and the side of the slot, leave a piece of outline that is too short to
    # be resolved.
    across = np.array([np.cos(np.radians(axis_deg)), np.sin(np.radians(axis_deg))])
    along = np.array([-across[1], across[0]])
    middle = np.array([1.0, 4.0]) + (beside_mm - 0.25) * across
    slot = bar(*(middle - 6.0 * along), *(middle + 6.0 * along), 0.5)
    body = region((True, box(-4, 4, 0, 4)), (False, Ellipse((0, 4), (1, 1))), (False, slot))
    x = np.linspace(-4.0, 4.0, 801)[1::2]
    y = np.linspace(0.0, 4.0, 401)[1::2]
    by_points = 32.0 * float(np.mean(body.holds(np.array([part.ravel() for part in np.meshgrid(x, y)]))))
    assert sum(loop.area_mm2 for loop in body.loops) == pytest.approx(by_points, abs=0.05)


def test_bodies_that_touch_in_a_point_are_refused() -> None:
    with pytest.raises(DataError, match=r"touches itself in a point at \(1, 1\) mm"):
        _ = region((True, box(0, 1, 0, 1)), (True, box(1, 2, 1, 2))).loops


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.0125, 0.05])
def test_thin_necks_are_fine_and_the_rest_is_not(gripper: Gripper, ratio: float) -> None:
    thin = replace(gripper, hinge=replace(gripper.hinge, thickness_mm=4.0 * ratio))
    mesh = mesh_outline(thin, ElementSize(0.2 * 4.0 * ratio, 2.5))
    assert mesh.quality().min() > LEAST_QUALITY
    assert mesh.triangles.shape[1] < 9000


def test_the_sample_meshed_anew_is_at_the_limit(gripper: Gripper) -> None:
    """Compared with the limit of fine meshes by another mesh generator: 7.7212, 2.0014 N/mm, 19.07 MPa/mm."""
    mesh = mesh_outline(gripper, ElementSize(0.2, 2.5))
    model = FiniteElementGripper(gripper, mesh=mesh, width_effect=False)
    assert model.respond(np.array([1.0])).gap_mm - 4.0 == pytest.approx([7.7212], rel=2e-5)
    assert model.force_per_input_n_mm == pytest.approx(2.0014, rel=5e-4)
    assert model.peak_stress().mpa_per_mm == pytest.approx(19.07, rel=2e-3)


def manufactured_errors(body_mm: float) -> tuple[float, float]:
    """Errors in L2 and H1 for a chosen smooth displacement, with its body force on a plate with a round hole."""
    E, nu = 1000.0, 0.3
    mesh = triangulate(region((True, box(0, 2, 0, 2)), (False, Ellipse((1, 1), (0.5, 0.5)))), 1.0, body_mm)
    plate = PlaneStressPlate(mesh, Material("unit", E, nu, 1.0, 1.0), 1.0)
    basis = skfem.Basis(
        skfem.MeshTri2(mesh.nodes_mm, mesh.triangles), skfem.ElementVector(skfem.ElementTriP2()), intorder=6
    )

    def exact(x: np.ndarray) -> np.ndarray:
        return np.stack([np.sin(x[0]) * np.cos(x[1]), np.cos(x[0] + 0.5 * x[1])])

    def slopes(x: np.ndarray) -> np.ndarray:
        s = np.sin(x[0] + 0.5 * x[1])
        return np.array([[np.cos(x[0]) * np.cos(x[1]), -np.sin(x[0]) * np.sin(x[1])], [-s, -0.5 * s]])

    def body_force(x: np.ndarray) -> np.ndarray:
        # -div sigma with sigma = E/(1+nu) e + E nu/(1-nu^2) tr(e) I; second derivatives by hand.
        sc, cs, c = np.sin(x[0]) * np.cos(x[1]), np.cos(x[0]) * np.sin(x[1]), np.cos(x[0] + 0.5 * x[1])
        u_xx, u_yy, u_xy = -sc, -sc, -cs
        v_xx, v_yy, v_xy = -c, -0.25 * c, -0.5 * c
        shear, bulk = E / (1 + nu), E * nu / (1 - nu**2)
        return -np.stack(
            [
                shear * (u_xx + 0.5 * (u_yy + v_xy)) + bulk * (u_xx + v_xy),
                shear * (v_yy + 0.5 * (v_xx + u_xy)) + bulk * (u_xy + v_yy),
            ]
        )

    load = skfem.LinearForm(lambda v, w: np.sum(body_force(w.x) * v, axis=0)).assemble(basis)
    moved = np.zeros(plate.unknowns)
    values = exact(plate.nodes_mm)
    edge = np.unique(plate.outline_edges)
    held = np.concatenate([plate.x_dofs[edge], plate.y_dofs[edge]])
    moved[plate.x_dofs], moved[plate.y_dofs] = values
    free = np.setdiff1d(np.arange(plate.unknowns), held)
    moved[free] = 0.0
    K = plate.stiffness_n_mm
    moved[free] = splu(K[free][:, free].tocsc()).solve((load - K @ moved)[free])
    found = basis.interpolate(moved)
    x = np.asarray(basis.global_coordinates())
    l2 = np.sqrt(np.sum(np.sum((np.asarray(found) - exact(x)) ** 2, axis=0) * basis.dx))
    h1 = np.sqrt(np.sum(np.sum((found.grad - slopes(x)) ** 2, axis=(0, 1)) * basis.dx))
    return float(l2), float(h1)


@pytest.mark.slow
def test_rates_of_convergence_to_a_manufactured_solution() -> None:
    """Quadratic elements: error of order h^3 in the displacement and h^2 in its slopes, on meshes of this mesher."""
    errors = np.array([manufactured_errors(h) for h in (0.15, 0.075, 0.0375)])
    rates = np.log2(errors[:-1] / errors[1:])
    assert rates[:, 0] == pytest.approx([3.0, 3.0], abs=0.35)
    assert rates[:, 1] == pytest.approx([2.0, 2.0], abs=0.25)


def test_polygon_either_way_round() -> None:
    corners = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0))
    for given in (corners, corners[::-1]):
        assert region((True, Polygon(given))).loops[0].area_mm2 == pytest.approx(2.0)
