"""What is Zaber's alone: its stored speed, its refusals, and its emulated device asked by the maker's own library."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from fingervision.domain.errors import DeviceError, FingervisionError
from fingervision.testbed.bed_factory import open_bed
from fingervision.testing import ActuatorContract
from tests.testbed.stages.emulators import Zaber
from tests.testbed.stages.stage_cases import CASES


@pytest.fixture
def device(virtual: None) -> Iterator[Zaber]:
    made = Zaber()
    yield made
    made.close()


def test_a_move_is_speed_then_place_and_closing_gives_back_the_speed(device: Zaber, tmp_path: Path) -> None:
    before = device.maxspeed
    stage = open_bed(str(CASES["zaber"].bed_at(tmp_path, device))).actuator
    stage.move(1.25, 0.5)
    sent = [line.split(maxsplit=3)[3] for line in device.heard if line.endswith(("8192", "12500"))]
    assert sent == ["set maxspeed 8192", "move abs 12500"]
    assert device.maxspeed == 8192
    stage.close()
    stage.close()
    assert stage.name.startswith("Zaber device")
    assert device.heard[-1].endswith(f"set maxspeed {before}")


def test_a_refusal_is_a_sentence_and_an_alarm_until_homed(device: Zaber, tmp_path: Path) -> None:
    device.plant.homed = False
    stage = open_bed(str(CASES["zaber"].bed_at(tmp_path, device))).actuator
    with pytest.raises(DeviceError, match="NOREF"):
        stage.move(1.0, 1.0)
    assert stage.alarm is not None
    stage.home()
    assert stage.alarm is None
    stage.close()


@pytest.mark.parametrize(("declared_mm", "kept"), [(0.0006, True), (0.0, False)])
def test_scatter_of_readings_must_be_declared(declared_mm: float, kept: bool, device: Zaber, tmp_path: Path) -> None:
    device.plant.strays_mm = 0.0003
    path = CASES["zaber"].bed_at(tmp_path, device)
    path.write_text(path.read_text().replace("settling_s", f"repeatability_mm = {declared_mm}\nsettling_s"))
    contract = ActuatorContract.of(open_bed(str(path)))
    if kept:
        contract.test_homing_ends_at_zero()
    else:
        with pytest.raises(AssertionError, match="repeatability_mm"):
            contract.test_homing_ends_at_zero()
    contract._open.close()  # type: ignore[union-attr]


@pytest.mark.parametrize("port", ["127.0.0.1:1", "/dev/nothing"])
def test_a_port_that_is_none_is_said_with_its_line(tmp_path: Path, device: Zaber, port: str) -> None:
    path = CASES["zaber"].bed_at(tmp_path, device)
    path.write_text(path.read_text().replace(device.port, port))
    with pytest.raises(FingervisionError, match=r"port in line 4 "):
        open_bed(str(path))


def test_the_makers_library_understands_the_emulated_device() -> None:
    ascii_protocol = pytest.importorskip("zaber_motion.ascii", reason="zaber-motion is not installed")
    device = Zaber()  # in real time
    host, _, number = device.port.removeprefix("socket://").rpartition(":")
    with ascii_protocol.Connection.open_tcp(host, int(number)) as connection:
        axis = connection.get_device(1).get_axis(1)
        axis.settings.set("maxspeed", 163_840)
        axis.move_absolute(5000)
        assert axis.get_position() == 5000
        assert not axis.is_busy()
    device.close()
