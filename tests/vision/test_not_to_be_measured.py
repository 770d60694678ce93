"""Scenes like two fingers that must be refused: tips hidden by a strap, a second pair, a shadow on one side."""

import zlib

import numpy as np
import pytest

from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.vision.pipeline import LINEAR_CAMERA, Settings, measure_frame
from fingervision.vision.single_picture import measure_picture
from tests.benchmarks.scenes.bench_things import THINGS
from tests.benchmarks.scenes.canvas import Canvas
from tests.benchmarks.scenes.gripper import BELOW_PX
from tests.benchmarks.scenes.shapes import Finger, box, gap_between

# The drawings are linear in light.
SETTINGS = Settings(BELOW_PX, camera=LINEAR_CAMERA)
DARK, LIGHT, GREY = 45.0, 190.0, 150.0


def two_fingers() -> tuple[Finger, Finger]:
    left = Finger(250.0, 120.0, 70.0, 6.0, 6.0, 1.0, -1)
    return left, Finger(390.0, 120.0, 70.0, 6.0, 6.0, -1.0, 1)


def painted(pair: tuple[Finger, Finger]) -> Canvas:
    canvas = Canvas(640, 480, LIGHT)
    for finger in pair:
        canvas.fill(finger.outline(), DARK)
    return canvas


def measured(canvas: Canvas, turns: int = 0) -> GapMeasurement | NoGap:
    picture = canvas.shot(1.0, 2.0, np.random.default_rng(7))
    return measure_frame(Frame(np.ascontiguousarray(np.rot90(picture, turns)), 0), SETTINGS)


@pytest.mark.parametrize("turns", [0, 1])
@pytest.mark.parametrize("breadth", [6.0, 30.0])
def test_a_strap_that_hides_the_tips_is_refused(breadth: float, turns: int) -> None:
    canvas = painted(two_fingers())
    canvas.stroke(np.array([(-5.0, 190.0), (645.0, 196.0)]), breadth, GREY)
    found = measured(canvas, turns)
    assert isinstance(found, NoGap), found
    assert "across the fingers" in found.words


@pytest.mark.parametrize("half", [60.0, 12.0])
def test_a_thing_of_another_breadth_beyond_a_tip_hinders_nothing(half: float) -> None:
    pair = two_fingers()
    canvas = painted(pair)
    canvas.fill(box(250.0 - half, 40.0, 250.0 + half, 90.0), DARK)
    found = measured(canvas)
    assert isinstance(found, GapMeasurement), found
    assert found.gap_px == pytest.approx(gap_between(*pair, BELOW_PX), abs=0.05)


def test_a_second_pair_of_another_breadth_is_not_chosen_from() -> None:
    canvas = painted(two_fingers())
    for x in (80.0, 110.0):
        canvas.stroke(np.array([(x, 90.0), (x, 500.0)]), 9.0, DARK)
    found = measured(canvas)
    assert isinstance(found, NoGap), found
    assert "More than two" in found.words


def test_a_shadow_on_one_inner_side_is_no_motion() -> None:
    pair = two_fingers()
    canvas = Canvas(640, 480, LIGHT)
    for finger in pair:
        canvas.fill(finger.outline() + np.array([6.0, 6.0]), 0.45 * LIGHT, soft_px=0.8)
    for finger in pair:
        canvas.fill(finger.outline(), DARK)
    found = measure_picture(Frame(canvas.shot(1.0, 2.0, np.random.default_rng(7)), 0), SETTINGS)
    if isinstance(found, GapMeasurement):
        truth = gap_between(*pair, BELOW_PX)
        assert abs(found.gap_px - truth) < max(0.1, 2.0 * np.hypot(found.u_gap_px, found.u_shift_px)), (found, truth)


@pytest.mark.parametrize("name", THINGS)
def test_things_on_a_bench_are_right_or_refused(name: str) -> None:
    for k in range(2):
        shot = THINGS[name](np.random.default_rng([17, zlib.crc32(name.encode()), k]))
        found = measure_picture(Frame(shot.picture, 0), SETTINGS)
        if isinstance(found, GapMeasurement):
            assert shot.gap_px is not None
            u = np.hypot(found.u_gap_px, found.u_shift_px)
            assert abs(found.gap_px - shot.gap_px) < max(0.25, 3.0 * u), (found, shot.gap_px)
