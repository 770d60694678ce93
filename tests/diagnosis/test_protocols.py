"""Proposed runs: the motion that results from the steps of a recipe on a test bed."""

import numpy as np
import pytest

from fingervision.diagnosis.design.protocols import (
    SAMPLES_A_STROKE,
    driven,
    measured_ends,
    protocols,
    repeated,
    rounding_s,
)

STEP_S = 0.1


def test_a_triangle_goes_there_and_back_at_its_speed() -> None:
    step = {"kind": "triangle", "from_mm": -0.2, "to_mm": 0.6, "speed_mm_s": 0.4, "cycles": 2}
    path = driven([step], STEP_S, 0.0)
    assert (path[0], path[-1]) == pytest.approx((-0.2, -0.2))
    assert path.size - 1 == round(4 * 0.8 / 0.4 / STEP_S)
    assert np.max(np.abs(np.diff(path))) == pytest.approx(0.4 * STEP_S)


def test_a_staircase_stands_on_every_level_one_way() -> None:
    step = {"kind": "staircase", "from_mm": 0.0, "to_mm": 0.3, "steps": 3, "dwell_s": 2.0, "speed_mm_s": 0.5}
    path = driven([step], STEP_S, 0.0)
    assert np.all(np.diff(path) >= -1e-12)
    for level in (0.0, 0.1, 0.2, 0.3):
        assert np.sum(np.abs(path - level) < 1e-9) >= 20


def test_corners_are_as_round_as_the_record_s_own() -> None:
    sharp = {"kind": "triangle", "from_mm": 0.0, "to_mm": 1.0, "speed_mm_s": 0.5, "cycles": 3}
    for seconds in (0.3, 0.8):
        path = driven([sharp], 0.05, seconds)
        assert rounding_s(path, 0.05, (slice(0, path.size),)) == pytest.approx(seconds, abs=0.11)


@pytest.mark.parametrize("step_s", [0.05, 0.5, 2.0])
def test_no_stroke_is_faster_than_the_samples_can_follow(step_s: float) -> None:
    for _, steps in protocols(-0.5, 1.5, step_s):
        for step in steps:
            if step["kind"] == "triangle":
                way = abs(float(str(step["to_mm"])) - float(str(step["from_mm"])))
                assert way / float(str(step["speed_mm_s"])) >= 0.99 * SAMPLES_A_STROKE * step_s
        path = driven(steps, step_s, 0.3)
        assert path.min() > -0.5
        assert path.max() < 1.5


def test_repeating_drives_the_same_again_in_one_run() -> None:
    for name, steps in protocols(-0.5, 1.5, STEP_S):
        once, thrice = driven(steps, STEP_S, 0.0), driven(repeated(steps, 3), STEP_S, 0.0)
        assert thrice.min() == pytest.approx(once.min()), name
        assert thrice.max() == pytest.approx(once.max()), name
        strokes = [
            sum(int(str(step.get("cycles", 1))) for step in each if step["kind"] != "rezero")
            for each in (steps, repeated(steps, 3))
        ]
        assert strokes[1] == 3 * strokes[0], name


def test_a_run_begins_at_zero_where_the_stage_stands_there() -> None:
    ends = measured_ends(np.array([0.0, 0.6, 1.2]), (-0.5, 1.5))
    step = protocols(*ends, STEP_S)[0][1][0]
    assert step["from_mm"] == pytest.approx(0.0, abs=1e-4)
    assert measured_ends(np.array([0.0, 1.2]), (0.0, 1.5)) == (0.0, 1.2)
    assert measured_ends(np.array([-0.4, 1.2]), (-0.5, 1.5)) == (-0.4, 1.2)
