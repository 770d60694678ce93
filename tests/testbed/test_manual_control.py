"""Single motions on the simulated test bed: limits, monitoring and stop, and the commands that request them."""

import signal
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from fingervision.cli import cli
from fingervision.domain.errors import DeviceError, LimitError
from fingervision.domain.frame import Frame
from fingervision.domain.status import Status
from fingervision.testbed.actuator import Alarm
from fingervision.testbed.actuators.simulated import SimulatedActuator
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.cameras.simulated import SimulatedCamera
from fingervision.testbed.manual import manual_control
from fingervision.vision.pipeline import Settings, measure_frame


@pytest.fixture
def bed() -> Iterator[Bed]:
    bed = open_bed("simulated")
    yield bed
    bed.close()


def close_enough_mm(bed: Bed) -> float:
    return bed.actuator.limits.accuracy_mm + bed.actuator.limits.encoder_step_mm


def test_a_move_ends_where_it_shall_and_homing_at_zero(bed: Bed) -> None:
    assert manual_control.move(bed, 1.2, 5.0) == pytest.approx(1.2, abs=close_enough_mm(bed))
    assert manual_control.home(bed) == pytest.approx(0.0, abs=1e-6)


def test_a_jog_ends_after_its_time_or_at_the_limit_of_the_bed(bed: Bed) -> None:
    late_mm = 0.5 * manual_control.LOOK_EVERY_S
    assert manual_control.jog(bed, 0.5, for_s=1.0) == pytest.approx(0.5, abs=late_mm + close_enough_mm(bed))
    assert manual_control.jog(bed, -0.5) == pytest.approx(bed.limits.lower_mm, abs=close_enough_mm(bed))


@pytest.mark.parametrize(
    ("to_mm", "speed_mm_s", "said"),
    [
        (2.0, 1.0, "The target must lie between -0.46 and 1.45 mm, but is 2 mm: "
         "nothing was moved."),
        (float("nan"), 1.0, "The target must lie between -0.46 and 1.45 mm, but is nan mm: nothing was moved."),
        (1.0, 500.0, "The speed must be at most 400 mm/s, but is 500 mm/s: nothing was moved."),
        (1.0, 0.0, "The speed must be positive, but is 0 mm/s: nothing was moved."),
    ],
)  # fmt: skip
def test_beyond_a_limit_nothing_moves(bed: Bed, to_mm: float, speed_mm_s: float, said: str) -> None:
    with pytest.raises(LimitError) as raised:
        manual_control.move(bed, to_mm, speed_mm_s)
    assert str(raised.value) == said
    assert not bed.actuator.busy
    assert bed.actuator.readings()[-1].value == 0.0


def test_an_alarm_in_the_middle_stops_and_is_said(bed: Bed, monkeypatch: pytest.MonkeyPatch) -> None:
    actuator = bed.actuator
    assert isinstance(actuator, SimulatedActuator)
    wait_until = bed.clock.wait_until

    def fail_later(time_s: float) -> None:
        wait_until(time_s)
        if bed.clock.now_s() > 0.3:
            actuator.raise_alarm(Alarm("E-42", "the motor is hot"))

    monkeypatch.setattr(bed.clock, "wait_until", fail_later)
    with pytest.raises(DeviceError) as raised:
        manual_control.move(bed, 1.0, 1.0)
    assert str(raised.value) == "The actuator has an alarm (E-42: the motor is hot): the motor was stopped."
    assert actuator.readings()[-1].value < 0.5


def test_the_commands_say_where_it_stands() -> None:
    for words, begins in (
        (["home"], "homed: 0.000 mm"),
        (["move", "-0.3", "--speed-mm-s", "2"], "moved: -0."),
        (["jog", "1", "--for-s", "0.2"], "jogged: 0."),
        (["stop"], "The simulated test bed is at rest: "),
    ):
        done = CliRunner().invoke(cli, ["bed", *words])
        assert done.exit_code == 0, done
        assert done.output.startswith(begins)


CLOSED = """
schema = 1
[actuator]
kind = "simulated"
[camera]
kind = "simulated"
[gripper]
[scale]
px_per_mm = 34.0
[limits]
gap_mm = 0.3
"""


@pytest.fixture
def narrow(tmp_path: Path) -> Iterator[Bed]:
    (tmp_path / "bed.toml").write_text(CLOSED, encoding="utf-8")
    bed = open_bed(str(tmp_path / "bed.toml"))
    yield bed
    bed.close()


def test_a_target_at_which_the_gripper_would_close_too_far_is_not_approached(narrow: Bed) -> None:
    with pytest.raises(LimitError, match=r"limit of gap, 0\.3 mm, but leads to -[\d.]+ mm by its \[gripper\]: nothing"):
        manual_control.move(narrow, -1.8, 5.0)
    assert narrow.actuator.readings()[-1].value == pytest.approx(0.0, abs=1e-6)


def test_a_jog_ends_where_the_gap_reaches_its_limit_and_leads_back_from_beyond(narrow: Bed) -> None:
    assert narrow.model is not None
    at_mm = manual_control.jog(narrow, -0.5)
    late_mm = 0.5 * 2.0 * manual_control.LOOK_EVERY_S
    gaps_mm = narrow.model.respond(np.array([at_mm, at_mm + late_mm + close_enough_mm(narrow)])).gap_mm
    assert gaps_mm[0] - 1e-9 <= narrow.limits.gap_mm <= gaps_mm[1]
    assert manual_control.jog(narrow, 0.5, for_s=0.4) > at_mm


def test_fingers_that_meet_do_not_pass_through_each_other(narrow: Bed) -> None:
    assert narrow.camera is not None
    narrow.actuator.move(-1.8, 5.0)
    narrow.clock.wait_until(narrow.clock.now_s() + 1.0)
    item = narrow.camera.next().item()
    assert isinstance(item, Frame)
    assert measure_frame(item, Settings(0.3 * 34.0)).status is not Status.OK


def test_a_frame_that_the_camera_announced_is_not_lost_if_it_is_fetched_late(narrow: Bed) -> None:
    camera = narrow.camera
    assert isinstance(camera, SimulatedCamera)
    first = camera.next()
    assert camera.ready(1.0)
    narrow.clock.wait_until(narrow.clock.now_s() + 0.01)
    assert camera.next().device_s == pytest.approx(first.device_s + 0.04)


def test_a_stop_that_fails_is_not_taken_for_a_spoilt_answer() -> None:
    def stop() -> None:
        raise DeviceError("The stage must stop, but could not be told to.")

    def asked_again() -> None:
        with suppress(DeviceError):
            signal.raise_signal(signal.SIGINT)
        pytest.fail("The motion went on.")

    with manual_control.motor_stops_first(stop), pytest.raises(manual_control.Interrupted) as end:
        asked_again()
    assert isinstance(end.value.__cause__, DeviceError)
