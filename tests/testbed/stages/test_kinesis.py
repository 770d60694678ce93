"""The messages of Thorlabs controllers, compared with an independent library."""

from pathlib import Path

import pytest

from fingervision.domain.errors import DeviceError
from fingervision.testbed.bed_factory import open_bed
from tests.testbed.stages.emulators import COUNTS_PER_MM, PERIOD_S, Kinesis
from tests.testbed.stages.stage_cases import CASES

apt = pytest.importorskip("thorlabs_apt_protocol", reason="thorlabs-apt-protocol is not installed")
# Not in the library: MGMSG_MOT_REQ_STATUSBITS of the protocol.
STATUS = bytes.fromhex("290401005001")

TO = {"dest": 0x50, "source": 0x01, "chan_ident": 1}


def test_what_is_sent_is_what_the_library_would_send(virtual: None, tmp_path: Path) -> None:
    device = Kinesis()
    stage = open_bed(str(CASES["kinesis"].bed_at(tmp_path, device))).actuator
    device.heard.clear()
    stage.move(0.25, 1.5)
    stage.stop()
    stage.home()
    stage.close()
    speed = round(1.5 * COUNTS_PER_MM * 65536 * PERIOD_S)
    sent = [
        STATUS,
        apt.mot_req_poscounter(**TO),
        apt.mot_set_velparams(**TO, min_velocity=0, acceleration=263, max_velocity=speed),
        apt.mot_move_absolute(**TO, position=round(0.25 * COUNTS_PER_MM)),
        apt.mot_move_stop(**TO, stop_mode=1),
        STATUS,
        apt.mot_move_home(**TO),
        apt.mot_move_stop(**TO, stop_mode=1),
    ]
    assert device.heard == [each.hex() for each in sent]
    device.close()


def test_what_the_emulator_answers_is_what_the_library_reads() -> None:
    device, reader = Kinesis(), apt.Unpacker(on_error="raise")
    device.plant.go(0.5, 1000.0)
    for number in (0x0411, 0x0429, 0x0414):
        reader.feed(device.message(number, 1, 0, b""))
    position, status, speed = reader
    assert position.position in range(round(0.5 * COUNTS_PER_MM) + 1)
    assert status.channel_enabled
    assert speed.acceleration == 263
    device.close()


def test_an_excessive_position_error_is_an_alarm(virtual: None, tmp_path: Path) -> None:
    device = Kinesis()
    stage = open_bed(str(CASES["kinesis"].bed_at(tmp_path, device))).actuator
    stage.move(1.0, 1.0)
    device.fault = 0x4000
    with pytest.raises(DeviceError, match="excessive position error"):
        stage.readings()
    assert stage.alarm is not None
    stage.close()
    device.close()
