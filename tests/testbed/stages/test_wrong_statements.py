"""A stage that is not what its test bed's file states: wrong units, words, reference or device, and late answers."""

import re
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from fingervision.domain.errors import DeviceError
from fingervision.storage.recipe_toml import read_recipe
from fingervision.testbed.actuator import StageLimits
from fingervision.testbed.actuators._single_axis import AxisSettings
from fingervision.testbed.actuators.epics_motor import MotorRecord
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.clocks.clock import VirtualClock
from fingervision.testbed.manual import manual_control
from fingervision.testbed.run.recipe_run import run_recipe
from fingervision.testbed.text_protocol.line import Line
from fingervision.testbed.text_protocol.words import Exchange, Words, number_in
from tests.testbed.simulated_beds import recipe_at, steps
from tests.testbed.stages.emulators import Emulator, Invented, Kinesis, Zaber
from tests.testbed.stages.stage_cases import CAMERA, CASES
from tests.testbed.stages.test_words import EXAMPLE, bed_with


@pytest.fixture
def device(virtual: None) -> Iterator[Invented]:
    made = Invented()
    yield made
    made.close()


def opened(words: str, device: Emulator, folder: Path) -> Bed:
    return open_bed(str(bed_with(words, device, folder)))


@pytest.mark.parametrize(
    ("mistake", "right"),
    [("speed_per_mm_s = 60000", "speed_per_mm_s = 1000"), ("per_mm = 1 ", "per_mm = 1000 ")],
)
def test_a_stage_faster_than_its_speed_has_other_units(
    mistake: str, right: str, device: Invented, tmp_path: Path
) -> None:
    """A speed in mm/min for one in mm/s, and a position in micrometres that was taken for one in millimetres."""
    bed = opened(EXAMPLE.replace(right, mistake), device, tmp_path)
    manual_control.home(bed)
    with pytest.raises(DeviceError, match=r"told 0\.5 mm/s, but went 1 mm .*units"):
        manual_control.move(bed, 1.0, 0.5)
    with pytest.raises(DeviceError, match="Nothing was moved"):
        bed.actuator.move(0.0, 0.5)
    bed.close()


@pytest.mark.parametrize("ahead_s", [0.0, 0.1])
def test_a_position_that_is_refreshed_ten_times_in_a_second_is_no_other_speed(
    ahead_s: float, device: Invented, tmp_path: Path
) -> None:
    """As with the motor record that caproto simulates: a step of a tenth of a second is stated in one jump."""
    bed = opened(EXAMPLE, device, tmp_path)
    manual_control.home(bed)
    device.refreshed_s, device.ahead_s = 0.1, ahead_s
    for k in range(9):
        manual_control.move(bed, 0.05 * (k + 1), 0.5)
        assert bed.actuator.alarm is None
        # The begins of the motions fall on all phases of the interval.
        bed.clock.wait_until(bed.clock.now_s() + 0.311)
        assert bed.actuator.readings()[-1].value == pytest.approx(0.05 * (k + 1), abs=0.001)
    bed.close()


def test_a_stage_that_states_its_target_as_its_position_is_noticed(device: Invented, tmp_path: Path) -> None:
    bed = opened(EXAMPLE, device, tmp_path)
    manual_control.home(bed)
    device.refreshed_s, device.ahead_s = 0.001, 1e3
    with pytest.raises(DeviceError, match=r"told 0\.5 mm/s, but went 1 mm .*states its target"):
        manual_control.move(bed, 1.0, 0.5)
    bed.close()


@pytest.mark.parametrize("ratio", [25.4, 0.1, 1.0])
def test_units_that_command_and_report_alike_are_told_by_the_picture(
    ratio: float, device: Invented, tmp_path: Path
) -> None:
    words, camera = EXAMPLE, CAMERA.replace("still_camera", "true_camera").replace("rate_hz = 100.0", "rate_hz = 25.0")
    for key in ("per_mm = 1000", "mm_s = 1000"):
        words = words.replace(key, key.replace("1000", f"{1000 * ratio:g}"))
    path = bed_with(words, device, tmp_path)
    path.write_text(path.read_text(encoding="utf-8") + camera, encoding="utf-8")
    recipe, said = recipe_at(tmp_path, steps('kind = "move"\nto_mm = 0.4\nspeed_mm_s = 0.4')), list[str]()
    bed = open_bed(str(path))
    try:
        run_recipe(read_recipe(recipe), bed, tmp_path / "run", say=said.append)
        assert device.plant.at() == pytest.approx(0.4 * ratio)
    except DeviceError as error:
        said.append(str(error))
        # Less than half of the way was gone.
        assert device.plant.at() < 0.2 * ratio
    bed.close()
    asked = [float(found[1]) for found in map(re.compile(r"the gap moved (\S+) times").search, said) if found]
    assert asked == ([] if ratio == 1.0 else [pytest.approx(ratio, rel=0.1)])
    assert not device.plant.moves


