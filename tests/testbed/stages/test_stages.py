"""Every kind of real stage: the contract, a recipe, a stop in motion, faults of the line, kill -9 and resumption.

Where the emulator is ours, test bed and emulator share a virtual clock, so that these tests neither wait nor depend on
the load of the computer. What others emulate moves in real time; those tests are slow ones.
"""

import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from fingervision.domain.errors import DeviceError, FingervisionError
from fingervision.storage.drive_csv import read_samples
from fingervision.storage.recorded_video import frames_in
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.device_kinds import kinds
from fingervision.testbed.manual import manual_control
from fingervision.testing import ActuatorContract, checks_of
from fingervision.testing import run as failures
from tests.testbed.stages.emulators import virtual_time
from tests.testbed.stages.recipe_process import run, started
from tests.testbed.stages.stage_cases import CAMERA, CASES, Case

# pyserial does not close the socket of a `socket://` port whose other end has closed it.
pytestmark = pytest.mark.filterwarnings("ignore:Exception ignored in. <socket:pytest.PytestUnraisableExceptionWarning")
# The computer may be loaded by other tests.
PATIENCE_S = 240.0
# Two rows a motion and more at each point: 15 and more frames, and 330 and more.
RECIPE = """
schema = 1
[[step]]
kind = "triangle"
from_mm = 0.0
to_mm = 0.03
speed_mm_s = 0.5
[[step]]
kind = "staircase"
from_mm = 0.0
to_mm = 0.45
steps = {steps}
dwell_s = 0.0
speed_mm_s = 0.5
frames = {frames}
"""
FEW, MANY = RECIPE.format(steps=2, frames=4), RECIPE.format(steps=9, frames=33)


