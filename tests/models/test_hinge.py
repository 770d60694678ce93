import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingervision.domain.gripper import Material
from fingervision.models.hinge_correction import Notch, beam_compliance, masses_t, planes_ratio
from tests.benchmarks.hinge_solid import plane_compliance, solid_compliance
from tests.models import hinge_closed_forms as closed

PA2200 = Material("PA2200", 1650.0, 0.34, 930.0, 48.0)
PLANAR = np.ix_([0, 1, 5], [0, 1, 5])

QUADRATURE = 1e-9  # rounding difference of closed formula and Gauss quadrature
POINTS = 0.5  # percentage points, the width to which the table of errors is known
ENTRY = 0.01  # of an entry of the three-dimensional table

# Errors in % of beam theory against plane stress between rigid end planes: along, across with shear, about z.
RIGID_ENDS = {
    0.05: (-5.8, -1.9, -1.8),
    0.1: (-7.1, -3.7, -3.6),
    0.2: (-8.0, -6.4, -6.5),
    0.25: (-8.1, -7.3, -7.7),
    1 / 3: (-8.1, -8.5, -9.3),
    0.5: (-7.4, -9.4, -11.5),
    0.65: (-6.6, -9.2, -12.6),
    0.8: (-5.8, -8.3, -13.2),
}
# t = 1, R = 4, b = 3 between rigid end planes, bricks: entries (row, column) and values in mm, N, rad.
BRICKS = {
    (0, 0): 9.247e-4,
    (1, 1): 0.10152,
    (2, 1): 0.023274,
    (2, 2): 5.818e-3,
}

ratios = st.floats(0.02, 1.0)


def corrected(notch: Notch) -> np.ndarray:
    """Compliance between rigid end planes: the correction keeps the matrix symmetric and positive definite."""
    root = np.sqrt(planes_ratio(notch, PA2200))
    return np.outer(root, root) * beam_compliance(notch, PA2200)


@given(ratio=ratios)
def test_the_closed_forms_of_beam_theory_are_one_integral(ratio: float) -> None:
    notch = closed.circular_notch(4.0, 4.0 * ratio, 3.0)
    beam = beam_compliance(notch, PA2200)
    assert closed.paros_weisbord_bending(notch, PA2200) == pytest.approx(beam[2, 2], rel=QUADRATURE)
    assert closed.wu_zhou_bending(notch, PA2200) == pytest.approx(beam[2, 2], rel=QUADRATURE)
    assert closed.wu_zhou_axial(notch, PA2200) == pytest.approx(beam[0, 0], rel=QUADRATURE)


@given(ratio=ratios, scale=st.floats(0.01, 100.0))
def test_compliance_scales_with_size_by_dimension(ratio: float, scale: float) -> None:
    small = beam_compliance(closed.circular_notch(1.0, ratio, 1.0), PA2200)
    large = beam_compliance(closed.circular_notch(scale, scale * ratio, scale), PA2200)
    power = np.array([1, 1, 2])
    assert large * np.outer(scale ** (power - 1.0), scale ** (power - 1.0)) * scale == pytest.approx(small, rel=1e-9)


@given(ratio=ratios, depth=st.floats(0.1, 10.0), ellipse=st.floats(0.2, 5.0))
def test_corrected_compliance_is_symmetric_and_passive(ratio: float, depth: float, ellipse: float) -> None:
    compliance = corrected(Notch(ratio, 1.0, ellipse, depth))
    assert np.array_equal(compliance, compliance.T)
    assert np.linalg.eigvalsh(compliance).min() > 0.0


@pytest.mark.parametrize("ratio", RIGID_ENDS)
def test_errors_of_beam_theory_between_rigid_ends(ratio: float) -> None:
    notch = closed.circular_notch(1.0, ratio, 1.0)
    beam = np.diag(beam_compliance(notch, PA2200))
    errors = 100.0 * (beam / np.diag(plane_compliance(notch, PA2200)) - 1.0)
    assert errors == pytest.approx(RIGID_ENDS[ratio], abs=POINTS)


def test_corrected_hinge_is_that_of_the_bricks() -> None:
    ours = corrected(closed.circular_notch(4.0, 1.0, 3.0))
    assert {place: ours[place] for place in BRICKS} == pytest.approx(BRICKS, rel=ENTRY)


@pytest.mark.slow
def test_the_bricks_are_those_of_the_table() -> None:
    bricks = solid_compliance(closed.circular_notch(4.0, 1.0, 3.0), PA2200)[PLANAR]
    assert {place: bricks[place] for place in BRICKS} == pytest.approx(BRICKS, rel=ENTRY)


@settings(max_examples=20)
@given(segments=st.integers(1, 40), ratio=ratios)
def test_segment_masses_add_up_to_the_notch(segments: int, ratio: float) -> None:
    notch = closed.circular_notch(1.0, ratio, 1.0)
    area = 2.0 * (ratio + 2.0) - np.pi
    masses = masses_t(notch, PA2200, np.linspace(-notch.reach_mm, notch.reach_mm, segments + 1))
    assert masses.sum() == pytest.approx(PA2200.density_t_mm3 * area, rel=1e-12)
    assert masses == pytest.approx(masses[::-1], rel=1e-9)
