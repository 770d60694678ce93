"""The actuator of the board with the real sketch: requests to the motor controller, their order, and faults."""

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner

from fingervision.cli import cli
from fingervision.domain.board_settings import Role
from fingervision.domain.errors import DeviceError, LimitError, StateError
from fingervision.testbed.actuators.board import BoardActuator
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import open_bed
from tests.testbed.board_bed import written_bed
from tests.testbed.emulated_board import HERTZ, Edge, EmulatedBoard, MotorController

# Time limit that is far longer than every motion in these tests.
SOON_S = 5.0
# Age of a sample when it is read: 5 ms to the next sample, 10 ms between queries, and delays of the line and of a
# loaded host.
MOST_DELAY_S = 0.05
# Steps 1 to 6; step n has code n, homing code 0.
STEPS = """schema = 1
[[step]]
target_mm = 0.0
load_kg = 0.1
speed_mm_s = 50.0
acceleration_mm_s2 = 2000.0
deceleration_mm_s2 = 2000.0
[[step]]
target_mm = 5.0
load_kg = 0.1
speed_mm_s = 50.0
acceleration_mm_s2 = 2000.0
deceleration_mm_s2 = 2000.0
[[step]]
target_mm = 0.5
coordinates = "relative"
load_kg = 0.1
speed_mm_s = 20.0
acceleration_mm_s2 = 2000.0
deceleration_mm_s2 = 2000.0
[[step]]
target_mm = -0.5
coordinates = "relative"
load_kg = 0.1
speed_mm_s = 20.0
acceleration_mm_s2 = 2000.0
deceleration_mm_s2 = 2000.0
[[step]]
target_mm = 9.0
load_kg = 0.1
positioning_time_s = 0.4
[[step]]
target_mm = 10.0
operation = "pushing"
pushing_force_n = 2.0
load_kg = 0.1
positioning_time_s = 1.0
"""


@pytest.fixture
def controller(emulated: EmulatedBoard) -> Iterator[MotorController]:
    """A motor controller whose motions take 50 ms, the step of code 5 0.4 s."""
    controller = MotorController(emulated, lambda code: 0.4 if code == 5 else 0.05)
    yield controller
    controller.close()


