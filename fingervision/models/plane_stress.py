"""An elastic plate in plane stress, meshed with quadratic triangles, for small or large displacements.

In a flexure restrained by its width, the material law lies between plane stress and plane strain (`width_effect`).
"""

from functools import cached_property
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix
from skfem.helpers import dot, eye, mul, trace, transpose

from fingervision.domain.gripper import Material
from fingervision.models.triangulate import PlaneMesh
from fingervision.models.width_effect import ConstrainedZone, HeldBodies, held_moduli, shares_at

# Find the element of a mesh in which a point lies, so that the point moves with this element.
#
# A fit through the nearest nodes would mix the motions of two bodies on both sides of a narrow gap.

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_NEWTON = 5
"""Newton steps on elements with a curved edge; each step squares the relative residual."""


def element_weights(nodes_mm: Array, triangles: Indices, point: tuple[float, float]) -> tuple[Indices, Array]:
    """Find the element that contains a point, or the nearest element, and the values of its shape functions there.

    Parameters
    ----------
    nodes_mm : ndarray of float, shape (2, n)
        Nodes.
    triangles : ndarray of int, shape (6, m)
        Corners, then the middles of edges first to second, second to third, first to third.
    point : (float, float)
        A point inside the body, or on its outline.

    Returns
    -------
    nodes : ndarray of int, shape (6,)
        Nodes of the element.
    weights : ndarray of float, shape (6,)
        Weights of the values at these nodes; their sum is 1.
    """
    a, b, c = (nodes_mm[:, row] for row in triangles[:3])
    p = np.array(point, dtype=np.float64)[:, None]
    area = _cross(b - a, c - a)
    # Distances outside the three edges: barycentric coordinates times heights.
    outside = np.max(
        [-_cross(q - p, r - p) * np.sign(area) / np.hypot(*(r - q)) for q, r in ((b, c), (c, a), (a, b))], axis=0
    )
    place = int(np.argmin(outside))
    own = triangles[:, place]
    at = np.array([_cross(p[:, 0] - a[:, place], (c - a)[:, place]), _cross((b - a)[:, place], p[:, 0] - a[:, place])])
    at = at / area[place]
    for _ in range(_NEWTON):
        values, slopes = _shapes(at)
        at = at + np.linalg.solve(nodes_mm[:, own] @ slopes, p[:, 0] - nodes_mm[:, own] @ values)
    return np.asarray(own), _shapes(at)[0]


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[0] * b[1] - a[1] * b[0])


def _shapes(at: Array) -> tuple[Array, Array]:
    """Quadratic shape functions, shape (6,), and their derivatives, shape (6, 2), at barycentric (1 - s - t, s, t)."""
    s, t = at
    r = 1.0 - s - t
    values = np.array([r * (2 * r - 1), s * (2 * s - 1), t * (2 * t - 1), 4 * r * s, 4 * s * t, 4 * r * t])
    by_s = [1 - 4 * r, 4 * s - 1, 0.0, 4 * (r - s), 4 * t, -4 * t]
    by_t = [1 - 4 * r, 0.0, 4 * t - 1, -4 * s, 4 * s, 4 * (r - t)]
    return values, np.array([by_s, by_t]).T


