"""An elastic plate in plane stress: quadratic triangles, small or large displacements."""

from functools import cached_property
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from skfem.helpers import ddot, dot, eye, mul, sym_grad, trace, transpose

from fingervision.domain.gripper import Material
from fingervision.models.mesh_outline import PlaneMesh

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_CORNERS = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def _stress(strain: Any, material: Material) -> Any:
    """Plane-stress law, thickness direction free: Timoshenko and Goodier, Theory of Elasticity, chapter 2."""
    E, nu = material.youngs_modulus_mpa, material.poisson_ratio
    return E / (1.0 + nu) * strain + E * nu / (1.0 - nu**2) * eye(trace(strain), 2)


def _symmetric(a: Any) -> Any:
    return 0.5 * (a + transpose(a))


class PlaneStressPlate:
    """A meshed plate of one material and thickness.

    Parameters
    ----------
    mesh : PlaneMesh
        Quadratic triangles.
    material : Material
        Linear elastic; the St. Venant-Kirchhoff law in large displacements, right where strains are a few per cent.
    plate_mm : float
        Thickness.
    """

    def __init__(self, mesh: PlaneMesh, material: Material, plate_mm: float) -> None:
        self.material = material
        self.plate_mm = plate_mm
        self._mesh = skfem.MeshTri2(mesh.nodes_mm, mesh.triangles)
        self._element = skfem.ElementVector(skfem.ElementTriP2())
        self._basis = skfem.Basis(self._mesh, self._element, intorder=4)
        nodal, edge = self._basis.nodal_dofs, self._basis.facet_dofs
        self.x_dofs: Indices = np.concatenate([nodal[0], edge[0]])
        self.y_dofs: Indices = np.concatenate([nodal[1], edge[1]])
        self.nodes_mm: Array = self._basis.doflocs[:, self.x_dofs]

    @property
    def unknowns(self) -> int:
        """Number of displacement components."""
        return int(self._basis.N)

    @property
    def corner_triangles(self) -> Indices:
        """Corners of the triangles as places in `nodes_mm`, shape (3, m)."""
        return np.asarray(self._mesh.t[:3])

    @cached_property
    def outline_edges(self) -> Indices:
        """Edges of the outline as places in `nodes_mm`: two ends and the middle, shape (3, k)."""
        facets = self._mesh.boundary_facets()
        corners = int(self._basis.nodal_dofs.shape[1])
        return np.vstack([self._mesh.facets[:, facets], corners + facets])

    @cached_property
    def stiffness_n_mm(self) -> csr_matrix:
        """Linear stiffness matrix."""
        material, plate_mm = self.material, self.plate_mm

        def work(u: Any, v: Any, _: Any) -> Any:
            return plate_mm * ddot(_stress(sym_grad(u), material), sym_grad(v))

        return csr_matrix(skfem.BilinearForm(work).assemble(self._basis))

    @cached_property
    def mass_t(self) -> csr_matrix:
        """Consistent mass matrix in tonnes, the unit that goes with N and mm."""
        weight = self.material.density_t_mm3 * self.plate_mm

        def inertia(u: Any, v: Any, _: Any) -> Any:
            return weight * dot(u, v)

        return csr_matrix(skfem.BilinearForm(inertia).assemble(self._basis))

    def internal_force_n(self, displacement_mm: Array) -> tuple[csr_matrix, Array]:
        """Tangent stiffness and nodal forces of the deformed plate (total Lagrangian, St. Venant-Kirchhoff).

        Source: Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, chapters 6 and 9.
        """
        material, plate_mm = self.material, self.plate_mm
        gradient = self._basis.interpolate(displacement_mm).grad
        deformation = gradient + eye(np.ones(gradient.shape[2:]), 2)
        strain = 0.5 * (mul(transpose(deformation), deformation) - eye(np.ones(gradient.shape[2:]), 2))
        stress = _stress(strain, material)

        def tangent(u: Any, v: Any, _: Any) -> Any:
            du = _symmetric(mul(transpose(deformation), u.grad))
            dv = _symmetric(mul(transpose(deformation), v.grad))
            return plate_mm * (ddot(_stress(du, material), dv) + ddot(mul(u.grad, stress), v.grad))

        def force(v: Any, _: Any) -> Any:
            return plate_mm * ddot(mul(deformation, stress), v.grad)

        return skfem.BilinearForm(tangent).assemble(self._basis), skfem.LinearForm(force).assemble(self._basis)

    def von_mises_mpa(self, displacement_mm: Array) -> Array:
        """Von Mises stress at the triangles' corners, shape (3, m); Cauchy stress of small displacements."""
        corners = skfem.Basis(self._mesh, self._element, quadrature=(_CORNERS, np.full(3, 1.0 / 6.0)))
        gradient = corners.interpolate(displacement_mm).grad
        stress = _stress(_symmetric(gradient), self.material)
        sx, sy, txy = stress[0, 0], stress[1, 1], stress[0, 1]
        return np.asarray(np.sqrt(sx**2 - sx * sy + sy**2 + 3.0 * txy**2)).T

    def at_corners(self, values: Array) -> Array:
        """Mean over the triangles that meet at each corner node; shape (number of corners,)."""
        triangles = self.corner_triangles
        size = int(self._basis.nodal_dofs.shape[1])
        total = np.bincount(triangles.ravel(), weights=values.ravel(), minlength=size)
        return np.asarray(total / np.bincount(triangles.ravel(), minlength=size))
