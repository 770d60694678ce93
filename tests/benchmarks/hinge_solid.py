"""Compliance of a notch hinge between rigid end planes by finite elements, from which beam theory is corrected.

The elements are quadratic quadrilaterals in plane stress, or quadratic bricks. The left end plane is fixed, and the
right end plane is moved as a rigid body in each direction, which gives its stiffness and, by inversion, the compliance.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.sparse.linalg import splu
from skfem.helpers import ddot, eye, sym_grad, trace

from fingervision.domain.gripper import Material
from fingervision.models.hinge_correction import Notch
from fingervision.models.width_effect import held_moduli

Array = NDArray[np.float64]

_ON = 1e-9
_BLOCK_ELEMENTS = 12


def plane_compliance(
    notch: Notch,
    material: Material,
    along: int = 160,
    across: int = 6,
    block_mm: float = 0.0,
    share: float = 0.0,
) -> Array:
    """Compute the in-plane compliance at the right end: x, y, rotation about z.

    Parameters
    ----------
    notch : Notch
        Shape of the notch.
    material : Material
        Linear elastic material, in plane stress.
    along, across : int
        Number of quadratic elements.
    block_mm : float
        Length of elastic blocks between the notch and the end planes, as high as the ends of the notch; 0 for no
        blocks.
    share : float
        Weight of plane strain within the notch, as in `width_effect`.

    Returns
    -------
    ndarray of float, shape (3, 3)
        Compliance at the outer end of the right block.
    """
    plate_mm = notch.plate_mm

    def work(u: Any, v: Any, w: Any) -> Any:
        e = sym_grad(u)
        E, nu = held_moduli(material, np.where(np.abs(w.x[0]) <= notch.half_length_mm, share, 0.0))
        return plate_mm * ddot(E / (1.0 + nu) * e + E * nu / (1.0 - nu**2) * eye(trace(e), 2), sym_grad(v))

    s = _stations(notch, along, block_mm)
    mesh = skfem.MeshQuad2.from_mesh(skfem.MeshQuad.init_tensor(s, np.linspace(-0.5, 0.5, across + 1)))
    placed = _shaped(notch, mesh.doflocs, block_mm)
    basis = skfem.Basis(skfem.MeshQuad2(placed, mesh.t), skfem.ElementVector(skfem.ElementQuad2()), intorder=5)
    K = skfem.BilinearForm(work).assemble(basis)
    return _end_compliance(K.tocsc(), basis, notch.half_length_mm + block_mm, 2)


def solid_compliance(
    notch: Notch, material: Material, along: int = 24, across: int = 3, through: int = 4, block_mm: float = 0.0
) -> Array:
    """Compute the compliance at the right end in all six directions with quadratic bricks.

    Parameters
    ----------
    notch, material
        As in `plane_compliance`.
    along, across, through : int
        Numbers of bricks along the notch, across the notch in the plane, and through the plate; thinner at the faces of
        the plate.
    block_mm : float
        As in `plane_compliance`.

    Returns
    -------
    ndarray of float, shape (6, 6)
        Compliance, with components ordered as in `beam_compliance`.
    """
    E, nu = material.youngs_modulus_mpa, material.poisson_ratio
    lame = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))

    def work(u: Any, v: Any, _: Any) -> Any:
        e = sym_grad(u)
        return ddot(E / (1.0 + nu) * e + lame * eye(trace(e), 3), sym_grad(v))

    mesh = skfem.MeshHex2.from_mesh(
        skfem.MeshHex.init_tensor(
            _stations(notch, along, block_mm),
            np.linspace(-0.5, 0.5, across + 1),
            0.5 * notch.plate_mm * np.sin(0.5 * np.pi * np.linspace(-1.0, 1.0, through + 1)),
        )
    )
    placed = _shaped(notch, mesh.doflocs, block_mm)
    basis = skfem.Basis(skfem.MeshHex2(placed, mesh.t), skfem.ElementVector(skfem.ElementHex2()), intorder=5)
    K = skfem.BilinearForm(work).assemble(basis)
    return _end_compliance(K.tocsc(), basis, notch.half_length_mm + block_mm, 3)


def _stations(notch: Notch, along: int, block_mm: float) -> Array:
    """Positions of the element ends: at equal angles of x = a sin(angle) within the notch, then in the blocks."""
    inside = np.arcsin(np.clip(notch.stations_mm(along) / notch.half_length_mm, -1.0, 1.0))
    if block_mm == 0.0:
        return inside
    outside = np.pi / 2 + np.linspace(0.0, 1.0, _BLOCK_ELEMENTS + 1)[1:] ** 1.5
    return np.concatenate([-outside[::-1], inside, outside])


def _shaped(notch: Notch, unit: Array, block_mm: float) -> Array:
    s = np.clip(unit[0], -np.pi / 2, np.pi / 2)
    placed = unit.copy()
    placed[0] = notch.half_length_mm * np.sin(s) + block_mm * (unit[0] - s)
    placed[1] = unit[1] * notch.height_mm(notch.half_length_mm * np.sin(s))
    return placed


def _end_compliance(K: Any, basis: Any, end_mm: float, dimensions: int) -> Array:
    places = basis.doflocs
    left = basis.get_dofs(lambda p: np.abs(p[0] + end_mm) < _ON * end_mm).all()
    faces = [
        basis.get_dofs(lambda p: np.abs(p[0] - end_mm) < _ON * end_mm).all(f"u^{axis + 1}")
        for axis in range(dimensions)
    ]
    right = np.concatenate(faces)
    motions: list[Callable[[Array], list[Any]]] = [
        lambda p: [1.0, 0.0, 0.0],
        lambda p: [0.0, 1.0, 0.0],
        lambda p: [0.0, 0.0, 1.0],
        lambda p: [0.0, -p[2], p[1]],
        lambda p: [p[2], 0.0, 0.0],
        lambda p: [-p[1], 0.0, 0.0],
    ]
    used = [0, 1, 5] if dimensions == 2 else list(range(6))
    prescribed = np.zeros((K.shape[0], len(used)))
    for column, motion in enumerate(used):
        for axis, dofs in enumerate(faces):
            prescribed[dofs, column] = motions[motion](places[:, dofs])[axis]
    free = np.setdiff1d(np.arange(K.shape[0]), np.concatenate([left, right]))
    moved = prescribed.copy()
    moved[free] = splu(K[free][:, free]).solve(-(K @ prescribed)[free])
    stiffness = prescribed.T @ (K @ moved)
    return np.asarray(np.linalg.inv(0.5 * (stiffness + stiffness.T)))
