import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingervision.domain.errors import FingervisionError
from fingervision.domain.gripper import Material
from fingervision.models.hinge_correction import corrected_compliance
from fingervision.models.notch import Notch, bar_compliance, beam_compliance, circular_notch, masses_t
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
# Errors in % between elastic blocks of length 2 (2 R + t): Paros-Weisbord full, simplified, Schotborgh, along.
BLOCKS = {
    0.05: (-1.9, -1.2, -2.6, -10.4),
    0.1: (-3.8, -2.5, -2.4, -13.6),
    0.25: (-8.7, -5.6, -1.1, -18.3),
    0.5: (-14.9, -9.1, 1.4, -21.8),
    0.8: (-20.1, -11.2, 5.4, -23.6),
}
SMITH = {0.2: 0.9, 0.25: -1.6, 1 / 3: -3.1, 0.5: -2.1, 0.65: 0.7, 0.8: 4.2}
# t = 1, R = 4, b = 3 between rigid end planes, bricks: entries (row, column) and values in mm, N, rad.
BRICKS = {
    (0, 0): 9.247e-4,
    (1, 1): 0.10152,
    (5, 1): 0.023274,
    (5, 5): 5.818e-3,
    (2, 2): 0.02678,
    (4, 4): 1.234e-3,
    (3, 3): 4.016e-3,
}

ratios = st.floats(0.02, 1.0)


@given(ratio=ratios)
def test_the_closed_forms_of_beam_theory_are_one_integral(ratio: float) -> None:
    notch = circular_notch(4.0, 4.0 * ratio, 3.0)
    beam = beam_compliance(notch, PA2200)
    assert closed.paros_weisbord_bending(notch, PA2200) == pytest.approx(beam[5, 5], rel=QUADRATURE)
    assert closed.wu_zhou_bending(notch, PA2200) == pytest.approx(beam[5, 5], rel=QUADRATURE)
    assert closed.wu_zhou_axial(notch, PA2200) == pytest.approx(beam[0, 0], rel=QUADRATURE)


@given(ratio=ratios, scale=st.floats(0.01, 100.0))
def test_compliance_scales_with_size_by_dimension(ratio: float, scale: float) -> None:
    small = beam_compliance(circular_notch(1.0, ratio, 1.0), PA2200)
    large = beam_compliance(circular_notch(scale, scale * ratio, scale), PA2200)
    power = np.array([1, 1, 1, 2, 2, 2])
    assert large * np.outer(scale ** (power - 1.0), scale ** (power - 1.0)) * scale == pytest.approx(small, rel=1e-9)


@given(ratio=ratios, depth=st.floats(0.1, 10.0), ellipse=st.floats(0.2, 5.0))
def test_corrected_compliance_is_symmetric_and_passive(ratio: float, depth: float, ellipse: float) -> None:
    compliance = corrected_compliance(Notch(ratio, 1.0, ellipse, depth), PA2200)
    assert np.array_equal(compliance, compliance.T)
    assert np.linalg.eigvalsh(compliance).min() > 0.0


@pytest.mark.parametrize("ratio", RIGID_ENDS)
def test_errors_of_beam_theory_between_rigid_ends(ratio: float) -> None:
    notch = circular_notch(1.0, ratio, 1.0)
    beam = np.diag(beam_compliance(notch, PA2200)[PLANAR])
    errors = 100.0 * (beam / np.diag(plane_compliance(notch, PA2200)) - 1.0)
    assert errors == pytest.approx(RIGID_ENDS[ratio], abs=POINTS)


def between_blocks(ratio: float) -> np.ndarray:
    notch = circular_notch(1.0, ratio, 1.0)
    height = 2.0 + ratio
    blocks = bar_compliance(2.0 * height, height, 1.0, PA2200)[PLANAR]
    whole = plane_compliance(notch, PA2200, block_mm=2.0 * height)
    return np.array([whole[0, 0] - 2.0 * blocks[0, 0], whole[2, 2] - 2.0 * blocks[2, 2]])


@pytest.mark.parametrize("ratio", BLOCKS)
def test_errors_of_the_closed_forms_between_blocks(ratio: float) -> None:
    notch = circular_notch(1.0, ratio, 1.0)
    along, bending = between_blocks(ratio)
    forms = (closed.paros_weisbord_bending, closed.paros_weisbord_simplified_bending, closed.schotborgh_bending)
    errors = [100.0 * (form(notch, PA2200) / bending - 1.0) for form in forms]
    errors.append(100.0 * (closed.wu_zhou_axial(notch, PA2200) / along - 1.0))
    assert errors == pytest.approx(BLOCKS[ratio], abs=POINTS)


@pytest.mark.parametrize("ratio", SMITH)
def test_errors_of_smith_in_its_range(ratio: float) -> None:
    _, bending = between_blocks(ratio)
    error = 100.0 * (closed.smith_bending(circular_notch(1.0, ratio, 1.0), PA2200) / bending - 1.0)
    assert error == pytest.approx(SMITH[ratio], abs=POINTS)


def test_smith_is_refused_outside_its_range() -> None:
    with pytest.raises(FingervisionError, match=r"needs 0\.2 <= t / R <= 0\.8, but t / R is 0\.1; take the corrected"):
        closed.smith_bending(circular_notch(10.0, 1.0, 1.0), PA2200)


def test_closed_forms_refuse_an_ellipse() -> None:
    with pytest.raises(FingervisionError, match="is that of a circular notch, but the half axes are 4 and 2 mm"):
        closed.wu_zhou_bending(Notch(1.0, 4.0, 2.0, 3.0), PA2200)


def test_corrected_hinge_is_that_of_the_bricks() -> None:
    notch = circular_notch(4.0, 1.0, 3.0)
    bricks, corrected = solid_compliance(notch, PA2200), corrected_compliance(notch, PA2200)
    for place, value in BRICKS.items():
        assert bricks[place] == pytest.approx(value, rel=ENTRY)
        assert corrected[place] == pytest.approx(value, rel=ENTRY)


def segment_sum(segments: int) -> float:
    notch = circular_notch(4.0, 1.0, 3.0)
    middles = 4.0 * ((2.0 * np.arange(segments) + 1.0) / segments - 1.0)
    parts = [bar_compliance(8.0 / segments, h, 3.0, PA2200)[5, 5] for h in notch.height_mm(middles).tolist()]
    return float(100.0 * (sum(parts) / beam_compliance(notch, PA2200)[5, 5] - 1.0))


def test_segments_of_middle_height_converge_to_the_integral() -> None:
    errors = {segments: segment_sum(segments) for segments in (4, 5, 6, 8, 10)}
    # The values are printed with two digits: half a unit of the last digit.
    expected = {4: -7.6, 5: 2.3, 6: -0.6, 8: -0.01, 10: 0.02}
    assert [errors[n] for n in (4, 5, 6)] == pytest.approx([expected[n] for n in (4, 5, 6)], abs=0.05)
    assert [errors[n] for n in (8, 10)] == pytest.approx([expected[n] for n in (8, 10)], abs=0.006)


@settings(max_examples=20)
@given(segments=st.integers(1, 40), ratio=ratios)
def test_segment_masses_add_up_to_the_notch(segments: int, ratio: float) -> None:
    notch = circular_notch(1.0, ratio, 1.0)
    area = 2.0 * (ratio + 2.0) - np.pi
    masses = masses_t(notch, PA2200, np.linspace(-notch.reach_mm, notch.reach_mm, segments + 1))
    assert masses.sum() == pytest.approx(PA2200.density_t_mm3 * area, rel=1e-12)
    assert masses == pytest.approx(masses[::-1], rel=1e-9)
