"""Interpolation between encoder steps: the position of a stage at constant speed is found to a small fraction of a
step.
"""

import numpy as np
import pytest

from fingervision.motion.encoder_interpolation import WAIT_FOR_BORDER_S, StageTrack
from fingervision.testbed.force_sensor import Reading

STEP_MM, RATE_HZ = 0.03, 200.0
# A step boundary is passed between two readings: half of the distance between readings, at 0.5 mm/s.
BETWEEN_READINGS_MM = 0.5 * 0.5 / RATE_HZ


def read(position_mm: float, device_s: float, moving: bool) -> Reading:
    return Reading(device_s, device_s, device_s, round(position_mm / STEP_MM) * STEP_MM, moving)


def followed(speed_mm_s: float = 0.5) -> tuple[StageTrack, np.ndarray]:
    """Track of a motion of 2 s, a rest of 1 s, and a return of 2 s, and the times and true positions of readings."""
    track = StageTrack(STEP_MM)
    time_s = np.arange(0.0, 6.0, 1.0 / RATE_HZ)
    true_mm = speed_mm_s * np.interp(time_s, [0.5, 2.5, 3.5, 5.5], [0.0, 2.0, 2.0, 0.0])
    for at_s, mm in zip(time_s.tolist(), true_mm.tolist(), strict=True):
        track.add(read(mm, at_s, 0.5 < at_s < 2.5 or 3.5 < at_s < 5.5))
    return track, np.stack([time_s, true_mm])


def test_a_moving_stage_is_found_between_the_borders() -> None:
    track, (time_s, true_mm) = followed()
    way = (time_s > 0.6) & (time_s < 5.4)
    found_mm = np.array([track.at_mm(at_s) for at_s in time_s[way].tolist()])
    # When the stage comes to rest after the first motion, its speed is known from the last step boundaries alone.
    assert np.max(np.abs(found_mm - true_mm[way])) < 3.0 * BETWEEN_READINGS_MM
    assert np.std(found_mm - true_mm[way]) < 0.15 * STEP_MM / np.sqrt(12.0)


def test_on_the_way_to_the_next_border_it_waits_but_not_for_ever() -> None:
    track = StageTrack(STEP_MM)
    for k in range(400):
        at_s = k / RATE_HZ
        track.add(read(0.001 * at_s, at_s, k > 0))
    newest_s = 399 / RATE_HZ
    assert track.at_mm(newest_s) is None
    assert track.at_mm(newest_s, at_once=True) is not None
    assert track.at_mm(newest_s - WAIT_FOR_BORDER_S - 0.01) is not None


def test_without_a_step_readings_are_taken_as_they_are() -> None:
    track = StageTrack(0.0)
    for at_s in (0.0, 1.0):
        track.add(Reading(at_s, at_s, at_s, 0.3 * at_s, True))
    assert track.at_mm(0.5) == pytest.approx(0.15)
    assert track.at_mm(1.0) == pytest.approx(0.3)


@pytest.mark.parametrize("every_s", [0.005, 0.02, 0.037])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_stage_that_slows_down_rests_where_its_encoder_says(every_s: float, sign: float) -> None:
    """If several encoder steps lie between two readings, the interpolated position reaches the final position."""
    step_mm, speed_mm_s, slowing_s = 0.0005, 0.5, 0.1
    track = StageTrack(step_mm)
    time_s = np.arange(0.0, 3.0, every_s)

    def place_mm(at_s: float) -> float:
        # Constant speed from 0.5 s on, then constant deceleration that ends at 1.5 s.
        even_s, left_s = min(max(at_s - 0.5, 0.0), 0.9), min(max(at_s - 1.4, 0.0), slowing_s)
        return sign * speed_mm_s * (even_s + left_s - 0.5 * left_s**2 / slowing_s)

    for at_s in time_s.tolist():
        counted = round(place_mm(at_s) / step_mm) * step_mm
        track.add(Reading(at_s, at_s, at_s, counted, 0.5 < at_s < 1.5))
    resting = [track.at_mm(at_s, at_once=True) for at_s in time_s[time_s > 1.5 + every_s].tolist()]
    assert resting == pytest.approx([place_mm(3.0)] * len(resting), abs=0.5 * step_mm + 1e-12)
    way_s = np.arange(0.6, 1.5, 0.01)
    found = np.array([track.at_mm(at_s, at_once=True) for at_s in way_s.tolist()])
    true = np.array([place_mm(at_s) for at_s in way_s.tolist()])
    # Between two readings, the speed changes by at most the deceleration times the interval of readings.
    assert np.max(np.abs(found - true)) < step_mm + 0.5 * speed_mm_s / slowing_s * every_s**2
