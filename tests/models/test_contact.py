"""Contact of the fingers pressed hard together, against a penalty solution with a solver of its own."""

import numpy as np
import pytest
from scipy.sparse import diags
from scipy.sparse.linalg import spsolve

from fingervision.domain.gripper import Gripper
from fingervision.models.finite_element import FiniteElementGripper
from fingervision.models.physics import Physics

PENALTY_N_MM = 1e6
"""Of each face point: a finger that is pressed with 18 N then sinks in by some 1e-6 mm."""
WITHIN = 1e-4


def test_force_grip_and_stress_at_two_millimetres_of_closing(gripper: Gripper) -> None:
    model = FiniteElementGripper(gripper, Physics(contact=True))
    half, K = model.half, model.half.stiffness_n_mm
    touching = np.zeros(half.face.size, dtype=bool)
    driven = np.zeros(half.unknowns)
    driven[half.driven] = -2.0
    for _ in range(40):
        springs = np.zeros(half.unknowns)
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
    assert state.force_n == pytest.approx(2.0 * float((K @ moved)[half.driven].sum()), rel=WITHIN)
    assert state.grip_n == pytest.approx(-PENALTY_N_MM * float(np.minimum(gaps, 0.0).sum()), rel=WITHIN)
    x, y = model.plate.nodes_mm[:, model.plate.corner_triangles]
    at_peak = np.hypot(x - state.place_mm[0], y - state.place_mm[1]) < 1e-9
    assert state.stress_mpa == pytest.approx(float(model.plate.von_mises_mpa(moved)[at_peak].max()), rel=WITHIN)
    # Beyond the yield of 48 MPa, which the free gripper does not reach there; no point lies beyond the axis.
    assert state.stress_mpa > gripper.material.yield_mpa > 2.0 * model.peak_stress().mpa_per_mm
    pressed = model.equilibria([-2.0])[0].displacement_mm
    inner = model.plate.nodes_mm[0] + pressed[model.plate.x_dofs]
    assert inner.min() > -1e-6