_SMALL = 1e-3
"""Share of displacements from both signs of which the stress of small displacements is computed, exactly."""
_CORNERS = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def _stress(strain: Any, moduli: Any) -> Any:
    """Stress (MPa) in plane stress, where the thickness is free to change.

    Source: Timoshenko and Goodier, Theory of Elasticity, chapter 2.
    """
    E, nu = moduli
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
        Linear elastic material; for large displacements the St. Venant-Kirchhoff law, which holds for strains of a few
        per cent.
    plate_mm : float
        Thickness.
    zones : tuple of ConstrainedZone
        Flexures restrained by the plate's width; empty for plane stress everywhere.
    layers, pieces : ndarray, shape (m,), or None
        Number of layers, each as thick as the plate, at every triangle, and number of the body to which it belongs;
        None for one layer.
    bodies : HeldBodies or None
        Restraint outside the zones; None for plane stress there.
    """

    def __init__(
        self, mesh: PlaneMesh, material: Material, plate_mm: float, zones: tuple[ConstrainedZone, ...] = (),
        layers: Array | None = None, pieces: Indices | None = None, bodies: HeldBodies | None = None,
    ) -> None:  # fmt: skip
        self.material = material
        self.pieces, self._thick_mm = pieces, plate_mm * (np.ones(1) if layers is None else layers)[:, None]
        self.plate_mm = plate_mm
        self._located: dict[tuple[float, float], tuple[Indices, Array]] = {}
        self.mesh = mesh
        self._share, self._stressed = shares_at(zones, self.middles_mm, bodies)[:, :, None]
        self._moduli = held_moduli(material, self._share)
        self._mesh = skfem.MeshTri2(mesh.nodes_mm, mesh.triangles)
        self._element = skfem.ElementVector(skfem.ElementTriP2())
        self._basis = skfem.Basis(self._mesh, self._element, intorder=4)
        nodal, edge = self._basis.nodal_dofs, self._basis.facet_dofs
        self.x_dofs: Indices = np.concatenate([nodal[0], edge[0]])
        self.y_dofs: Indices = np.concatenate([nodal[1], edge[1]])
        self.nodes_mm: Array = self._basis.doflocs[:, self.x_dofs]

    @property
    def middles_mm(self) -> Array:
        """Middles of the triangles, shape (2, m)."""
        return np.asarray(self.mesh.nodes_mm[:, self.mesh.triangles[:3]].mean(axis=1))

    @property
    def unknowns(self) -> int:
        """Number of displacement components."""
        return int(self._basis.N)

    @property
    def corner_triangles(self) -> Indices:
        """Corner nodes of the triangles as indices of `nodes_mm`, shape (3, m)."""
        return np.asarray(self._mesh.t[:3])

    @cached_property
    def outline_edges(self) -> Indices:
        """Edges of the outline as indices of `nodes_mm`: two ends and the middle, the void on the left.

        Shape (3, k).
        """
        facets = self._mesh.boundary_facets()
        corners = int(self._basis.nodal_dofs.shape[1])
        ends = self._mesh.facets[:, facets]
        a, b = (self.nodes_mm[:, row] for row in ends)
        inner = self.nodes_mm[:, self._mesh.t[:3, self._mesh.f2t[0, facets]]].mean(axis=1)
        left = (b - a)[0] * (inner - a)[1] - (b - a)[1] * (inner - a)[0] > 0.0
        return np.vstack([np.where(left, ends[::-1], ends), corners + facets])

    def outline_lines(self) -> tuple[Array, Indices]:
        """Straight pieces of the outline, shape (n, 2, 2), and the unknowns along x and y of their ends, same shape."""
        a, b, middle = self.outline_edges
        ends = np.concatenate([np.stack([a, middle], axis=1), np.stack([middle, b], axis=1)])
        return self.nodes_mm.T[ends], np.stack([self.x_dofs[ends], self.y_dofs[ends]], axis=-1)

    @cached_property
    def _slopes(self) -> tuple[Array, Array]:
        """Derivatives of the six shape functions at quadrature points, shape (m, q, 2, 6); weights, shape (m, q)."""
        scalar = skfem.Basis(self._mesh, skfem.ElementTriP2(), intorder=4)
        slopes = np.stack([np.asarray(shape[0].grad) for shape in scalar.basis])  # (6, 2, m, q)
        return np.ascontiguousarray(slopes.transpose(2, 3, 1, 0)), np.asarray(scalar.dx) * self._thick_mm

    @cached_property
    def nodes_of_triangles(self) -> Indices:
        """Corners, then middles of the edges, of every triangle as indices of `nodes_mm`, shape (6, m)."""
        return np.vstack([self._mesh.t[:3], int(self._basis.nodal_dofs.shape[1]) + self._mesh.t2f])

    def weights_at(self, point: tuple[float, float]) -> tuple[Indices, Array]:
        """Nodes of the triangle in which a point lies, and the weights of their displacements; kept by point."""
        if point not in self._located:
            self._located[point] = element_weights(self.nodes_mm, self.nodes_of_triangles, point)
        return self._located[point]

    def rows_at(self, point: tuple[float, float]) -> Array:
        """Matrix that converts displacements to a body point's motion along x and y, shape (2, unknowns)."""
        nodes, weights = self.weights_at(point)
        rows = np.zeros((2, self.unknowns))
        rows[0, self.x_dofs[nodes]] = rows[1, self.y_dofs[nodes]] = weights
        return rows

    @cached_property
    def unknowns_of_triangles(self) -> Indices:
        """Unknowns of every triangle, first along x, then along y; shape (m, 12)."""
        nodes = self.nodes_of_triangles
        return np.ascontiguousarray(np.vstack([self.x_dofs[nodes], self.y_dofs[nodes]]).T)

    @cached_property
    def _law(self) -> Array:
        """Matrix from strain (xx, yy, twice xy) to stress (xx, yy, xy) in every triangle, shape (m, 1, 3, 3)."""
        E, nu = (np.broadcast_to(value, self._share.shape)[:, 0] for value in self._moduli)
        law = np.zeros((E.size, 1, 3, 3))
        law[:, 0, 0, 0] = law[:, 0, 1, 1] = E / (1.0 - nu**2)
        law[:, 0, 0, 1] = law[:, 0, 1, 0] = nu * E / (1.0 - nu**2)
        law[:, 0, 2, 2] = 0.5 * E / (1.0 + nu)
        return law

    @cached_property
    def stiffness_n_mm(self) -> csr_matrix:
        """Linear stiffness matrix."""
        return self.internal_force_n(np.zeros(self.unknowns))[0]

    @cached_property
    def mass_t(self) -> csr_matrix:
        """Consistent mass matrix in tonnes, the unit consistent with N and mm."""
        weight = self.material.density_t_mm3 * self._thick_mm

        def inertia(u: Any, v: Any, _: Any) -> Any:
            return weight * dot(u, v)

        return csr_matrix(skfem.BilinearForm(inertia).assemble(self._basis))

    def internal_force_n(self, displacement_mm: Array) -> tuple[csr_matrix, Array]:
        """Tangent stiffness and nodal forces of the deformed plate (total Lagrangian, Saint Venant-Kirchhoff).

        Source: Bonet and Wood, Nonlinear Continuum Mechanics for Finite Element Analysis, chapters 6 and 9.
        """
        deformation, stress = self._deformed(displacement_mm)
        slopes, weights = self._slopes
        triangles, points = weights.shape
        dx, dy = slopes[..., 0, :], slopes[..., 1, :]
        strains = np.empty((triangles, points, 3, 12))
        for component in (0, 1):
            fx, fy = deformation[..., 0, component, None], deformation[..., 1, component, None]
            part = strains[..., 6 * component : 6 * component + 6]
            part[..., 0, :], part[..., 1, :], part[..., 2, :] = fx * dx, fy * dy, fx * dy + fy * dx
        stressed = self._law @ strains
        stressed *= weights[..., None, None]
        # One matrix product covers all quadrature points of a triangle.
        along = strains.reshape(triangles, 3 * points, 12)
        elements = np.swapaxes(along, 1, 2) @ stressed.reshape(triangles, 3 * points, 12)
        if not displacement_mm.any():
            return self._assembled(elements, at_rest=True), np.zeros(self.unknowns)
        self._add_geometric(elements, stress)
        return self._assembled(elements, at_rest=False), self._collected(deformation, stress)

    def geometric_stiffness_n_mm(self, displacement_mm: Array) -> csr_matrix:
        """Stiffness by which the stress of small displacements resists rotation; proportional to them."""
        (_, up), (_, down) = self._deformed(_SMALL * displacement_mm), self._deformed(-_SMALL * displacement_mm)
        elements = np.zeros((up.shape[0], 12, 12))
        self._add_geometric(elements, (up - down) / (2.0 * _SMALL))
        return self._assembled(elements, at_rest=False)

    def _add_geometric(self, elements: Array, stress: Array) -> None:
        """Add the product of shape slopes, stress and shape slopes to the triangles' matrices."""
        slopes, weights = self._slopes
        triangles, points = weights.shape
        dx, dy = slopes[..., 0, :], slopes[..., 1, :]
        sx, sy, txy = (stress[..., k, None] * weights[..., None] for k in range(3))
        pulled = np.stack([sx * dx + txy * dy, txy * dx + sy * dy], axis=2)
        flat = slopes.reshape(triangles, 2 * points, 6)
        turned = np.swapaxes(flat, 1, 2) @ pulled.reshape(triangles, 2 * points, 6)
        elements[:, :6, :6] += turned
        elements[:, 6:, 6:] += turned

    def nodal_force_n(self, displacement_mm: Array) -> Array:
        """Nodal forces of the deformed plate without the tangent stiffness, at a tenth of the cost."""
        return self._collected(*self._deformed(displacement_mm))

    def energies_n_mm(self, displacement_mm: Array) -> Array:
        """Strain energy of every triangle at small displacements, shape (m,)."""
        gradient = self._gradient(displacement_mm)
        shear = gradient[..., 0, 1] + gradient[..., 1, 0]
        strain = np.stack([gradient[..., 0, 0], gradient[..., 1, 1], shear], axis=-1)
        return np.asarray(0.5 * np.einsum("mqi,mqi,mq->m", strain @ self._law[:, 0], strain, self._slopes[1]))

    def _gradient(self, displacement_mm: Array) -> Array:
        """Derivatives of the displacements by x and y, the latter in the second to last axis; shape (m, q, 2, 2)."""
        slopes, weights = self._slopes
        triangles, points = weights.shape
        moved = np.swapaxes(displacement_mm[self.unknowns_of_triangles].reshape(-1, 2, 6), 1, 2)
        return np.asarray((slopes.reshape(triangles, 2 * points, 6) @ moved).reshape(triangles, points, 2, 2))

    def _deformed(self, displacement_mm: Array) -> tuple[Array, Array]:
        """Deformation gradient, shape (m, q, 2, 2), and second Piola-Kirchhoff stress, shape (m, q, 3)."""
        gradient = self._gradient(displacement_mm)
        ux, vx = gradient[..., 0, 0], gradient[..., 0, 1]
        uy, vy = gradient[..., 1, 0], gradient[..., 1, 1]
        strain = np.stack([ux + 0.5 * (ux * ux + vx * vx), vy + 0.5 * (uy * uy + vy * vy),
                           uy + vx + ux * uy + vx * vy], axis=-1)  # fmt: skip
        return gradient + np.eye(2), np.asarray(strain @ self._law[:, 0])

    def _collected(self, deformation: Array, stress: Array) -> Array:
        """Nodal forces: derivatives of the shape functions times the first Piola-Kirchhoff stress."""
        slopes, weights = self._slopes
        triangles, points = weights.shape
        sx, sy, txy = (stress[..., k, None] * weights[..., None] for k in range(3))
        fx, fy = deformation[..., 0, :], deformation[..., 1, :]
        first = np.stack([sx * fx + txy * fy, txy * fx + sy * fy], axis=2).reshape(triangles, 2 * points, 2)
        element = np.swapaxes(np.swapaxes(slopes.reshape(triangles, 2 * points, 6), 1, 2) @ first, 1, 2)
        return np.asarray(
            np.bincount(self.unknowns_of_triangles.ravel(), element.ravel(), self.unknowns), dtype=np.float64
        )

    def _assembled(self, elements: Array, *, at_rest: bool) -> csr_matrix:
        """Sum of the triangles' matrices in one sparse matrix; the positions of the entries are computed once."""
        shape = (self.unknowns, self.unknowns)
        if at_rest:
            unknowns = self.unknowns_of_triangles
            rows, columns = np.repeat(unknowns, 12, axis=1), np.tile(unknowns, (1, 12))
            return csr_matrix(coo_matrix((elements.ravel(), (rows.ravel(), columns.ravel())), shape=shape))
        place, columns, starts = self._pattern
        return csr_matrix((np.bincount(place, elements.ravel(), columns.size), columns, starts), shape=shape)

    @cached_property
    def _pattern(self) -> tuple[Indices, Indices, Indices]:
        """Position of every triangle's entries in the matrix, and the matrix's columns and row starts."""
        unknowns = self.unknowns_of_triangles.astype(np.int64)  # products of two numbers exceed 32 bits
        key = np.repeat(unknowns, 12, axis=1).ravel() * self.unknowns + np.tile(unknowns, (1, 12)).ravel()
        kept, place = np.unique(key, return_inverse=True)
        starts = np.searchsorted(kept, np.arange(self.unknowns + 1) * self.unknowns)
        return place, kept % self.unknowns, starts

    def von_mises_mpa(self, displacement_mm: Array, *, large: bool = False, rest_mm: Array | None = None) -> Array:
        """Von Mises stress at the triangles' corners, shape (3, m).

        Parameters
        ----------
        displacement_mm : ndarray of float, shape (unknowns,)
            Displacement components.
        large : bool
            Whether to compute the Cauchy stress of the deformed plate; if False, the stress for small displacements.
        rest_mm : ndarray of float, shape (unknowns,), or None
            Displacement at rest, about which small ones are added; None for the drawn shape.
        """
        corners = skfem.Basis(self._mesh, self._element, quadrature=(_CORNERS, np.full(3, 1.0 / 6.0)))
        gradient = corners.interpolate(displacement_mm).grad
        if large:
            deformation = gradient + eye(np.ones(gradient.shape[2:]), 2)
            strain = 0.5 * (mul(transpose(deformation), deformation) - eye(np.ones(gradient.shape[2:]), 2))
            area = deformation[0, 0] * deformation[1, 1] - deformation[0, 1] * deformation[1, 0]
            stress = mul(mul(deformation, _stress(strain, self._moduli)), transpose(deformation)) / area
        elif rest_mm is None:
            stress = _stress(_symmetric(gradient), self._moduli)
        else:
            turned = transpose(corners.interpolate(rest_mm).grad)
            added = gradient - transpose(turned)
            at_rest = _symmetric(transpose(turned)) + 0.5 * mul(turned, transpose(turned))
            stress = _stress(at_rest + _symmetric(added + mul(turned, added)), self._moduli)
        sx, sy, txy = stress[0, 0], stress[1, 1], stress[0, 1]
        sz = self._stressed * self.material.poisson_ratio * (sx + sy)
        squares = (sx - sy) ** 2 + (sy - sz) ** 2 + (sz - sx) ** 2
        return np.asarray(np.sqrt(0.5 * squares + 3.0 * txy**2)).T

    def at_corners(self, values: Array) -> Array:
        """Mean, over the triangles that meet at each corner node, of their values; shape (number of corner nodes,)."""
        triangles = self.corner_triangles
        size = int(self._basis.nodal_dofs.shape[1])
        total = np.bincount(triangles.ravel(), weights=values.ravel(), minlength=size)
        return np.asarray(total / np.bincount(triangles.ravel(), minlength=size))