@pytest.fixture(params=[pytest.param(name, marks=() if CASES[name].virtual else pytest.mark.slow) for name in CASES])
def case(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Case:
    found = CASES[request.param]
    if found.library:
        pytest.importorskip(found.library, reason=f"{found.library} is not installed")
    monkeypatch.setenv("OPHYD_CONTROL_LAYER", "caproto")
    # The emulators are ready at once, unlike a board that restarts when its port is opened.
    monkeypatch.setattr("fingervision.testbed.text_protocol.line.sleep", lambda seconds: None)
    # pyserial's socket sleeps when it is closed.
    monkeypatch.setattr("serial.urlhandler.protocol_socket.time", SimpleNamespace(sleep=lambda seconds: None))
    return found


@pytest.fixture
def device(case: Case) -> Iterator[Any]:
    made = case.make()
    yield made
    made.close()


@pytest.fixture
def virtual(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    if case.virtual:
        virtual_time(monkeypatch, wires=case.wired)


@pytest.fixture
def bed(case: Case, device: Any, virtual: None, tmp_path: Path) -> Iterator[Bed]:
    opened = open_bed(str(case.bed_at(tmp_path, device)))
    manual_control.home(opened)
    yield opened
    opened.close()


def has_a_cable(device: Any) -> None:
    if not hasattr(device, "unplug"):
        pytest.skip("this stage is in the program itself")


def test_every_kind_that_drives_a_motor_is_tested_here() -> None:
    tested = {case.lines.split('"')[1] for case in CASES.values()}
    # The simulated stage, the board and the hand screw have tests of their own.
    assert {*kinds("actuator")} - tested == {"simulated", "board", "hand_screw"}


def test_the_stage_keeps_the_contract(case: Case, device: Any, virtual: None, tmp_path: Path) -> None:
    path = str(case.bed_at(tmp_path, device))
    first = open_bed(path)
    manual_control.home(first)
    first.close()
    assert "test_homing_ends_at_zero" in checks_of(ActuatorContract)
    assert failures(ActuatorContract, open_bed=lambda: open_bed(path)) == {}


def test_a_stop_in_motion_stops_the_stage_while_it_is_asked(bed: Bed) -> None:
    bed.actuator.move(5.0, min(2.0, bed.actuator.limits.speed_mm_s))
    assert bed.actuator.busy  # and the device has heard it before any virtual time passes
    stopped, answers = threading.Event(), list[float]()

    def ask() -> None:
        while not stopped.is_set():
            answers.append(bed.actuator.readings()[-1].value)

    asking = threading.Thread(target=ask)
    asking.start()
    wait(bed, 0.15)
    asked = len(answers)
    when(lambda: len(answers) > asked + 1)
    bed.actuator.stop()
    stopped.set()
    asking.join()
    until_s = bed.clock.now_s() + 1.0
    while bed.actuator.busy and bed.clock.now_s() < until_s:
        wait(bed, 0.01)
    at_mm = bed.actuator.readings()[-1].value
    assert 0.0 < at_mm < 3.0
    wait(bed, 0.15)
    assert bed.actuator.readings()[-1].value == pytest.approx(at_mm, abs=0.002)
    assert bed.actuator.alarm is None
    bed.actuator.move(at_mm + 0.02, 0.5)  # the next motion is accepted


def test_an_unplugged_stage_is_a_sentence_and_works_when_it_is_back(
    case: Case, device: Any, bed: Bed, tmp_path: Path
) -> None:
    has_a_cable(device)
    bed.actuator.move(1.0, 1.0)
    device.unplug()
    with pytest.raises(DeviceError, match=r"must .*(cable|emergency stop)"):
        when(lambda: not bed.actuator.busy)
    with suppress(FingervisionError):
        bed.actuator.stop()  # says that the stage may still move
    bed.close()
    with pytest.raises(FingervisionError, match=r"must .* but "):
        open_bed(str(case.bed_at(tmp_path, device)))
    device.plug()
    again = open_bed(str(case.bed_at(tmp_path, device)))
    assert manual_control.home(again) == pytest.approx(0.0, abs=0.002)
    again.close()


@pytest.mark.parametrize("fault", ["nonsense", "silent"])
def test_nonsense_and_silence_are_sentences_and_leave_the_stage_at_rest(
    case: Case, device: Any, bed: Bed, fault: str, tmp_path: Path
) -> None:
    if not hasattr(device, fault) or not case.wired:
        pytest.skip("what is emulated is not ours and has no such fault, or would be waited for")
    bed.actuator.move(2.0, 1.0)
    wait(bed, 0.1)
    setattr(device, fault, True)
    with pytest.raises(DeviceError, match=r"must .* but "):
        bed.actuator.readings()
    bed.close()  # the stop needs no answer
    wait(bed, 0.05)
    if hasattr(device, "plant"):
        assert not device.plant.moves
        assert device.plant.at() < 1.0
    with pytest.raises(FingervisionError, match=r"must .* but "):
        open_bed(str(case.bed_at(tmp_path, device)))
    setattr(device, fault, False)
    again = open_bed(str(case.bed_at(tmp_path, device)))
    assert again.actuator.readings()[-1].value < 1.0
    assert manual_control.home(again) == pytest.approx(0.0, abs=0.002)
    again.close()


def test_lost_steps_are_an_alarm_until_the_stage_is_homed(device: Any, bed: Bed) -> None:
    if not hasattr(device, "plant"):
        pytest.skip("what is emulated is not ours, and loses no steps")
    device.plant.lost_mm = -0.05
    with pytest.raises(DeviceError, match=r"sent to 0\.3 mm and rests at 0\.25 mm"):
        manual_control.move(bed, 0.3, 2.0)
    device.plant.lost_mm = 0.0
    with pytest.raises(DeviceError, match="Nothing was moved"):
        bed.actuator.move(0.0, 1.0)
    assert manual_control.home(bed) == pytest.approx(0.0, abs=0.002)
    assert bed.actuator.alarm is None


def test_a_recipe_loses_nothing_when_the_cable_is_pulled(
    case: Case, device: Any, virtual: None, tmp_path: Path
) -> None:
    has_a_cable(device)
    (tmp_path / "recipe.toml").write_text(FEW, encoding="utf-8")
    path, out = case.bed_at(tmp_path, device, CAMERA.replace("rate_hz = 100", "rate_hz = 25")), tmp_path / "run"
    unplugged_and_back(device, path, out, after=8)
    assert_complete(out, at_least=15)


@pytest.mark.slow
def test_three_hundred_frames_through_kill_9_and_a_pulled_cable(
    case: Case, device: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "recipe.toml").write_text(MANY, encoding="utf-8")
    path, out = case.bed_at(tmp_path, device, CAMERA), tmp_path / "run"
    process = started(tmp_path / "recipe.toml", path, out)
    when(lambda: frames_in(out / "video.mp4") > 30 or process.exitcode is not None)
    assert process.exitcode is None
    process.kill()
    process.join()
    before, in_video = (out / "samples.csv").read_bytes(), frames_in(out / "video.mp4")
    rows = len(read_samples(out / "samples.csv"))
    assert in_video - rows <= 100  # a second
    if case.virtual:
        virtual_time(monkeypatch, wires=False)
    if hasattr(device, "unplug"):
        resumed_after = unplugged_and_back(device, path, out, after=100)
        assert resumed_after >= 100
    else:
        assert run(tmp_path / "recipe.toml", path, out).resumed_after == min(rows, in_video)
    whole = before[: before.rfind(b"\n") + 1].splitlines(keepends=True)[: min(rows, in_video) + 1]
    assert (out / "samples.csv").read_bytes().startswith(b"".join(whole))
    assert_complete(out, at_least=330)


def unplugged_and_back(device: Any, path: Path, out: Path, after: int) -> int:
    """Run the recipe beside a test bed, pull its cable after some rows, plug it in, and go on after the same bytes."""
    recipe = path.parent / "recipe.toml"
    with pytest.raises(FingervisionError, match=r"cable|emergency stop"):
        run(recipe, path, out, lambda row: device.unplug() if row == after else None)
    before, rows = (out / "samples.csv").read_bytes(), read_samples(out / "samples.csv")
    assert len(rows) == frames_in(out / "video.mp4")
    device.plug()
    assert run(recipe, path, out).resumed_after == len(rows)
    assert (out / "samples.csv").read_bytes().startswith(before)
    return len(rows)


def assert_complete(out: Path, at_least: int) -> None:
    rows = read_samples(out / "samples.csv")
    assert len(rows) == frames_in(out / "video.mp4") >= at_least
    assert [row.frame for row in rows] == list(range(len(rows)))
    assert max(row.input_mm for row in rows if row.input_mm is not None) == pytest.approx(0.45, abs=0.005)
    assert json.loads((out / "run.json").read_text())["complete"]


def wait(bed: Bed, seconds: float) -> None:
    bed.clock.wait_until(bed.clock.now_s() + seconds)


def when(ready: Callable[[], bool]) -> None:
    until_s = time.monotonic() + PATIENCE_S
    while not ready() and time.monotonic() < until_s:
        time.sleep(0.02)
