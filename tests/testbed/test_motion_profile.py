"""Motion profiles cover the distance in the requested time, within the limits of speed and acceleration."""

from math import sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingervision.domain.step_data import CycleTime, SpeedEntry
from fingervision.testbed.motion.motion_profile import MotionProfile, profile, shortest_s

TOP_MM_S, STRONG_MM_S2 = 400.0, 27500.0  # 5.5 N on 0.2 kg
# Relative rounding error of sums and products of a dozen double-precision numbers.
ROUNDING = 1e-9

ways_mm = st.floats(0.001, 10.0)
signs = st.sampled_from([-1.0, 1.0])
slownesses = st.floats(1.0, 50.0)
speed_entries = st.builds(SpeedEntry, st.floats(0.1, 400.0), st.floats(1.0, 3e4), st.floats(1.0, 3e4))


def in_time(way_mm: float, slowness: float) -> MotionProfile:
    return profile(way_mm, CycleTime(slowness * shortest_s(way_mm, TOP_MM_S, STRONG_MM_S2)), TOP_MM_S)


@given(ways_mm, signs, slownesses)
def test_a_motion_in_time_goes_its_way_in_that_time_within_the_limits(way: float, sign: float, slowness: float) -> None:
    motion = in_time(sign * way, slowness)
    asked_s = slowness * shortest_s(way, TOP_MM_S, STRONG_MM_S2)
    assert motion.seconds == pytest.approx(asked_s, rel=ROUNDING)
    assert motion.travelled_mm(np.array([asked_s]))[0] == pytest.approx(sign * way, rel=ROUNDING)
    assert motion.speed_mm_s <= TOP_MM_S * (1.0 + ROUNDING)
    assert max(motion.acceleration_mm_s2, motion.deceleration_mm_s2) <= STRONG_MM_S2 * (1.0 + 1e-6)
    assert motion.cruising_s >= -ROUNDING


@given(ways_mm, signs, speed_entries)
def test_a_motion_at_speed_goes_its_way_with_the_accelerations_asked_for(
    way: float, sign: float, entry: SpeedEntry
) -> None:
    motion = profile(sign * way, entry, TOP_MM_S)
    assert motion.travelled_mm(np.array([motion.seconds]))[0] == pytest.approx(sign * way, rel=ROUNDING)
    assert motion.speed_mm_s <= entry.speed_mm_s
    assert motion.acceleration_mm_s2 == pytest.approx(entry.acceleration_mm_s2, rel=ROUNDING)
    assert motion.deceleration_mm_s2 == pytest.approx(entry.deceleration_mm_s2, rel=ROUNDING)
    if motion.cruising_s > 1e-6:
        assert motion.speed_mm_s == entry.speed_mm_s


@given(ways_mm, speed_entries)
def test_the_way_is_the_integral_of_the_speed(way: float, entry: SpeedEntry) -> None:
    motion = profile(way, entry, TOP_MM_S)
    # The speed is linear between these times, so that the trapezoidal rule on them is exact.
    knots_s = np.cumsum([0.0, motion.speeding_s, motion.cruising_s, motion.slowing_s])
    speeds = motion.speeds_mm_s(knots_s)
    steps_mm = 0.5 * (speeds[1:] + speeds[:-1]) * np.diff(knots_s)
    assert np.allclose(motion.travelled_mm(knots_s)[1:], np.cumsum(steps_mm), rtol=ROUNDING, atol=ROUNDING)


@given(ways_mm, slownesses, speed_entries)
def test_both_directions_mirror_each_other(way: float, slowness: float, entry: SpeedEntry) -> None:
    for there, back in (
        (in_time(way, slowness), in_time(-way, slowness)),
        (profile(way, entry, TOP_MM_S), profile(-way, entry, TOP_MM_S)),
    ):
        times_s = np.linspace(-0.1, 1.1, 23) * there.seconds
        assert np.array_equal(there.travelled_mm(times_s), -back.travelled_mm(times_s))
        assert np.array_equal(there.speeds_mm_s(times_s), -back.speeds_mm_s(times_s))


@given(ways_mm, st.floats(0.5, 0.999))
def test_no_motion_is_shorter_than_the_shortest(way: float, share: float) -> None:
    """The accelerations that a shorter time requires exceed the limit."""
    least_s = shortest_s(way, TOP_MM_S, STRONG_MM_S2)
    seconds = share * least_s
    if seconds <= way / TOP_MM_S:
        return  # too short even at the largest speed throughout
    motion = profile(way, CycleTime(seconds), TOP_MM_S)
    assert motion.acceleration_mm_s2 > STRONG_MM_S2


def test_the_trapezoid_agrees_with_its_textbook_formula() -> None:
    """v = (a T - sqrt(a^2 T^2 - 4 a s)) / 2 for distance s, time T and acceleration a, which requires a T^2 >= 4 s."""
    motion = profile(10.0, CycleTime(0.04), TOP_MM_S)
    a, seconds = motion.acceleration_mm_s2, 0.04
    assert motion.cruising_s > 0.0
    assert motion.speed_mm_s == pytest.approx(0.5 * (a * seconds - sqrt(a**2 * seconds**2 - 40.0 * a)), rel=ROUNDING)


def test_ten_millimetres_in_fifty_milliseconds_are_a_triangle_of_400_mm_s() -> None:
    motion = profile(10.0, CycleTime(0.05), TOP_MM_S)
    assert (motion.speed_mm_s, motion.cruising_s) == (400.0, 0.0)
    assert motion.acceleration_mm_s2 == pytest.approx(16000.0)


@pytest.mark.parametrize("entry", [CycleTime(0.3), SpeedEntry(10.0, 100.0, 100.0)])
def test_no_way_is_no_motion(entry: CycleTime | SpeedEntry) -> None:
    motion = profile(0.0, entry, TOP_MM_S)
    assert motion.speed_mm_s == 0.0
    assert not motion.travelled_mm(np.linspace(0.0, 1.0, 5)).any()
