from dataclasses import replace

import numpy as np
import pytest
import skfem
from scipy.sparse.linalg import eigsh, splu

from fingervision.domain.gripper import Material
from fingervision.models.mechanism_equilibrium import contact_forces_n
from fingervision.models.plane_stress import PlaneStressPlate
from fingervision.models.reference_mesh import PlaneMesh

STEEL = Material("test", 1000.0, 0.3, 1000.0, 1.0)
PATCH = 1e-10
PLATE_MM = 2.0


def rectangle(length: float, height: float, along: int, across: int, distort: float = 0.0) -> PlaneMesh:
    flat = skfem.MeshTri.init_tensor(np.linspace(0, length, along + 1), np.linspace(0, height, across + 1))
    if distort:
        inside = np.setdiff1d(np.arange(flat.p.shape[1]), flat.boundary_nodes())
        flat.p[:, inside] += distort * np.random.default_rng(3).uniform(-1, 1, (2, inside.size))
    corners = flat.t
    edges = np.sort(np.hstack([corners[[0, 1]], corners[[1, 2]], corners[[0, 2]]]), axis=0)
    unique, place = np.unique(edges, axis=1, return_inverse=True)
    middles = 0.5 * (flat.p[:, unique[0]] + flat.p[:, unique[1]])
    triangles = np.vstack([corners, flat.p.shape[1] + place.reshape(3, -1)])
    return PlaneMesh(np.hstack([flat.p, middles]), triangles)


def edge_load(plate: PlaneStressPlate, dofs: np.ndarray, edge: np.ndarray, n_mm: float) -> np.ndarray:
    """Forces on the nodes by an even load along the upright part of the outline whose nodes are marked."""
    load, y = np.zeros(plate.unknowns), plate.nodes_mm[1]
    for a, b, m in plate.outline_edges[:, np.all(edge[plate.outline_edges], axis=0)].T:
        load[dofs[[a, b, m]]] += n_mm * abs(y[a] - y[b]) * np.array([1, 1, 4]) / 6
    return load


def solve(plate: PlaneStressPlate, held: np.ndarray, values: np.ndarray, load: np.ndarray) -> np.ndarray:
    free = np.setdiff1d(np.arange(plate.unknowns), held)
    moved = np.zeros(plate.unknowns)
    moved[held] = values
    K = plate.stiffness_n_mm
    moved[free] = splu(K[free][:, free].tocsc()).solve((load - K @ moved)[free])
    return moved


def test_constant_strain_passes_through_distorted_triangles() -> None:
    plate = PlaneStressPlate(rectangle(4.0, 3.0, 4, 3, distort=0.25), STEEL, PLATE_MM)
    x, y = plate.nodes_mm
    exact = np.zeros(plate.unknowns)
    exact[plate.x_dofs], exact[plate.y_dofs] = 1e-3 * (2 * x + y), 1e-3 * (-x + 3 * y)
    edge = (x < 1e-9) | (x > 4 - 1e-9) | (y < 1e-9) | (y > 3 - 1e-9)
    held = np.concatenate([plate.x_dofs[edge], plate.y_dofs[edge]])
    moved = solve(plate, held, exact[held], np.zeros(plate.unknowns))
    assert moved == pytest.approx(exact, abs=PATCH * np.abs(exact).max())
    sx, sy = np.array([[1, 0.3], [0.3, 1]]) @ [2e-3, 3e-3] * 1000.0 / (1 - 0.09)
    assert plate.von_mises_mpa(moved) == pytest.approx(np.sqrt(sx**2 - sx * sy + sy**2), rel=1e-9)


def test_contact_patch_presses_evenly() -> None:
    plate = PlaneStressPlate(rectangle(4.0, 3.0, 4, 3, distort=0.25), STEEL, PLATE_MM)
    x, y = plate.nodes_mm
    pressed, low = x < 1e-9, y < 1e-9
    held = np.concatenate([plate.x_dofs[x > 4 - 1e-9], plate.y_dofs[low]])
    load = np.zeros(plate.unknowns)
    free = np.setdiff1d(np.arange(plate.unknowns), held)
    face = plate.x_dofs[pressed]
    unit = np.zeros((plate.unknowns, face.size))
    unit[face, np.arange(face.size)] = 1.0
    moved = np.zeros_like(unit)
    moved[free] = splu(plate.stiffness_n_mm[free][:, free].tocsc()).solve(unit[free])
    forces = contact_forces_n(0.5 * (moved[face] + moved[face].T), np.full(face.size, -1e-3))
    strain = (moved @ forces + load)[plate.x_dofs] / (4.0 - x + 1e-300)
    assert strain[x < 3.9] == pytest.approx(1e-3 / 4.0, rel=1e-8)
    assert forces.sum() == pytest.approx(1000.0 * 1e-3 / 4.0 * 3.0 * PLATE_MM, rel=1e-8)


