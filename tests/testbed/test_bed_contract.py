"""Every actuator, force sensor and camera keeps its protocol; a part without hardware joins by being listed."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from fingervision.domain.errors import FingervisionError
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.reading import Reading
from tests.testbed.simulated_beds import live_camera_at

# A part is looked at through a bed that it belongs to.
BEDS: dict[str, Callable[[pytest.FixtureRequest], Bed]] = {
    "simulated": lambda request: open_bed("simulated"),
    "board": lambda request: request.getfixturevalue("homed_board_bed"),
    "source": lambda request: request.getfixturevalue("source_bed"),
    "hand_screw": lambda request: request.getfixturevalue("hand_screw_bed"),
}
WAIT_S, PATIENCE_S = 0.01, 10.0


@pytest.fixture
def source_bed(tmp_path: Path) -> Bed:
    """A camera that goes on by itself, on the host's clock."""
    return open_bed(str(live_camera_at(tmp_path)))


@pytest.fixture(params=sorted(BEDS))
def bed(request: pytest.FixtureRequest) -> Iterator[Bed]:
    opened = BEDS[request.param](request)
    yield opened
    opened.close()


def needs_a_motor(bed: Bed) -> None:
    if bed.actuator.name == "hand screw":
        pytest.skip("a hand has its own speed, and stands when it has answered")


def until_rest(bed: Bed) -> tuple[Reading, ...]:
    """Readings up to the end of the motion, the last of them at rest."""
    until_s = bed.clock.now_s() + PATIENCE_S
    while bed.actuator.busy:
        bed.clock.wait_until(bed.clock.now_s() + WAIT_S)
        assert bed.clock.now_s() < until_s
    return bed.actuator.readings()


def at_rest(bed: Bed) -> float:
    return until_rest(bed)[-1].value


def moved_s(readings: tuple[Reading, ...]) -> float:
    """How long it moved, by the actuator's own clock: a busy machine looks late, but the readings bear their times."""
    first, last = readings[0].value, readings[-1].value
    began_s = max(each.device_s for each in readings if each.value == pytest.approx(first, abs=1e-9))
    ended_s = min(each.device_s for each in readings if each.value == pytest.approx(last, abs=1e-9))
    return ended_s - began_s


def known_mm(bed: Bed, speed_mm_s: float) -> float:
    """How well readings tell the way of a motion: by the encoder's steps, and the time between two readings."""
    return bed.actuator.limits.encoder_step_mm + 2.0 * WAIT_S * speed_mm_s


def close_enough_mm(bed: Bed) -> float:
    return bed.actuator.limits.accuracy_mm + 0.5 * bed.actuator.limits.encoder_step_mm + 1e-6


def test_an_actuator_goes_where_it_is_sent(bed: Bed) -> None:
    for to_mm in (0.5, -0.2, 0.0):
        bed.actuator.move(to_mm, 2.0)
        assert at_rest(bed) == pytest.approx(to_mm, abs=close_enough_mm(bed))


def test_a_motion_takes_the_time_that_its_speed_says(bed: Bed) -> None:
    needs_a_motor(bed)
    before = bed.actuator.readings()[-1:]
    bed.actuator.move(1.0, 2.0)
    # The way may be longer or shorter by the accuracy at either end.
    within_mm = 2.0 * bed.actuator.limits.accuracy_mm + known_mm(bed, 2.0)
    assert moved_s(before + until_rest(bed)) == pytest.approx(0.5, abs=within_mm / 2.0)


def test_homing_ends_at_zero(bed: Bed) -> None:
    bed.actuator.move(0.7, 2.0)
    at_rest(bed)
    bed.actuator.home()
    assert at_rest(bed) == pytest.approx(0.0, abs=1e-6)


def test_a_jog_ends_with_a_stop(bed: Bed) -> None:
    needs_a_motor(bed)
    before = bed.actuator.readings()[-1:]
    bed.actuator.jog(0.5)
    bed.clock.wait_until(bed.clock.now_s() + 1.0)
    assert bed.actuator.busy, bed.actuator.alarm
    bed.actuator.stop()
    readings = before + until_rest(bed)
    stopped_mm = readings[-1].value
    assert stopped_mm == pytest.approx(0.5 * moved_s(readings), abs=known_mm(bed, 0.5))
    assert stopped_mm < bed.limits.upper_mm - close_enough_mm(bed)
    bed.clock.wait_until(bed.clock.now_s() + 0.5)
    assert bed.actuator.readings()[-1].value == stopped_mm


def test_readings_come_in_order_and_between_question_and_answer(bed: Bed) -> None:
    bed.actuator.move(0.5, 1.0)
    seen = []
    for _ in range(5):
        bed.clock.wait_until(bed.clock.now_s() + 0.04)
        before_s = bed.clock.now_s()
        readings = bed.actuator.readings()
        assert readings
        assert before_s <= readings[-1].asked_s <= readings[-1].got_s <= bed.clock.now_s()
        seen += readings
    assert all(a.device_s < b.device_s for a, b in pairwise(seen))
    assert all(reading.asked_s <= reading.got_s for reading in seen)


@pytest.mark.slow
@pytest.mark.parametrize("beyond_mm", [0.1, -0.1])
def test_beyond_its_limits_nothing_moves(bed: Bed, beyond_mm: float) -> None:
    limits = bed.actuator.limits
    target_mm = (limits.upper_mm if beyond_mm > 0 else limits.lower_mm) + beyond_mm
    with pytest.raises(FingervisionError, match=r"but is .*nothing was moved"):
        bed.actuator.move(target_mm, 1.0)
    with pytest.raises(FingervisionError, match=r"The speed must be .*nothing was moved"):
        bed.actuator.move(0.0, limits.speed_mm_s * 1.01)
    assert not bed.actuator.busy
    assert bed.actuator.readings()[-1].value == 0.0


def test_a_busy_actuator_refuses_another_motion(bed: Bed) -> None:
    needs_a_motor(bed)
    bed.actuator.move(5.0, 0.5)
    with pytest.raises(FingervisionError, match="is busy: stop it first"):
        bed.actuator.move(0.0, 1.0)


def test_forces_come_in_order_and_within_the_full_scale(bed: Bed) -> None:
    if bed.force_sensor is None:
        pytest.skip("this bed has no force sensor")
    seen = []
    for _ in range(5):
        bed.clock.wait_until(bed.clock.now_s() + 0.05)
        seen += bed.force_sensor.readings()
    assert all(a.device_s < b.device_s for a, b in pairwise(seen))
    assert all(abs(reading.value) <= bed.force_sensor.full_scale_n for reading in seen)


def test_frames_come_in_order_after_their_exposure(bed: Bed) -> None:
    if bed.camera is None:
        pytest.skip("this bed has no camera")
    shots = [bed.camera.next() for _ in range(5)]
    assert [shot.index for shot in shots] == list(range(shots[0].index, shots[0].index + 5))
    assert all(a.device_s < b.device_s and a.arrived_s < b.arrived_s for a, b in pairwise(shots))
    item = shots[-1].item()
    assert item.time_s == shots[-1].device_s
    description = bed.camera.description
    assert item.pixels.shape[:2] == (description.height_px, description.width_px)  # type: ignore[union-attr]


def test_closing_twice_is_allowed(bed: Bed) -> None:
    bed.close()
    bed.close()
