"""Three-dimensional elements of a plate: motion out of its plane with the drive fixed, and bodies held by their width.

Motion out of the plane has natural modes, and the sag of a horizontal plate. Fixed faces and driven faces are then
fixed in all directions. A sliding face is fixed in its constrained direction at every depth, which on a plane of
symmetry selects the symmetric modes.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import skfem
from numpy.polynomial import legendre
from numpy.typing import NDArray
from scipy.sparse import bmat, csr_matrix, kron
from scipy.sparse.linalg import LinearOperator, eigsh

from fingervision.domain.gripper import Material
from fingervision.models.elastic_mechanism import STANDARD_GRAVITY_MM_S2
from fingervision.models.mechanism import Mechanism
from fingervision.models.mechanism_equilibrium import factorised
from fingervision.models.mechanism_faces import supports_of
from fingervision.models.plane_stress import PlaneStressPlate, element_weights
from fingervision.models.triangulate import PlaneMesh, triangulate
from fingervision.models.width_effect import HeldBodies

# Out-of-plane motion of a plate of any depth: quadratic triangles in the plane, polynomials through the depth.
#
# Displacements are u_i(x, y, z) = sum N_a(x, y) P_k(2 z / b) q_iak with shape functions N_a, depth b, unknowns q and
# Legendre polynomials P_k: odd polynomials for the in-plane components, even polynomials for the out-of-plane
# component. Odd and even polynomials together describe bending, torsion and shear of a plate that is symmetric about
# its middle plane; with even polynomials in the plane and odd ones out of it, they describe motion in the plane, in
# which the plate becomes thinner and thicker. The solution converges to three-dimensional elasticity as the order
# grows (hierarchic plate models: Babuska and Li, 1992, Computer Methods in Applied Mechanics and Engineering 100, 249),
# without the assumptions of plate or beam theory. Torsion of a deep neck therefore includes restrained warping, and
# bodies bend right up to their junctions.

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

_ORDER = 3
"""Order of the polynomials through the depth for the in-plane components; the order for the out-of-plane component is
one less. The first mode of the published sample is then 0.04 % above that of order 5, and for hinges 1 to 20 times as
wide as thick within 0.2 % of CalculiX's wedge elements (`tests/benchmarks/models_three_dimensions.py`); order 1 is 7 %
too high."""


class DeepPlate:
    """A meshed plate that deforms out of its plane.

    Parameters
    ----------
    mesh : PlaneMesh
        Mesh of quadratic triangles.
    material : Material
        Linear elastic material.
    plate_mm : float
        Depth of the plate (out of the plane).
    order : int
        Largest order of the polynomials through the depth, an odd one.
    in_plane : bool
        Whether the plate moves in its plane instead.
    triangles : ndarray of int, or None
        Triangles of the mesh that are part of the plate; None for all.
    """

    def __init__(
        self,
        mesh: PlaneMesh,
        material: Material,
        plate_mm: float,
        order: int = _ORDER,
        *,
        in_plane: bool = False,
        triangles: Indices | None = None,
    ) -> None:
        self.material, self.plate_mm = material, plate_mm
        whole = skfem.MeshTri2(mesh.nodes_mm, mesh.triangles)
        self._basis = skfem.Basis(whole, skfem.ElementTriP2(), elements=triangles, intorder=4)
        self.nodes_mm: Array = self._basis.doflocs
        odd = [np.eye(order + 1)[k] for k in range(1, order + 1, 2)]
        even = [np.eye(order + 1)[k] for k in range(0, order, 2)]
        self._shapes = (even, even, odd) if in_plane else (odd, odd, even)

    @property
    def unknowns(self) -> int:
        """Number of coefficients."""
        return int(self.nodes_mm.shape[1]) * sum(len(shapes) for shapes in self._shapes)

    def coefficients(self, nodes: Indices, component: int) -> Indices:
        """Indices of the unknowns of one component (0 x, 1 y, 2 z) at some nodes."""
        count = [len(shapes) for shapes in self._shapes]
        start = self.nodes_mm.shape[1] * sum(count[:component])
        return np.asarray(start + (count[component] * nodes[:, None] + np.arange(count[component])).ravel())

    def _through(self, first: int, second: int, *, slopes: tuple[int, int]) -> Array:
        """Integrals through the depth of products of two components' polynomials, or of their derivatives by z."""
        points, weights = legendre.leggauss(2 * len(self._shapes[0]) + 2)
        values = []
        for component, order in zip((first, second), slopes, strict=True):
            rows = [legendre.legval(points, legendre.legder(shape, order) if order else shape)
                    for shape in self._shapes[component]]  # fmt: skip
            values.append(np.array(rows) * (2.0 / self.plate_mm) ** order)
        return np.asarray((values[0] * weights) @ values[1].T * 0.5 * self.plate_mm)

    @cached_property
    def _plane(self) -> dict[tuple[int, int], csr_matrix]:
        """Integrals of products of two shape functions, each differentiated by x (0), by y (1) or not at all (2)."""

        def part(shape: Any, way: int) -> Any:
            return shape if way == 2 else shape.grad[way]

        def integral(first: int, second: int) -> csr_matrix:
            # scikit-fem passes the second function, which numbers the column, first.
            form = skfem.BilinearForm(lambda u, v, _: part(v, first) * part(u, second))
            return csr_matrix(form.assemble(self._basis))

        found = {pair: integral(*pair) for pair in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))}
        return found | {(b, a): csr_matrix(matrix.T) for (a, b), matrix in found.items() if a != b}

    @cached_property
    def stiffness_n_mm(self) -> csr_matrix:
        """Linear stiffness matrix by Hooke's law in three dimensions (N/mm)."""
        E, nu = self.material.youngs_modulus_mpa, self.material.poisson_ratio
        lame, shear = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), self.material.shear_modulus_mpa

        def gradients(i: int, way: int, j: int, other: int) -> csr_matrix:
            through = self._through(i, j, slopes=(int(way == 2), int(other == 2)))
            return csr_matrix(kron(self._plane[way, other], through))

        blocks = [[lame * gradients(i, i, j, j) + shear * gradients(i, j, j, i) for j in range(3)] for i in range(3)]
        for i in range(3):
            for way in range(3):
                blocks[i][i] = blocks[i][i] + shear * gradients(i, way, i, way)
        return csr_matrix(bmat(blocks))

    @cached_property
    def mass_t(self) -> csr_matrix:
        """Consistent mass matrix in tonnes."""
        parts = [kron(self._plane[2, 2], self._through(i, i, slopes=(0, 0))) for i in range(3)]
        rows = [[part if i == j else None for j in range(3)] for i, part in enumerate(parts)]
        return csr_matrix(self.material.density_t_mm3 * bmat(rows))

    @cached_property
    def lifted(self) -> Array:
        """Coefficients of a translation of the whole plate by 1 mm out of its plane."""
        lift = np.zeros(self.unknowns)
        lift[self.coefficients(np.arange(self.nodes_mm.shape[1]), 2)[:: len(self._shapes[2])]] = 1.0
        return lift

    def middle_mm(self, moved: Array, point: tuple[float, float]) -> float:
        """Out-of-plane displacement of a point of the middle plane (mm)."""
        nodes, weights = element_weights(self.nodes_mm, self._basis.element_dofs, point)
        values = moved[self.coefficients(nodes, 2)].reshape(nodes.size, -1) @ _even_at_middle(len(self._shapes[2]))
        return float(weights @ values)

    def relaxed(self, means_mm: tuple[Array, Array], nodes: Indices, guided: Indices) -> Array:
        """Coefficients of the equilibrium at prescribed displacements in the plane.

        Parameters
        ----------
        means_mm : (ndarray, ndarray)
            Displacements of all nodes along x and y, uniform over the depth.
        nodes, guided : ndarray of int
            Nodes that are free to move, some of them guided: their means over the depth stay as given.
        """
        moved = np.zeros(self.unknowns)
        every = np.arange(self.nodes_mm.shape[1])
        for way, values in enumerate(means_mm):
            moved[self.coefficients(every, way)[:: len(self._shapes[way])]] = values
        kept = [self.coefficients(guided, way)[:: len(self._shapes[way])] for way in range(2)]
        free = np.setdiff1d(np.concatenate([self.coefficients(nodes, way) for way in range(3)]), np.concatenate(kept))
        loads = self.stiffness_n_mm[free] @ moved
        moved[free] -= factorised(self.stiffness_n_mm[free][:, free]).solve(loads)
        return moved

    def energies_n_mm(self, moved: Array) -> Array:
        """Strain energy of every triangle of the plate, shape (m,)."""
        E, nu = self.material.youngs_modulus_mpa, self.material.poisson_ratio
        lame, shear = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), self.material.shear_modulus_mpa
        nodes = np.arange(self.nodes_mm.shape[1])
        parts = [
            [self._basis.interpolate(np.ascontiguousarray(each))
             for each in moved[self.coefficients(nodes, way)].reshape(nodes.size, -1).T]
            for way in range(3)
        ]  # fmt: skip
        points, weights = legendre.leggauss(2 * len(self._shapes[0]) + 2)
        density = 0.0
        for point, weight in zip(points, weights, strict=True):
            slopes = np.zeros((3, 3, *self._basis.dx.shape))
            for way, (shapes, fields) in enumerate(zip(self._shapes, parts, strict=True)):
                for shape, part in zip(shapes, fields, strict=True):
                    slopes[way, :2] += legendre.legval(point, shape) * part.grad
                    slopes[way, 2] += legendre.legval(point, legendre.legder(shape)) * 2.0 / self.plate_mm * part
            strain = 0.5 * (slopes + np.swapaxes(slopes, 0, 1))
            squares = np.einsum("ij...,ij...->...", strain, strain)
            density = density + weight * (0.5 * lame * np.einsum("ii...->...", strain) ** 2 + shear * squares)
        return np.asarray((density * self._basis.dx).sum(axis=1) * 0.5 * self.plate_mm)

    def supported(self, held: Indices) -> "SupportedPlate":
        """Return the plate with the given coefficients fixed to zero."""
        return SupportedPlate(self, np.setdiff1d(np.arange(self.unknowns), held))


