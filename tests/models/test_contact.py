"""Contact of fingers that are pressed together strongly, against penalty solutions by independent solvers."""

import numpy as np
import pytest
import skfem
from scipy.sparse import diags
from scipy.sparse.linalg import spsolve
from skfem.helpers import ddot, eye, grad, mul, trace, transpose

from fingervision.domain.gripper import Gripper
from fingervision.models.answer_figures import Physics
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.lumped import LumpedGripper
from fingervision.models.reference_mesh import ElementSize, mesh_outline

PENALTY_N_MM = 1e6
"""Penalty stiffness of each face point: a finger that is pressed with 18 N penetrates by some 1e-6 mm."""
WITHIN = 1e-4
CORNERS = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


class Half:
    """Unknowns of a meshed right half, with clamp, symmetry axis and drive found from its mesh alone."""

    def __init__(self, model: FiniteElementGripper) -> None:
        x, y = model.plate.nodes_mm
        x_dofs, y_dofs = model.plate.x_dofs, model.plate.y_dofs
        clamped, axis, outline = np.abs(y) < 1e-7, np.abs(x) < 1e-7, np.unique(model.plate.outline_edges)
        driven = (np.abs(y - model.gripper.lever.drive_face_y_mm) < 1e-7) & (x < 7.0 + 1e-7)
        held = np.concatenate([x_dofs[clamped | axis], y_dofs[clamped | driven]])
        face = outline[(np.abs(x[outline] - 2.0) < 1e-7) & (y[outline] > 92.0 - 1e-7)]
        self.driven, self.face, self.face_rest_mm = y_dofs[driven], x_dofs[face], x[face]
        self.free = np.setdiff1d(np.arange(2 * x.size), held)


def test_force_grip_and_stress_at_two_millimetres_of_closing(gripper: Gripper) -> None:
    model = FiniteElementGripper(gripper, Physics(contact=True))
    half = Half(model)
    K = model.elastic.driven.stiffness_n_mm
    touching = np.zeros(half.face.size, dtype=bool)
    driven = np.zeros(K.shape[0])
    driven[half.driven] = -2.0
    for _ in range(40):
        springs = np.zeros(K.shape[0])
        springs[half.face[touching]] = PENALTY_N_MM
        held = (K + diags(springs)).tocsr()
        load = -(held @ driven)
        load[half.face] -= PENALTY_N_MM * half.face_rest_mm * touching
        moved = driven.copy()
        moved[half.free] = spsolve(held[half.free][:, half.free].tocsc(), load[half.free])
        gaps = half.face_rest_mm + moved[half.face]
        if np.array_equal(gaps < 0.0, touching):
            break
        touching = gaps < 0.0
    state = model.loaded([-2.0])[0]
    # The model's matrix is that of both halves.
    assert state.force_n == pytest.approx(float((K @ moved)[half.driven].sum()), rel=WITHIN)
    assert state.grip_n == pytest.approx(-0.5 * PENALTY_N_MM * float(np.minimum(gaps, 0.0).sum()), rel=WITHIN)
    x, y = model.plate.nodes_mm[:, model.plate.corner_triangles]
    at_peak = np.hypot(x - state.place_mm[0], y - state.place_mm[1]) < 1e-9
    assert state.stress_mpa == pytest.approx(float(model.plate.von_mises_mpa(moved)[at_peak].max()), rel=WITHIN)
    # The stress exceeds the yield stress of 48 MPa, which the free gripper does not reach at this input; no point
    # penetrates the axis.
    assert state.stress_mpa > gripper.material.yield_mpa > 2.0 * model.peak_stress().mpa_per_mm
    pressed = model.equilibria([-2.0])[0].displacement
    inner = model.plate.nodes_mm[0] + pressed[model.plate.x_dofs]
    assert inner.min() > -1e-6


