"""Restraint of a leaf by the plate's width, against limits and a plate of scikit-fem's Morley elements."""

import numpy as np
import pytest
import skfem
from skfem.helpers import dd, ddot, sym_grad, trace

from fingervision.models.flexure import Flexure, stretched_share, strip_share

NU = 0.34
MORLEY = 0.04
"""Tolerance of the share for sixty Morley elements along the strip, which converge from below in proportion to their
size."""


def test_narrow_strips_are_free_and_wide_ones_held() -> None:
    shares = np.array([strip_share(ratio, NU) for ratio in (1e-3, 0.05, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0)])
    assert np.all(np.diff(shares, axis=0) > 0.0)
    assert np.all(shares[:, 1] >= shares[:, 0])
    assert shares[0] == pytest.approx(0.0, abs=0.005)
    assert shares[-1] == pytest.approx(1.0, abs=0.01)
    assert strip_share(1.0, 0.0) == (0.0, 0.0)


@pytest.mark.parametrize("width", [0.3, 0.8])
def test_the_share_is_that_of_a_clamped_plate(width: float) -> None:
    mesh = skfem.MeshTri.init_tensor(np.linspace(0.0, 1.0, 61), np.linspace(0.0, width, int(60 * width) + 1))
    basis = skfem.Basis(mesh, skfem.ElementTriMorley())

    @skfem.BilinearForm
    def energy(u, v, _):  # type: ignore[no-untyped-def]
        a, b = dd(u), dd(v)
        mixed = NU * (a[0][0] * b[1][1] + a[1][1] * b[0][0]) + 2.0 * (1.0 - NU) * a[0][1] * b[0][1]
        return a[0][0] * b[0][0] + a[1][1] * b[1][1] + mixed

    clamped = basis.get_dofs(lambda x: (x[0] < 1e-9) | (x[0] > 1.0 - 1e-9))
    for place, turns_back in enumerate((0.0, 2.0)):

        @skfem.LinearForm
        def pull(v, w, turns_back=turns_back):  # type: ignore[no-untyped-def]
            return (1.0 - turns_back * w.x[0]) * (dd(v)[0][0] + NU * dd(v)[1][1])

        load = pull.assemble(basis)
        moved = skfem.solve(*skfem.condense(energy.assemble(basis), -load, D=clamped))
        bar = width * (1.0 if place == 0 else 1.0 / 3.0)
        stiffness = (bar + load @ moved) / (bar * (1.0 - NU**2))
        assert strip_share(width, NU)[place] == pytest.approx((1.0 - 1.0 / stiffness) / NU**2, abs=MORLEY)


@pytest.mark.parametrize(
    ("length", "plate", "share"),
    [(10, 1, 0.020), (10, 2, 0.067), (10, 4, 0.205), (25, 2.5, 0.041), (25, 5, 0.119), (25, 10, 0.283), (20, 6, 0.188)],
)
def test_a_strip_that_is_not_thin_is_held_less(length: float, plate: float, share: float) -> None:
    """Lengths and widths in thicknesses; shares from the force of a lever on the strip, by wedge elements of CalculiX
    beside plane stress (`tests/benchmarks/solid_reference.py`, nu = 0.35).
    """
    strip = Flexure("", "strip", (0.0, 0.0), 0.0, 1.0, 0.5 * length, used=(0.98, 0.02, 0.0))
    assert strip.width_share(plate) == pytest.approx(share, abs=0.03)


@pytest.mark.parametrize("width", [0.3, 1.0, 4.0])
def test_a_stretched_strip_is_held_back_at_its_ends(width: float) -> None:
    """Compared with scikit-fem's quadratic elements in plane stress, clamped at one end and pulled uniformly at the
    other.
    """
    mesh = skfem.MeshTri.init_tensor(np.linspace(0.0, 1.0, 33), np.linspace(0.0, width, 33))
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTriP2()))

    @skfem.BilinearForm
    def energy(u, v, _):  # type: ignore[no-untyped-def]
        a, b = sym_grad(u), sym_grad(v)
        return ddot(a, b) / (1.0 + NU) + NU / (1.0 - NU**2) * trace(a) * trace(b)

    stiffness = energy.assemble(basis)
    ends = basis.get_dofs(lambda x: (x[0] < 1e-9) | (x[0] > 1.0 - 1e-9))
    pulled = basis.get_dofs(lambda x: x[0] > 1.0 - 1e-9).all("u^1")
    moved = np.zeros(basis.N)
    moved[pulled] = 1.0
    moved = skfem.solve(*skfem.condense(stiffness, x=moved, D=ends))
    ratio = float(moved @ (stiffness @ moved)) / width
    assert stretched_share(width, NU) == pytest.approx((1.0 - 1.0 / ratio) / NU**2, abs=0.02)