class SupportedPlate:
    """A plate with some of its coefficients fixed to zero.

    Parameters
    ----------
    plate : DeepPlate
        The plate.
    free : ndarray of int
        Indices of the coefficients that are not fixed.
    """

    def __init__(self, plate: DeepPlate, free: Indices) -> None:
        self._plate, self._free = plate, free
        self._stiffness = plate.stiffness_n_mm[free][:, free]
        self._factors = factorised(self._stiffness)

    def modes_hz(self, count: int) -> tuple[float, ...]:
        """Lowest natural frequencies (Hz)."""
        free = self._free
        mass = self._plate.mass_t[free][:, free].tocsc()
        inverse = LinearOperator(mass.shape, self._factors.solve, dtype=np.float64)
        squared = eigsh(self._stiffness.tocsc(), count, mass, sigma=0.0, OPinv=inverse, v0=np.ones(free.size),
                        return_eigenvectors=False)  # fmt: skip
        return tuple((np.sqrt(np.sort(squared)) / (2.0 * np.pi)).tolist())

    def sag(self, gravity_mm_s2: float) -> Array:
        """Displacements under the plate's own weight perpendicular to the plate, shape (unknowns of the plate,)."""
        plate = self._plate
        load = gravity_mm_s2 * (plate.mass_t @ plate.lifted)
        moved = np.zeros(plate.unknowns)
        moved[self._free] = self._factors.solve(load[self._free])
        return moved


