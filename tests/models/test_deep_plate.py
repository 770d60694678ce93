"""Out of the plane in three dimensions: a cantilever against beam theory, torsion against Saint-Venant, the published
sample against brick elements.
"""

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

from fingervision.domain.gripper import Gripper, Material
from fingervision.models.gripper_mechanism import half_mechanism
from fingervision.models.out_of_plane import DeepPlate, out_of_plane
from fingervision.models.planar_region import PlanarRegion
from fingervision.models.plane_shapes import box
from fingervision.models.triangulate import triangulate

STEEL = Material("steel", 210000.0, 0.3, 7850.0, 400.0)
PLAIN = Material("without cross contraction, as a beam is", 210000.0, 0.0, 7850.0, 400.0)
LENGTH_MM, GRAVITY_MM_S2 = 100.0, 9806.65
BEAM = 5e-3
"""Relative contribution of shear to Euler's beam at a ratio of length to depth of 20 and more."""


def cantilever(
    width_mm: float, depth_mm: float, material: Material = STEEL, order: int = 3
) -> tuple[DeepPlate, np.ndarray]:
    region = PlanarRegion(((True, box(0.0, LENGTH_MM, 0.0, width_mm)),))
    plate = DeepPlate(triangulate(region, 2.0, 4.0), material, depth_mm, order)
    clamped = np.flatnonzero(plate.nodes_mm[0] < 1e-9)
    return plate, np.concatenate([plate.coefficients(clamped, way) for way in range(3)])


@pytest.mark.parametrize(("width", "depth"), [(2.0, 5.0), (5.0, 2.0)])
def test_a_cantilever_s_first_mode_and_sag(width: float, depth: float) -> None:
    plate, held = cantilever(width, depth, PLAIN)
    body = plate.supported(held)
    E, density = PLAIN.youngs_modulus_mpa, PLAIN.density_t_mm3
    bending = np.sqrt(E * depth**2 / (12.0 * density))
    expected = 1.875104**2 / (2.0 * np.pi * LENGTH_MM**2) * bending
    assert body.modes_hz(1)[0] == pytest.approx(expected, rel=BEAM)
    sag = plate.middle_mm(body.sag(GRAVITY_MM_S2), (LENGTH_MM, 0.5 * width))
    assert sag == pytest.approx(1.5 * density * GRAVITY_MM_S2 * LENGTH_MM**4 / (E * depth**2), rel=BEAM)


def test_torsion_of_a_deep_bar() -> None:
    """Saint-Venant's constant of a rectangle 4 to 1 is 0.281 b t^3 (Timoshenko and Goodier, article 109).

    The clamp prevents warping of its section, which shortens the effective length by sqrt(E I_w / (G J)) (Vlasov,
    Thin-Walled Elastic Beams, chapter 2), with I_w = b^3 t^3 / 144.
    """
    width, depth = 2.0, 8.0
    plate, held = cantilever(width, depth, order=5)
    x = plate.nodes_mm[0]
    end = np.flatnonzero(x > LENGTH_MM - 1e-9)
    turn = np.zeros(plate.unknowns)
    # u_y = -turn z, u_z = turn (y - middle): rigid rotation of the end about the axis.
    turn[plate.coefficients(end, 1).reshape(end.size, -1)[:, 0]] = -0.5 * depth
    turn[plate.coefficients(end, 2).reshape(end.size, -1)[:, 0]] = plate.nodes_mm[1, end] - 0.5 * width
    driven = np.concatenate([plate.coefficients(end, way) for way in (1, 2)])
    free = np.setdiff1d(np.arange(plate.unknowns), np.concatenate([held, driven]))
    K = plate.stiffness_n_mm
    moved = turn.copy()
    moved[free] = spsolve(K[free][:, free].tocsc(), -(K @ turn)[free])
    torque = float(turn @ (K @ moved))
    twist = STEEL.shear_modulus_mpa * 0.281 * depth * width**3
    held_mm = np.sqrt(STEEL.youngs_modulus_mpa * (depth * width) ** 3 / 144.0 / twist)
    assert torque == pytest.approx(twist / (LENGTH_MM - held_mm), rel=0.01)


def test_a_rigid_lift_costs_nothing() -> None:
    plate, _ = cantilever(5.0, 2.0)
    assert np.abs(plate.stiffness_n_mm @ plate.lifted).max() < 1e-9 * abs(plate.stiffness_n_mm).max()
    mass = STEEL.density_t_mm3 * LENGTH_MM * 5.0 * 2.0
    assert plate.lifted @ plate.mass_t @ plate.lifted == pytest.approx(mass, rel=1e-9)


@pytest.mark.slow
def test_the_sample_by_calculix(gripper: Gripper) -> None:
    """CalculiX's wedge elements (`tests/benchmarks/models_three_dimensions.py`) give 61.79 and 352.94 Hz, brick
    elements 0.105 mm of sag.
    """
    found = out_of_plane(half_mechanism(gripper), 2)
    assert found.modes_hz == pytest.approx((61.79, 352.94), rel=5e-3)
    assert found.sag_mm["right tip"] == pytest.approx(0.105, rel=0.01)
