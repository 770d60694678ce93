"""Conversion from pixels to millimetres, with lens, plane and budget as in `calib`."""

import subprocess
import sys

import numpy as np
import pytest

from calib.calibration import BareScale
from calib.measured_scale import Calibration, ScalePart
from calib.projection import Lens, Plane
from fingervision.gauges.plane_scale import PlaneScale
from fingervision.gauges.quantities import Angle, Distance, Position, Shift
from fingervision.gauges.recording import cells_of

SIZE = (640, 480)
LENS = Lens(np.array([900.0, 900.0, 320.0, 240.0, -0.2, 0.05, 0.0, 0.0, 0.0]), np.zeros((9, 9)))
PLANE = Plane(np.array([[1.02, 0.01, -4.0], [0.005, 0.99, 3.0], [2e-5, -1e-5, 1.0]]))
PARTS = (ScalePart("size", np.array([[4e-4, 1e-4], [1e-4, 2.5e-3]])),)


def _scale(**more: object) -> Calibration:
    return Calibration(34.0, 0.3, PARTS, SIZE, **more)


@pytest.mark.parametrize("more", [{}, {"lens": LENS}, {"lens": LENS, "plane": PLANE}])
@pytest.mark.parametrize("is_light", [True, False])
def test_a_distance_is_that_of_a_gap(more: dict[str, object], is_light: bool) -> None:
    scale = _scale(**more)
    first, second = (200.0, 150.0), (310.0, 180.0)
    (cell,) = cells_of([Distance(first, second, 0.02, 1 if is_light else -1)], PlaneScale(scale, SIZE))
    gap = scale.distances(np.array([[first, second]]), np.array([0.02]), np.array([is_light]))
    assert cell.value == pytest.approx(float(gap.value_mm[0]), rel=1e-9)
    # The covariance of scale and bias, and the size of a square in which the budget is asked once, are small beside it.
    assert gap.u_mm is not None
    assert cell.u == pytest.approx(float(gap.u_mm[0]), rel=0.15)


def test_positions_are_counted_from_the_middle_as_in_the_table_of_gaps() -> None:
    scale = _scale()
    left, right = (200.0, 200.0), (300.0, 200.0)
    expected = scale.positions_mm(np.array([[left, right]]), 0, np.array([True]), SIZE)[0]
    # Of a light gap between dark edges: it is dark before the first edge and beyond the second.
    found = cells_of([Position(left, 0.0, 0.01, -1), Position(right, 0.0, 0.01, 1)], PlaneScale(scale, SIZE))
    assert [cell.value for cell in found] == pytest.approx(list(expected), abs=1e-9)
    (plain,) = cells_of([Position(left, 0.0, 0.01)], PlaneScale(scale, SIZE))
    assert plain.value == pytest.approx((200.0 - 319.5) / 34.0)
    assert plain.u < found[0].u


def test_a_turn_and_an_angle_survive_a_turned_and_stretched_view() -> None:
    turn = 0.3
    rotated = Plane(np.array([[np.cos(turn), -np.sin(turn), 40.0], [np.sin(turn), np.cos(turn), -9.0], [0, 0, 1.0]]))
    plane = PlaneScale(_scale(plane=rotated), SIZE)
    angle, spin = cells_of([Angle((300, 200), 3.0, 1e-4), Angle((300, 200), 0.05, 1e-4, is_turn=True)], plane)
    assert angle.value == pytest.approx(1e3 * (3.0 + turn))
    assert spin.value == pytest.approx(50.0)


def test_a_bare_scale_adds_no_uncertainty_and_no_scale_leaves_pixels() -> None:
    shift = Shift((10.0, 20.0), (13.0, 24.0), 0.5 * np.pi, 0.01)
    (cell,) = cells_of([shift], PlaneScale(BareScale(20.0), SIZE))
    assert (cell.value, cell.u, cell.unit) == (pytest.approx(0.2), pytest.approx(0.0005), "mm")
    (cell,) = cells_of([shift], None)
    assert (cell.value, cell.u, cell.unit) == (pytest.approx(4.0), 0.01, "px")


def test_the_fits_can_be_had_without_the_rest() -> None:
    program = (
        "import sys, fingervision.vision as vision\n"
        "assert all(hasattr(vision, name) for name in vision.__all__)\n"
        "heavy = {'av', 'matplotlib', 'skimage', 'click', 'starlette', 'skfem'} & set(sys.modules)\n"
        "own = [name for name in sys.modules if name.startswith(('fingervision.frames', 'fingervision.measuring'))]\n"
        "assert not heavy and not own, (heavy, own)\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