def _even_at_middle(count: int) -> Array:
    """Values of the even Legendre polynomials at 0."""
    return np.array([legendre.legval(0.0, np.eye(2 * count)[2 * k]) for k in range(count)])


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


_ORDER_OF_BODIES = 5
"""Order of the polynomials through the depth for bodies that bend in the plane: a notch 16 times as wide as thick is
0.3 % stiffer than with order 7, which has the stiffness of the tables for hinges."""
_TINIEST = 1e-300
_MOST_OF_THEM = 0.999
"""Share of the bodies' strain energy that is computed in three dimensions: the parts that bend least come last, and
they hold the width of those that bend more."""


def held_bodies(
    plate: PlaneStressPlate, mechanism: Mechanism, moved: Array, whole_n_mm: float, error: float
) -> HeldBodies | None:
    """Weights of plane strain in what bends beside the flexures: parts of bodies that no theory of flexures describes.

    A thin part that is no straight strip and no symmetric notch (a curved spring, a neck between unlike arcs or at a
    hole) is held by its width as flexures are. Three-dimensional elements give its strain energy where the rest of the
    plate moves as in plane stress, and how this energy is shared by the triangles; what the input does not bend has no
    weight.

    Parameters
    ----------
    plate : PlaneStressPlate
        The bodies, in plane stress beside the flexures.
    mechanism : Mechanism
        The drawing.
    moved : ndarray of float
        Displacements of the plate per input.
    whole_n_mm : float
        Strain energy of the whole mechanism at these displacements.
    error : float
        Relative error of the force that is stated anyway.

    Returns
    -------
    HeldBodies or None
        The weights; None where the width changes the force by less than the error.
    """
    if mechanism.held_bodies is not None:
        return mechanism.held_bodies
    poisson_squared = mechanism.material.poisson_ratio**2
    energies = plate.energies_n_mm(moved)
    for flexure in mechanism.flexures:
        energies[flexure.zone(mechanism.plate_mm).holds(plate.middles_mm)] = 0.0
    if mechanism.layers or poisson_squared * energies.sum() <= error * whole_n_mm:
        return None
    order = np.argsort(energies)[::-1]
    most = int(np.searchsorted(np.cumsum(energies[order]), _MOST_OF_THEM * energies.sum())) + 1
    bent = np.sort(order[:most])
    supports = supports_of(plate, mechanism, mechanism.region.size_mm)
    still = [plate.nodes_of_triangles[:, order[most:]].ravel(), *supports.fixed]
    guided = [*supports.driven, *(nodes for nodes, _ in supports.slides)]
    inner = np.setdiff1d(plate.nodes_of_triangles[:, bent], np.concatenate(still))
    thick_mm = plate.plate_mm / mechanism.halves
    deep = DeepPlate(plate.mesh, mechanism.material, thick_mm, _ORDER_OF_BODIES, in_plane=True, triangles=bent)
    relaxed = deep.relaxed(
        (moved[plate.x_dofs], moved[plate.y_dofs]), inner, np.intersect1d(inner, np.concatenate(guided))
    )
    every, means = np.arange(plate.nodes_mm.shape[1]), np.zeros_like(moved)
    for way, dofs in enumerate((plate.x_dofs, plate.y_dofs)):
        means[dofs] = relaxed[deep.coefficients(every, way)].reshape(every.size, -1)[:, 0]
    held, solid = plate.energies_n_mm(means)[bent], mechanism.halves * deep.energies_n_mm(relaxed)
    mean = float(np.clip((1.0 - energies[bent].sum() / solid.sum()) / poisson_squared, 0.0, 1.0))
    # The width also spreads the bending: where it is held most, the plate bends less than in plane stress.
    spread = mean * solid.sum() / max(float((solid - held).sum()), _TINIEST)
    shares = np.zeros(energies.size)
    shares[bent] = np.clip((1.0 - held / solid) * spread, 0.0, 1.0)
    return HeldBodies(plate.middles_mm, shares, mean)
