"""A Zaber axis driven by the maker's library, on an emulated device in the network."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("zaber_motion", reason="the extra `zaber` is not installed")

from zaber_motion.ascii import Connection

import fingervision as fv
from fingervision.testbed.actuator import StageLimits
from fingervision.testbed.actuators._single_axis import AxisSettings
from fingervision.testbed.actuators.zaber import ZaberStage
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.clocks.clock import HostClock
from fingervision.testbed.motion.soft_limits import SoftLimits
from fingervision.testbed.operators.operator_kinds import AtTheBed
from fingervision.testing import ActuatorContract, NotApplicable, checks_of
from tests.adapters.zaber_device import SPEED_UNIT, ZaberDevice

MICROSTEP_MM = 0.0001
STRAYS_MM, ERROR_MM, RAMP_S = 0.0003, 0.0005, 0.03
LIMITS = StageLimits(
    -2.0, 8.0, 5.0, 10.0, accuracy_mm=ERROR_MM, encoder_step_mm=MICROSTEP_MM, repeatability_mm=2.0 * STRAYS_MM,
    settling_s=RAMP_S + 0.02,
)  # fmt: skip


@pytest.fixture
def device() -> Iterator[ZaberDevice]:
    made = ZaberDevice(MICROSTEP_MM)
    yield made
    made.close()


def stage(device: ZaberDevice, limits: StageLimits = LIMITS) -> ZaberStage:
    host, _, port = device.port.rpartition(":")
    connection = Connection.open_tcp(host, int(port))
    return ZaberStage(connection, connection.get_device(1).get_axis(1), MICROSTEP_MM, HostClock(), AxisSettings(limits))


def bed_of(device: ZaberDevice, limits: StageLimits = LIMITS) -> Bed:
    return Bed(HostClock(), stage(device, limits), SoftLimits(-2.0, 8.0, 5.0, 10.0), AtTheBed())


def test_a_move_is_speed_then_place_in_the_units_of_the_device(device: ZaberDevice) -> None:
    opened = stage(device)
    device.heard.clear()
    opened.move(1.25, 0.5)
    assert [each for each in device.heard if each.startswith(("set", "move"))] == [
        f"set maxspeed {round(0.5 / MICROSTEP_MM * SPEED_UNIT)}",
        f"move abs {round(1.25 / MICROSTEP_MM)}",
    ]
    (reading,) = opened.readings()
    assert reading.moving
    assert 0.0 <= reading.value < 1.25
    assert reading.asked_s <= reading.device_s <= reading.got_s
    opened.stop()
    opened.close()


def test_closing_gives_back_the_highest_speed(device: ZaberDevice) -> None:
    before = device.maxspeed
    opened = stage(device)
    opened.move(0.01, 0.5)
    assert device.maxspeed != before
    opened.close()
    opened.close()
    assert device.maxspeed == before


def test_a_refusal_of_the_device_is_a_sentence_and_an_alarm(device: ZaberDevice) -> None:
    device.is_homed = False
    opened = stage(device)
    with pytest.raises(fv.DeviceError, match="NOREF"):
        opened.move(1.0, 1.0)
    assert opened.alarm is not None
    assert opened.alarm.code == "NOREF"
    opened.home()
    assert opened.alarm is None
    opened.close()


@pytest.mark.slow
def test_the_emulated_stage_keeps_the_contract() -> None:
    """The emulated stage has ramps, scatter of readings and positioning errors, as it declares them."""
    failed = {}
    for check in checks_of(ActuatorContract):
        device = ZaberDevice(MICROSTEP_MM, RAMP_S, STRAYS_MM, ERROR_MM)
        bed = bed_of(device)
        try:
            with suppress(NotApplicable):
                getattr(ActuatorContract.of(bed), check)()
        except AssertionError as error:
            failed[check] = str(error)
        finally:
            bed.close()
            device.close()
    assert failed == {}


def test_a_stage_that_declares_too_little_is_told_what_to_state() -> None:
    """Scatter of 0.3 um passes if the stage declares it, and fails if the stage does not."""
    device = ZaberDevice(MICROSTEP_MM, RAMP_S, 20.0 * STRAYS_MM, ERROR_MM)
    bed = bed_of(device, replace(LIMITS, repeatability_mm=0.0))
    try:
        with pytest.raises(AssertionError, match="repeatability_mm"):
            ActuatorContract.of(bed).test_homing_ends_at_zero()
    finally:
        bed.close()
        device.close()


def test_a_bed_file_opens_it(tmp_path: Path, device: ZaberDevice) -> None:
    path = tmp_path / "bed.toml"
    keys = f'kind = "zaber"\nport = "{device.port}"\nmicrostep_mm = {MICROSTEP_MM}\nlower_mm = 0\nupper_mm = 5\n'
    path.write_text(f"schema = 1\n[actuator]\n{keys}speed_mm_s = 1\nrepeatability_mm = 0.002\n", encoding="utf-8")
    bed = open_bed(str(path))
    assert bed.actuator.limits.repeatability_mm == 0.002
    bed.close()


@pytest.mark.parametrize("port", ["127.0.0.1:1", "/dev/nothing"])
def test_a_port_that_is_none_is_said_with_its_line(tmp_path: Path, port: str) -> None:
    path = tmp_path / "bed.toml"
    keys = f'kind = "zaber"\nport = "{port}"\nmicrostep_mm = 0.0001\nlower_mm = 0\nupper_mm = 5\nspeed_mm_s = 1\n'
    path.write_text(f"schema = 1\n[actuator]\n{keys}", encoding="utf-8")
    with pytest.raises(fv.FingervisionError, match=r"port in line 4 "):
        open_bed(str(path))
