"""Fixtures for tests of the test bed: boards that run the real sketch on an emulated chip."""

from collections.abc import Iterator
from io import StringIO
from pathlib import Path

import pytest

from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.manual import manual_control
from fingervision.testbed.serial_port import opened_port
from tests.one_model_each import one_model_each
from tests.testbed.board_bed import CONTRACT_STEPS, times_of, written_bed
from tests.testbed.emulated_board import EmulatedBoard, MotorController, compiled, missing_tools, running

# Factor by which the emulated board runs slower than real time, so that a loaded computer is fast enough for it.
SLOWER = 3


@pytest.fixture(scope="session", autouse=True)
def _one_model_of_each_gripper() -> Iterator[None]:
    with one_model_each("fingervision.testbed.bed_factory.build_model"):
        yield


@pytest.fixture(scope="session", autouse=True)
def _cameras_are_learnt_in_this_process() -> Iterator[None]:
    """Another process gives the same camera (test_camera_learning.py) and starts in more time than it learns it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fingervision.measuring.camera_learning.in_own_process", lambda work, *given: work(*given))
        yield


@pytest.fixture(scope="session")
def sketch(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The emulator and the compiled sketch."""
    why = missing_tools()
    if why is not None:
        pytest.skip(why)
    return compiled(tmp_path_factory.mktemp("sketch"))


@pytest.fixture
def emulated(sketch: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> Iterator[EmulatedBoard]:
    """A board that was just switched on; its time stops while a byte is being transferred."""
    with running(sketch, SLOWER) as board:
        opened = "fingervision.testbed.board.board.opened_port"
        monkeypatch.setattr(opened, lambda *how: board.shared.counted(opened_port(*how)))
        yield board


@pytest.fixture
def homed_board_bed(emulated: EmulatedBoard, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bed]:
    """A test bed with an emulated board whose stage is at its reference; the test closes the bed."""
    monkeypatch.setattr("fingervision.testbed.bed_factory.HostClock", lambda: emulated.clock)
    bed_toml = written_bed(tmp_path, emulated.port, CONTRACT_STEPS, lower_mm=-1.0)
    controller = MotorController(emulated, times_of(tmp_path / "steps.toml"))
    bed = open_bed(str(bed_toml))
    manual_control.home(bed)
    yield bed
    controller.close()


@pytest.fixture
def hand_screw_bed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bed:
    """A test bed with a hand screw and a simulated user who always turns it to the requested position."""
    (tmp_path / "bed.toml").write_text('schema = 1\n[actuator]\nkind = "hand_screw"\nlower_mm = -1.0\nupper_mm = 6.0\n')
    monkeypatch.setattr("sys.stdin", StringIO("\n" * 100))
    return open_bed(str(tmp_path / "bed.toml"))