@pytest.mark.slow
def test_the_same_in_the_deformed_shape(gripper: Gripper) -> None:
    """Compared with elements, assembly and load steps of scikit-fem and a penalty at the axis; only the coarse mesh is
    shared.
    """
    mesh = mesh_outline(gripper, ElementSize(1.0, 9.0))
    model = FiniteElementGripper(gripper, Physics(large_rotation=True, contact=True), mesh=mesh, width_effect=False)
    half, material = Half(model), gripper.material
    E, nu = material.youngs_modulus_mpa, material.poisson_ratio
    tri = skfem.MeshTri2(mesh.nodes_mm, mesh.triangles)
    basis = skfem.Basis(tri, skfem.ElementVector(skfem.ElementTriP2()), intorder=4)

    def law(strain: np.ndarray) -> np.ndarray:
        return E / (1.0 + nu) * strain + E * nu / (1.0 - nu**2) * eye(trace(strain), 2)

    def strained(slope: np.ndarray) -> np.ndarray:
        return 0.5 * (slope + transpose(slope) + mul(transpose(slope), slope))

    @skfem.LinearForm
    def forces(v, w):  # type: ignore[no-untyped-def]
        F = grad(w["u"]) + eye(np.ones(w.x.shape[1:]), 2)
        return gripper.body.plate_mm * ddot(mul(F, law(strained(grad(w["u"])))), grad(v))

    @skfem.BilinearForm
    def slopes(d, v, w):  # type: ignore[no-untyped-def]
        F, stress = grad(w["u"]) + eye(np.ones(w.x.shape[1:]), 2), law(strained(grad(w["u"])))
        change = mul(transpose(F), grad(d))
        bent = mul(F, law(0.5 * (change + transpose(change)))) + mul(grad(d), stress)
        return gripper.body.plate_mm * ddot(bent, grad(v))

    moved = np.zeros(basis.N)
    for step in range(1, 4):
        moved[half.driven] = -2.0 * step / 3.0
        for _ in range(40):
            u = basis.interpolate(moved)
            through = np.minimum(half.face_rest_mm + moved[half.face], 0.0)
            residual, springs = forces.assemble(basis, u=u), np.zeros(basis.N)
            residual[half.face] += PENALTY_N_MM * through
            springs[half.face] = PENALTY_N_MM * (through < 0.0)
            if np.abs(residual[half.free]).max() < 1e-7:
                break
            tangent = (slopes.assemble(basis, u=u) + diags(springs)).tocsr()[half.free][:, half.free]
            moved[half.free] -= spsolve(tangent.tocsc(), residual[half.free])
        else:
            pytest.fail(f"step {step} did not settle")
    state = model.loaded([-2.0])[0]
    assert state.force_n == pytest.approx(2.0 * float(forces.assemble(basis, u=u)[half.driven].sum()), rel=WITHIN)
    assert state.grip_n == pytest.approx(-PENALTY_N_MM * float(through.sum()), rel=WITHIN)
    assert state.gap_mm == pytest.approx(model.rest_gap_mm + model.gap_change_mm(moved), abs=WITHIN)
    # Cauchy's stress F S F' / det F at the corners of the triangles that meet at the point.
    corners = skfem.Basis(tri, skfem.ElementVector(skfem.ElementTriP2()), quadrature=(CORNERS, np.full(3, 1.0 / 6.0)))
    slope = corners.interpolate(moved).grad
    F = slope + eye(np.ones(slope.shape[2:]), 2)
    cauchy = mul(mul(F, law(strained(slope))), transpose(F)) / (F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0])
    sx, sy, txy = cauchy[0, 0], cauchy[1, 1], cauchy[0, 1]
    von_mises = np.sqrt(sx**2 - sx * sy + sy**2 + 3.0 * txy**2)
    places = np.asarray(mesh.nodes_mm)[:, mesh.triangles[:3]]
    at_peak = np.hypot(places[0] - state.place_mm[0], places[1] - state.place_mm[1]).T < 1e-9
    assert state.stress_mpa == pytest.approx(float(von_mises[at_peak].max()), rel=WITHIN)
    assert state.stress_mpa > material.yield_mpa
    inner = mesh.nodes_mm[0] + model.equilibria([-2.0])[0].displacement[model.plate.x_dofs]
    assert inner.min() > -1e-5


def test_far_jumps_into_deep_contact_are_followed(gripper: Gripper) -> None:
    """One step from first touch to a deep grip, for which the prediction is poor, gives the same result as many small
    steps.
    """
    inputs = np.array([-1.0, -0.52, 0.5])
    model = LumpedGripper(gripper, Physics(large_rotation=True, contact=True))
    small = model.respond(np.linspace(-1.0, 0.5, 76))
    assert small.force_n is not None
    found = LumpedGripper(gripper, model.physics).equilibria(inputs.tolist())
    forces = np.interp(inputs, np.linspace(-1.0, 0.5, 76), small.force_n)
    assert [state.force_n for state in found] == pytest.approx(forces.tolist(), rel=2e-3)
    gaps = model.elastic.driven.gaps[0]
    assert min(gaps(state.displacement)[0].min() for state in found) > -1e-6
    for nodes in (3, 5, 17):
        assert model.body_poses(np.linspace(-1.0, 0.5, nodes))
