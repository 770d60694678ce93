import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.linalg import splu

from fingervision.models.corotational_frame import CorotationalFrame

ELEMENTS = 16
ELASTICA = 1e-3  # as a share of the length, for 16 elements
LOAD_STEPS = 20

# End load F L^2 / EI, with u / L, v / L and theta from integrating the equation of the elastica.
CASES = {
    1.0: (0.05643, 0.30172, 0.46135),
    2.0: (0.16064, 0.49346, 0.78175),
    5.0: (0.38763, 0.71379, 1.21537),
    10.0: (0.55500, 0.81061, 1.43029),
}


def cantilever(elements: int = ELEMENTS, shear: float = 0.0) -> CorotationalFrame:
    """Cantilever of length 1 and bending stiffness 1; its elongation of 1e-5 per unit force is below the tolerances."""
    nodes = np.stack([np.linspace(0.0, 1.0, elements + 1), np.zeros(elements + 1)], axis=1)
    ends = np.stack([np.arange(elements), np.arange(1, elements + 1)], axis=1)
    h = 1.0 / elements
    one = np.array([[1e-5 * h, 0, 0], [0, h**3 / 3 + shear * h, h**2 / 2], [0, h**2 / 2, h]])
    return CorotationalFrame(nodes, ends, np.repeat(one[None], elements, axis=0))


def solve(frame: CorotationalFrame, load: np.ndarray, steps: int = LOAD_STEPS) -> np.ndarray:
    moved = np.zeros(frame.unknowns)
    for step in range(1, steps + 1):
        for _ in range(40):
            tangent, force = frame.internal_force_n(moved)
            residual = (load * step / steps - force)[3:]
            if np.abs(residual).max() < 1e-8 * np.abs(load).max():
                break
            moved[3:] += splu(tangent[3:][:, 3:].tocsc()).solve(residual)
        else:
            pytest.fail(f"step {step} did not settle")
    return moved


@pytest.mark.parametrize("pull", CASES)
def test_elastica(pull: float) -> None:
    frame = cantilever()
    load = np.zeros(frame.unknowns)
    load[-2] = pull
    moved = solve(frame, load)
    assert (-moved[-3], moved[-2], moved[-1]) == pytest.approx(CASES[pull], abs=ELASTICA)


@pytest.mark.parametrize("turns", [0.5, 1.0])
def test_a_moment_rolls_the_beam_into_an_arc(turns: float) -> None:
    frame = cantilever()
    load = np.zeros(frame.unknowns)
    load[-1] = angle = 2.0 * np.pi * turns
    moved = solve(frame, load)
    exact = (np.sin(angle) / angle - 1.0, (1.0 - np.cos(angle)) / angle)
    # Chords replace an arc: 16 elements bent to a full circle form a closed polygon; the error for an arc is 0.4 %.
    assert moved[-3:-1] == pytest.approx(exact, abs=5e-3)
    assert moved[-1] == pytest.approx(angle, rel=1e-9)


def test_a_short_cantilever_shears() -> None:
    shear = 0.05
    frame = cantilever(shear=shear)
    load = np.zeros(frame.unknowns)
    load[-2] = 1e-6
    assert solve(frame, load, 1)[-2] / 1e-6 == pytest.approx(1.0 / 3.0 + shear, rel=1e-6)


@settings(max_examples=25)
@given(angle=st.floats(-3.0, 3.0), dx=st.floats(-5.0, 5.0), dy=st.floats(-5.0, 5.0), seed=st.integers(0, 99))
def test_rigid_motion_costs_nothing_and_the_tangent_is_the_slope(angle: float, dx: float, dy: float, seed: int) -> None:
    frame = cantilever(4)
    c, s = np.cos(angle), np.sin(angle)
    moved = np.empty((5, 3))
    moved[:, :2] = frame.nodes_mm @ np.array([[c, s], [-s, c]]) - frame.nodes_mm + [dx, dy]
    moved[:, 2] = angle
    stiffest = 4e5  # elements loaded along their axes
    _, force = frame.internal_force_n(moved.ravel())
    assert np.abs(force).max() < 1e-13 * stiffest
    bent = moved.ravel() + 1e-2 * np.random.default_rng(seed).standard_normal(15) * np.tile([0.0, 0.1, 1.0], 5)
    way = np.random.default_rng(seed + 1).standard_normal(15)
    tangent, _ = frame.internal_force_n(bent)
    step = 1e-6
    slope = (frame.internal_force_n(bent + step * way)[1] - frame.internal_force_n(bent - step * way)[1]) / (2 * step)
    assert tangent @ way == pytest.approx(slope, abs=1e-6 * stiffest)
    assert abs(tangent - tangent.T).max() < 1e-12 * stiffest