def test_a_word_for_motion_that_never_comes_is_no_rest(device: Invented, tmp_path: Path) -> None:
    bed = opened(EXAMPLE.replace("MOVE|HOME", "RUNNING"), device, tmp_path)
    device.plant.go(0.7)
    bed.clock.wait_until(bed.clock.now_s() + 1.0)
    assert manual_control.home(bed) == pytest.approx(0.0, abs=1e-6)
    assert manual_control.move(bed, 0.5, 1.0) == pytest.approx(0.5, abs=1e-6)
    assert device.plant.at() == pytest.approx(0.5, abs=1e-6)
    bed.close()


def test_a_controller_without_a_word_for_motion_is_stopped_when_it_is_opened(device: Invented, tmp_path: Path) -> None:
    before, busy, after = EXAMPLE.partition("[busy]")
    device.plant.go(5.0)
    bed = opened(before + after[after.index("[move]") :], device, tmp_path)
    assert busy
    assert not device.plant.moves
    bed.close()


def test_beyond_its_range_a_stage_only_homes(device: Invented, tmp_path: Path) -> None:
    device.plant.stands_at(20.0)
    bed = opened(EXAMPLE, device, tmp_path)
    with pytest.raises(DeviceError, match=r"range of -2 to 8 mm .* stands at 20 mm: home it"):
        bed.actuator.move(0.5, 1.0)
    assert device.plant.at() == pytest.approx(20.0)
    assert manual_control.home(bed) == pytest.approx(0.0, abs=1e-6)
    bed.close()


def test_a_stage_that_has_not_found_its_reference_only_homes(virtual: None, tmp_path: Path) -> None:
    device = Kinesis()
    device.plant.homed = False
    bed = open_bed(str(CASES["kinesis"].bed_at(tmp_path, device)))
    with pytest.raises(DeviceError, match=r"reference .* home it"):
        bed.actuator.move(0.5, 1.0)
    manual_control.home(bed)
    assert manual_control.move(bed, 0.5, 1.0) == pytest.approx(0.5, abs=0.002)
    bed.close()
    device.close()


@pytest.mark.parametrize(("kind", "make"), [("zaber", Zaber), ("kinesis", Kinesis)])
def test_another_device_of_the_same_kind_is_another_test_bed(
    kind: str, make: type[Zaber] | type[Kinesis], virtual: None, tmp_path: Path
) -> None:
    """The name is a part of what a run remembers of its test bed, so that another device does not continue it."""
    device, names = make(), list[str]()
    for device.serial in (1234, 1234, 1235):  # type: ignore[misc]
        bed = open_bed(str(CASES[kind].bed_at(tmp_path, device)))
        names.append(bed.about["actuator"])
        bed.close()
    assert names[0] == names[1] != names[2]
    device.close()


def test_a_record_that_limits_its_speed_is_not_moved() -> None:
    held = {"LLM": 0.0, "HLM": 0.0, "SPMG": 3.0, "VELO": 1.0, "VAL": 0.0, "RBV": 0.0, "DMOV": 1.0}

    class Field:
        def __init__(self, name: str) -> None:
            self.name = name

        def read(self, timeout: float) -> SimpleNamespace:
            return SimpleNamespace(data=[held[self.name]])

        def write(self, values: list[float], wait: bool, timeout: float) -> None:
            held[self.name] = min(values[0], 2.0) if self.name == "VELO" else values[0]

    fields, settings = {name: Field(name) for name in held}, AxisSettings(StageLimits(0.0, 5.0, 5.0, 1e9))
    stage = MotorRecord(None, fields, "X:m1", "", 1.0, VirtualClock(begin_s=1.0), settings)
    with pytest.raises(DeviceError, match=r"at most 2 mm/s \(VMAX\)"):
        stage.move(1.0, 3.0)
    assert held["VAL"] == 0.0
    stage.move(1.0, 2.0)
    assert held["VAL"] == 1.0


class LatePort:
    """Answers the first question only after the second was asked, and then both."""

    rest = b""

    def __init__(self) -> None:
        self.asked, self.answers = 0, list[bytes]()

    def write(self, data: bytes) -> None:
        self.asked += 1
        if self.asked > 1:
            self.answers += [b"%d\n" % number for number in ((1, 2) if self.asked == 2 else (self.asked,))]

    def line(self, end: bytes, within_s: float) -> bytes:
        # Each answer is on its way a moment longer than a look without waiting.
        return self.answers.pop(0) if within_s and self.answers else b""

    def close(self) -> None:
        """Nothing is open."""


def test_a_late_answer_is_not_taken_for_that_to_the_next_question() -> None:
    question = Exchange(("POS?",), "\n", re.compile(r"(\d+)"), None, 0.01)
    line = Line(LatePort(), Words("late", 9600, {}, "\n", 0.0, None, {}, (), {}))
    line.ask(question)
    assert number_in(line.ask(question), "late") == 3.0


def test_an_answer_without_the_stated_end_of_a_line_is_told(device: Invented, tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match=r"INVENTED STAGE 1\.0\\n.* '\\r'"):
        opened(EXAMPLE.replace('answer_end = "\\n"', 'answer_end = "\\r"'), device, tmp_path)


def test_a_refusal_says_what_was_said_and_answered(device: Invented, tmp_path: Path) -> None:
    with pytest.raises(DeviceError, match=r"'ERR unknown command' to '1PLACE\?'"):
        opened(EXAMPLE.replace("POS?", "PLACE?"), device, tmp_path)
