"""Out-of-plane motion of a mechanism with its drive fixed: natural modes, and the sag of a horizontal plate.

Fixed faces and driven faces are fixed in all directions. A sliding face is fixed in its constrained direction at
every depth, which on a plane of symmetry selects the symmetric modes.
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

# Out-of-plane motion of a plate of any depth: quadratic triangles in the plane, polynomials through the depth.
#
# Displacements are u_i(x, y, z) = sum N_a(x, y) P_k(2 z / b) q_iak with shape functions N_a, depth b, unknowns q and
# Legendre polynomials P_k: odd polynomials for the in-plane components, even polynomials for the out-of-plane
# component. Odd and even polynomials together describe bending, torsion and shear of a plate that is symmetric about
# its middle plane. The solution converges to three-dimensional elasticity as the order grows (hierarchic plate models:
# Babuska and Li, 1992, Computer Methods in Applied Mechanics and Engineering 100, 249), without the assumptions of
# plate or beam theory. Torsion of a deep neck therefore includes restrained warping, and bodies bend right up to their
# junctions.

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
        Odd order of the polynomials through the depth for the in-plane components.
    """

    def __init__(self, mesh: PlaneMesh, material: Material, plate_mm: float, order: int = _ORDER) -> None:
        self.material, self.plate_mm = material, plate_mm
        self._basis = skfem.Basis(skfem.MeshTri2(mesh.nodes_mm, mesh.triangles), skfem.ElementTriP2(), intorder=4)
        self.nodes_mm: Array = self._basis.doflocs
        odd = [np.eye(order + 1)[k] for k in range(1, order + 1, 2)]
        even = [np.eye(order + 1)[k] for k in range(0, order, 2)]
        self._shapes = odd, odd, even

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
