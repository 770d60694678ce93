"""Routes by step data blocks end at their target, never exceed the requested speed, and are direct."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.domain.errors import FingervisionError, LimitError
from fingervision.domain.step_data import Coordinates, Operation, SpeedEntry, Step
from fingervision.testbed.motion.step_checks import SAME_MM, jog_step, nominal_speed_mm_s, route

TOP_MM_S = 400.0


def step(target_mm: float, speed_mm_s: float, *, relative: bool = False) -> Step:
    kind = Coordinates.RELATIVE if relative else Coordinates.ABSOLUTE
    return Step(target_mm, 0.1, SpeedEntry(speed_mm_s, 1000.0, 1000.0), kind)


STEPS = {
    1: step(0.0, 10.0),
    2: step(5.0, 10.0),
    3: step(5.0, 100.0),
    4: step(0.1, 1.0, relative=True),
    5: step(0.5, 1.0, relative=True),
    6: step(-0.1, 1.0, relative=True),
    7: Step(0.2, 0.1, SpeedEntry(1.0, 1000.0, 1000.0), Coordinates.RELATIVE, Operation.PUSHING, 2.0),
}


@given(st.integers(0, 100), st.integers(0, 100), st.sampled_from([1.0, 10.0, 100.0]))
def test_a_route_ends_at_its_target_and_keeps_the_speed(begin: int, end: int, speed: float) -> None:
    at_mm, to_mm = 0.1 * begin, 0.1 * end
    try:
        numbers = route(STEPS, at_mm, to_mm, speed, TOP_MM_S)
    except FingervisionError:
        assert (
            speed < 10.0
        )  # at 10 mm/s, every position can be reached: by a step to 0 or 5 mm, then by steps of 0.1 mm
        return
    for number in numbers:
        assert nominal_speed_mm_s(STEPS[number], to_mm, TOP_MM_S) <= 1.01 * speed
        at_mm = STEPS[number].end_mm(at_mm)
    assert at_mm == pytest.approx(to_mm, abs=SAME_MM)


def test_the_direct_way_is_taken_and_of_two_the_faster() -> None:
    assert route(STEPS, 4.5, 5.0, 400.0, TOP_MM_S) == (3,)
    assert route(STEPS, 4.5, 5.0, 10.0, TOP_MM_S) == (2,)
    assert route(STEPS, 4.0, 5.0, 5.0, TOP_MM_S) == (5, 5)
    assert route(STEPS, 4.0, 4.3, 5.0, TOP_MM_S) == (4, 4, 4)
    assert route(STEPS, 4.3, 4.3, 5.0, TOP_MM_S) == ()


def test_without_a_known_position_only_absolute_steps_begin_a_route() -> None:
    assert route(STEPS, None, 5.1, 50.0, TOP_MM_S) == (2, 4)
    with pytest.raises(LimitError, match=r"^The move to 5.1 mm must not be faster than 1 mm/s, but the slowest"):
        route(STEPS, None, 5.1, 1.0, TOP_MM_S)


def test_a_jog_takes_the_fastest_step_of_its_direction_that_is_slow_enough() -> None:
    assert jog_step(STEPS, 2.0, TOP_MM_S) in (4, 5)
    assert jog_step(STEPS, -2.0, TOP_MM_S) == 6
    with pytest.raises(LimitError) as raised:
        jog_step(STEPS, -0.5, TOP_MM_S)
    assert str(raised.value) == (
        "A jog at -0.5 mm/s must have a stored relative step with a negative target and at most this speed, but the "
        "controller has none: store such a step."
    )
