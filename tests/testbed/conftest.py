"""Boards for the tests of the bed: the real sketch, emulated."""

from collections.abc import Iterator
from io import StringIO
from pathlib import Path

import pytest

from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.board.port import opened_port
from fingervision.testbed.manual import manual_control
from tests.testbed.board_bed import CONTRACT_STEPS, times_of, written_bed
from tests.testbed.emulated_board import EmulatedBoard, MotorController, compiled, missing_tools, running

# In slow motion, so that a loaded machine is fast enough for the emulated board.
SLOWER = 3


@pytest.fixture(scope="session")
def sketch(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The emulator and the compiled sketch."""
    why = missing_tools()
    if why is not None:
        pytest.skip(why)
    return compiled(tmp_path_factory.mktemp("sketch"))


@pytest.fixture
def emulated(sketch: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> Iterator[EmulatedBoard]:
    """A board that was just switched on; its time stands while a byte is under way."""
    with running(sketch, SLOWER) as board:
        opened = "fingervision.testbed.board.board.opened_port"
        monkeypatch.setattr(opened, lambda name: board.shared.counted(opened_port(name)))
        yield board


@pytest.fixture
def homed_board_bed(emulated: EmulatedBoard, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bed]:
    """A bed whose motor controller behind the board stands at its reference; who uses it closes it."""
    monkeypatch.setattr("fingervision.testbed.bed_factory.HostClock", lambda: emulated.clock)
    bed_toml = written_bed(tmp_path, emulated.port, CONTRACT_STEPS, lower_mm=-1.0)
    controller = MotorController(emulated, times_of(tmp_path / "steps.toml"))
    bed = open_bed(str(bed_toml))
    manual_control.home(bed)
    yield bed
    controller.close()


@pytest.fixture
def hand_screw_bed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bed:
    """A bed with a hand screw and somebody who always turns it to where it is wanted."""
    (tmp_path / "bed.toml").write_text('schema = 1\n[actuator]\nkind = "hand_screw"\nlower_mm = -1.0\nupper_mm = 6.0\n')
    monkeypatch.setattr("sys.stdin", StringIO("\n" * 100))
    return open_bed(str(tmp_path / "bed.toml"))