@pytest.fixture
def bed_toml(
    emulated: EmulatedBoard, controller: MotorController, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Path:
    """The configuration of a bed with that board; its time is the emulator's."""
    monkeypatch.setattr("fingervision.testbed.bed_factory.HostClock", lambda: emulated.clock)
    return written_bed(tmp_path, emulated.port, STEPS)


@pytest.fixture
def bed(bed_toml: Path) -> Iterator[Bed]:
    """A test bed with the emulated board."""
    bed = open_bed(str(bed_toml))
    yield bed
    bed.close()


def stands(bed: Bed) -> float:
    """Wait for the end of the motion; return the position."""
    until_s = bed.clock.now_s() + SOON_S
    while bed.actuator.busy:
        assert bed.clock.now_s() < until_s
        bed.clock.wait_until(bed.clock.now_s() + 0.01)
    return bed.actuator.readings()[-1].value


def wait_until(bed: Bed, holds: Callable[[], bool]) -> None:
    until_s = bed.clock.now_s() + SOON_S
    while not holds():
        assert bed.clock.now_s() < until_s
        bed.clock.wait_until(bed.clock.now_s() + 0.01)


def test_home_then_absolute_then_relative_steps_as_often_as_needed(bed: Bed, controller: MotorController) -> None:
    bed.actuator.home()
    assert stands(bed) == 0.0
    bed.actuator.move(5.0, 50.0)
    assert stands(bed) == 5.0
    bed.actuator.move(6.5, 50.0)
    assert stands(bed) == 6.5
    bed.actuator.run_step(4)
    assert stands(bed) == 6.0
    assert controller.codes == [0, 2, 3, 3, 3, 4]


def test_positions_follow_the_profile_of_the_step(bed: Bed) -> None:
    bed.actuator.home()
    stands(bed)
    bed.actuator.run_step(5)
    wait_until(bed, lambda: not bed.actuator.busy)
    readings = bed.actuator.readings()
    times = [reading.device_s for reading in readings]
    values = [reading.value for reading in readings]
    assert times == sorted(times)
    assert values == sorted(values)
    # Triangular speed profile: half of the distance at half of the time, an eighth of the distance at a quarter of the
    # time.
    at_half = next(reading for reading in readings if reading.value >= 4.5)
    at_eighth = next(reading for reading in readings if reading.value >= 9.0 / 8.0)
    assert at_half.device_s - at_eighth.device_s == pytest.approx(0.1, abs=0.006)  # readings are 5 ms apart


def test_a_move_that_no_step_makes_is_refused_before_anything_moves(bed: Bed, controller: MotorController) -> None:
    bed.actuator.home()
    stands(bed)
    for move, said in (
        ((1.23, 50.0), "A stored step must end at 1.23 mm, but none does: the absolute steps in the controller end "
         "at 0, 5, 9 mm, and no relative step leads to 1.23 mm. Store an absolute step to 1.23 mm in the controller, "
         "or let the recipe move to one of the stored positions."),
        ((5.0, 10.0), "The move to 5 mm must not be faster than 10 mm/s, but the slowest step that leads there has "
         "20 mm/s: allow this speed, or store a slower step in the controller."),
        ((11.0, 10.0), "The target must lie between 0 and 10 mm, but is 11 mm: nothing was moved."),
        ((5.0, 500.0), "The speed must be at most 400 mm/s, but is 500 mm/s: nothing was moved."),
    ):  # fmt: skip
        with pytest.raises(LimitError) as raised:
            bed.actuator.move(*move)
        assert str(raised.value) == said
    assert controller.codes == [0]


def test_before_homing_only_absolute_steps_lead_anywhere(bed: Bed, controller: MotorController) -> None:
    with pytest.raises(
        StateError, match=r"^The stage's position must be known before the relative step 3, but is unknown"
    ):
        bed.actuator.run_step(3)
    bed.actuator.move(5.0, 50.0)
    assert stands(bed) == 5.0
    bed.actuator.run_step(3)
    assert stands(bed) == 5.5
    assert controller.codes == [2, 3]


def test_a_stop_drops_the_drive_line_and_the_position_is_unknown_until_an_absolute_step(
    bed: Bed, emulated: EmulatedBoard, controller: MotorController
) -> None:
    bed.actuator.home()
    stands(bed)
    bed.actuator.run_step(5)
    wait_until(bed, lambda: controller.codes == [0, 5])
    since = len(emulated.edges)
    bed.actuator.stop()
    emulated.wait_for(lambda edge: edge.level(6) == 0, since=since)
    assert 0.0 <= stands(bed) < 9.0
    assert bed.actuator.alarm is None
    with pytest.raises(StateError, match=r"^The stage's position must be known before the relative step 3"):
        bed.actuator.run_step(3)
    bed.actuator.run_step(2)
    assert stands(bed) == 5.0


def test_force_samples_keep_coming_while_a_stop_is_confirmed(bed: Bed, controller: MotorController) -> None:
    assert bed.force_sensor is not None
    bed.actuator.home()
    stands(bed)
    bed.actuator.run_step(5)
    wait_until(bed, lambda: controller.codes == [0, 5])
    bed.force_sensor.readings()
    began_s = bed.clock.now_s()
    bed.actuator.stop()
    while bed.clock.now_s() < began_s + 0.2:
        # Readings were delayed by 100 ms when the link answered a stop in each of its cycles.
        assert bed.clock.now_s() - bed.force_sensor.readings()[-1].got_s < MOST_DELAY_S
        bed.clock.wait_until(bed.clock.now_s() + 0.01)


def test_an_alarm_stops_the_motion_and_is_cleared_by_homing(
    bed: Bed, emulated: EmulatedBoard, controller: MotorController
) -> None:
    bed.actuator.run_step(5)
    wait_until(bed, lambda: controller.codes == [5])
    emulated.outside(Role.ALARM, True)
    wait_until(bed, lambda: bed.actuator.alarm is not None)
    stands(bed)
    with pytest.raises(DeviceError, match=r"^The actuator must have no alarm, but has alarm"):
        bed.actuator.move(5.0, 50.0)
    with pytest.raises(DeviceError, match=r"^The motor controller must have no alarm, but its alarm line is act"):
        bed.actuator.home()
    emulated.outside(Role.ALARM, False)
    wait_until(bed, lambda: bed.actuator.alarm is not None and bed.actuator.alarm.code == "dropped")
    bed.actuator.home()
    assert stands(bed) == 0.0
    assert bed.actuator.alarm is None


def test_a_controller_that_does_not_answer_is_said(bed: Bed, emulated: EmulatedBoard) -> None:
    emulated.on_edge.clear()
    bed.actuator.run_step(2)
    stands(bed)
    alarm = bed.actuator.alarm
    assert alarm is not None
    assert alarm.words == (
        "A motion was interrupted, because the motor controller has not become busy within 0.5 s: check the wiring, "
        "and home the stage."
    )
    assert emulated.wait_for(lambda edge: edge.level(6) == 0, since=len(emulated.edges) - 1)


def test_force_is_what_the_table_says_of_the_voltage(bed: Bed, emulated: EmulatedBoard) -> None:
    assert bed.force_sensor is not None
    for millivolt, newton in ((500, 0.0), (2500, 2.5), (4900, 5.5)):
        emulated.say(f"adc 0 {millivolt}")
        wait_until(bed, lambda newton=newton: abs(bed.force_sensor.readings()[-1].value - newton) < 0.01)  # type: ignore[misc, union-attr]
    reading = bed.force_sensor.readings()[-1]
    assert reading.asked_s <= reading.got_s
    # One step of 10 bits over 5 V is 6.1 mN with this table. The middle of a step has an error of at most half a step.
    # The emulator counts 1023 steps where the chip counts 1024, which adds one step.
    assert reading.value == pytest.approx(5.5, abs=0.0092)


def test_a_jog_repeats_relative_steps_until_the_limit_of_the_bed(bed_toml: Path, controller: MotorController) -> None:
    bed_toml.write_text(bed_toml.read_text(encoding="utf-8").replace("upper_mm = 9.5", "upper_mm = 4.0"))
    done = CliRunner().invoke(cli, ["bed", "jog", "20", "--home-first", "--bed", str(bed_toml)])
    assert done.exit_code == 0, done
    # The stage is stopped a tenth of a second before 4 mm at 20 mm/s, during the step from 2 mm or, on a loaded
    # computer, during the next step.
    stood_mm = float(done.output.removeprefix("jogged: ").removesuffix(" mm\n"))
    assert 2.0 <= stood_mm <= 3.0
    assert set(controller.codes) == {0, 3}


def test_a_jog_from_an_unknown_position_is_refused(bed_toml: Path, controller: MotorController) -> None:
    done = CliRunner().invoke(cli, ["bed", "jog", "20", "--bed", str(bed_toml)])
    assert str(done.exception).startswith(
        "The stage's position must be known before the relative step 3, but is unknown"
    )
    assert controller.codes == []


def test_too_much_force_stops_a_motion(bed_toml: Path, emulated: EmulatedBoard, controller: MotorController) -> None:
    emulated.say("adc 0 4500")
    done = CliRunner().invoke(cli, ["bed", "move", "9", "--speed-mm-s", "50", "--bed", str(bed_toml)])
    assert str(done.exception).startswith("The force must stay below 3 N, but is 4.99 N: the motor")
    emulated.wait_for(lambda edge: edge.level(6) is None, since=len(emulated.edges) - 1)


def test_ctrl_c_stops_the_motor_before_anything_else(
    bed_toml: Path, emulated: EmulatedBoard, controller: MotorController
) -> None:
    began: list[int] = []

    def press(before: Edge, now: Edge) -> None:
        if now.level(6) == 1 and before.level(6) != 1:
            began.append(now.cycle)
            os.kill(os.getpid(), signal.SIGINT)

    emulated.on_edge.append(press)
    done = CliRunner().invoke(cli, ["bed", "move", "9", "--speed-mm-s", "50", "--bed", str(bed_toml)])
    assert str(done.exception).startswith("Stopped: the motor has stopped near ")
    down = emulated.wait_for(lambda edge: edge.cycle > began[0] and edge.level(6) == 0)
    # The step takes 0.4 s; a message to the board takes some milliseconds.
    assert (down.cycle - began[0]) / HERTZ < 0.2


@pytest.mark.slow
def test_steps_are_run_in_their_sequence_if_the_controller_keeps_these(
    bed_toml: Path, controller: MotorController, tmp_path: Path
) -> None:
    sequence = STEPS.replace("schema = 1", "schema = 1\nsequence = [2, 3, 1]")
    (tmp_path / "sequence.toml").write_text(sequence, encoding="utf-8")
    words = ["bed", "steps", str(tmp_path / "sequence.toml"), "--run", "--bed", str(bed_toml)]
    done = CliRunner().invoke(cli, words)
    assert done.exit_code == 0, done
    assert controller.codes == [0, 2, 3, 1]
    assert done.output.splitlines()[-1] == "step 1: 5.500 to 0.000 mm, at rest at 0.000 mm"
    (tmp_path / "sequence.toml").write_text(sequence.replace("target_mm = 5.0", "target_mm = 5.5"), encoding="utf-8")
    done = CliRunner().invoke(cli, words)
    assert str(done.exception).startswith("Step 2 must be the same as in the motor controller, but ")


def test_one_board_serves_both_parts_and_both_let_go(bed: Bed) -> None:
    assert isinstance(bed.actuator, BoardActuator)
    assert bed.force_sensor is not None
    bed.force_sensor.close()
    bed.actuator.home()  # the board is still connected
    assert stands(bed) == 0.0


def test_a_recipe_that_the_steps_cannot_do_is_refused_before_anything_moves(
    bed_toml: Path, controller: MotorController, tmp_path: Path
) -> None:
    configuration = bed_toml.read_text(encoding="utf-8")
    bed_toml.write_text(configuration + '[camera]\nkind = "simulated"\n[gripper]\n[scale]\npx_per_mm = 34.0\n')
    recipe = tmp_path / "recipe.toml"
    recipe.write_text('schema = 1\nbelow_force_n = 2.0\n[[step]]\nkind = "move"\nto_mm = 0.7\nspeed_mm_s = 50.0\n')
    done = CliRunner().invoke(cli, ["bed", "run", str(recipe), "--bed", str(bed_toml), "--out", str(tmp_path / "run")])
    assert str(done.exception).startswith(
        f"to_mm in line 5 of {recipe} cannot be executed: A stored step must end at 0.7 mm, but "
    )
    assert controller.codes == []
    assert not (tmp_path / "run").exists()