def test_timoshenko_cantilever() -> None:
    length, height, force = 20.0, 2.0, 1.0
    # Poisson's ratio is 0, because the formula does not include the restraint of lateral contraction by the clamp.
    plate = PlaneStressPlate(rectangle(length, height, 40, 4), replace(STEEL, poisson_ratio=0.0), PLATE_MM)
    x, y = plate.nodes_mm
    inertia, area, shear = PLATE_MM * height**3 / 12, PLATE_MM * height, 500.0
    left, right = x < 1e-9, x > length - 1e-9
    load = edge_load(plate, plate.y_dofs, right, force / height)
    held = np.concatenate([plate.x_dofs[left], plate.y_dofs[left]])
    moved = solve(plate, held, np.zeros(held.size), load)
    tip = float(moved[plate.y_dofs[right & (np.abs(y - 1.0) < 1e-9)]][0])
    exact = force * length**3 / (3 * 1000.0 * inertia) + 1.2 * force * length / (shear * area)
    assert tip == pytest.approx(exact, rel=1e-3)


def test_cantilever_modes() -> None:
    length, height = 100.0, 1.0
    plate = PlaneStressPlate(rectangle(length, height, 100, 1), STEEL, PLATE_MM)
    left = plate.nodes_mm[0] < 1e-9
    held = np.concatenate([plate.x_dofs[left], plate.y_dofs[left]])
    free = np.setdiff1d(np.arange(plate.unknowns), held)
    K, M = plate.stiffness_n_mm[free][:, free].tocsc(), plate.mass_t[free][:, free].tocsc()
    squared = np.sort(eigsh(K, 3, M, sigma=0.0, return_eigenvectors=False, v0=np.ones(free.size)))
    beta = np.array([1.8751, 4.6941, 7.8548])
    expected = (beta / length) ** 2 * np.sqrt(1000.0 * height**2 / (12.0 * STEEL.density_t_mm3))
    # The beam is slender: shear and rotational inertia lower its third frequency by 0.1 %.
    assert np.sqrt(squared) == pytest.approx(expected, rel=2e-3)


def test_elliptic_membrane() -> None:
    """NAFEMS LE1 (Standard Benchmarks, R0015, 1990): 92.7 MPa at the inner ellipse's end.

    Geometry, load and value as given by Altair OptiStruct's verification OS-V: 0010 and femorph-solver's gallery, both
    public. The edge at that point is free, so that the von Mises stress is the stress along it.
    """
    material, thickness = Material("steel", 210e3, 0.3, 7800.0, 1.0), 0.1
    grid = rectangle(1.0, 1.0, 72, 72)
    s, t = grid.nodes_mm[0], grid.nodes_mm[1] * np.pi / 2
    place = np.stack([(2.0 + 1.25 * s) * np.cos(t), (1.0 + 1.75 * s) * np.sin(t)])
    plate = PlaneStressPlate(PlaneMesh(place, grid.triangles), material, thickness)
    x, y = plate.nodes_mm
    load = np.zeros(plate.unknowns)
    outer = (x / 3.25) ** 2 + (y / 2.75) ** 2 > 1.0 - 1e-6
    edges = plate.outline_edges
    points, weights = np.polynomial.legendre.leggauss(3)
    for edge in edges[:, np.all(outer[edges], axis=0)].T:
        for q, weight in zip(points, weights, strict=True):
            shape = np.array([q * (q - 1) / 2, q * (q + 1) / 2, 1 - q * q])
            slope = np.array([q - 0.5, q + 0.5, -2 * q])
            normal = np.array([slope @ y[edge], -(slope @ x[edge])])
            normal *= np.sign(normal @ [shape @ x[edge], shape @ y[edge]])
            load[plate.x_dofs[edge]] += 10.0 * thickness * weight * shape * normal[0]
            load[plate.y_dofs[edge]] += 10.0 * thickness * weight * shape * normal[1]
    held = np.concatenate([plate.x_dofs[x < 1e-9], plate.y_dofs[y < 1e-9]])
    stress = plate.von_mises_mpa(solve(plate, held, np.zeros(held.size), load))
    corners = plate.at_corners(stress)
    at_d = np.argmin(np.hypot(x[: corners.size] - 2.0, y[: corners.size]))
    # The value is printed with three digits.
    assert corners[at_d] == pytest.approx(92.7, rel=3e-3)


def test_tapered_membrane_vibrates() -> None:
    """NAFEMS FV32 (Abbassian, Dawswell, Knowles, Selected benchmarks for natural frequency analysis, 1987).

    Values as given by ENERCALC 3D's verification problem F-03 and Altair OptiStruct's OS-V: 0440, both public. They are
    of a mesh of 16 by 8 elements, and public results of other programs lie up to 0.5 % from them.
    """
    material = Material("steel", 200e3, 0.3, 8000.0, 1.0)
    grid = rectangle(1.0, 1.0, 24, 12)
    s, t = grid.nodes_mm
    place = 1e3 * np.stack([10.0 * s, (5.0 - 4.0 * s) * (t - 0.5)])
    plate = PlaneStressPlate(PlaneMesh(place, grid.triangles), material, 50.0)
    root = plate.nodes_mm[0] < 1e-6
    free = np.setdiff1d(np.arange(plate.unknowns), np.concatenate([plate.x_dofs[root], plate.y_dofs[root]]))
    K, M = plate.stiffness_n_mm[free][:, free].tocsc(), plate.mass_t[free][:, free].tocsc()
    squared = np.sort(eigsh(K, 6, M, sigma=0.0, return_eigenvectors=False, v0=np.ones(free.size)))
    published = [44.623, 130.03, 162.70, 246.05, 379.90, 391.44]
    assert np.sqrt(squared) / (2.0 * np.pi) == pytest.approx(published, rel=5e-3)
