"""The ESP300's axis: exact commands with pymeasure's protocol emulator, and contract tests on an emulated axis."""

from contextlib import suppress
from pathlib import Path

import pytest

pytest.importorskip("pymeasure", reason="the extra `pymeasure` is not installed")

from pymeasure.instruments.newport import ESP300
from pymeasure.instruments.newport.esp300 import Axis
from pymeasure.test import expected_protocol

from fingervision.domain.errors import DataError, DeviceError
from fingervision.testbed.actuator import StageLimits
from fingervision.testbed.actuators.esp300 import Esp300Stage
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.clocks.clock import HostClock
from fingervision.testbed.motion.soft_limits import SoftLimits
from fingervision.testbed.operators.operator_kinds import AtTheBed
from fingervision.testing import ActuatorContract, NotApplicable, checks_of
from tests.adapters.esp300_axis import EmulatedEsp300

# pymeasure warns that it is not known whether this controller supports SCPI; SCPI is not used here.
pytestmark = pytest.mark.filterwarnings("ignore:It is not known:FutureWarning")
LIMITS = StageLimits(-2.0, 8.0, 5.0, 10.0, accuracy_mm=0.001)
OPENED = [("1SN?", "2"), ("1MO", None), ("TE?", "0")]


def stage(controller: ESP300) -> Esp300Stage:
    return Esp300Stage(controller, Axis(1, controller), HostClock(), LIMITS)


def test_a_move_is_speed_then_place_then_the_question_for_errors() -> None:
    talk = [*OPENED, ("1MD?", "1"), ("1VA0.5", None), ("1PA1.25", None), ("TE?", "0"), ("1TP", "0.75"), ("1MD?", "0")]
    with expected_protocol(ESP300, [*talk, ("1ST", None)]) as controller:
        opened = stage(controller)
        opened.move(1.25, 0.5)
        (reading,) = opened.readings()
        assert (reading.value, reading.moving) == (0.75, True)
        opened.stop()


def test_an_error_of_the_controller_is_a_sentence_and_an_alarm() -> None:
    talk = [*OPENED, ("1MD?", "1"), ("1VA1", None), ("1PA7", None), ("TE?", "113"), ("TE?", "0")]
    with expected_protocol(ESP300, talk) as controller:
        opened = stage(controller)
        with pytest.raises(DeviceError, match="motor not enabled"):
            opened.move(7.0, 1.0)
        assert opened.alarm is not None
        assert opened.alarm.code == "13"


def test_an_axis_in_other_units_is_refused() -> None:
    with (
        expected_protocol(ESP300, [("1SN?", "3")]) as controller,
        pytest.raises(DeviceError, match="micrometer"),
    ):
        stage(controller)


@pytest.mark.slow
@pytest.mark.parametrize("check", checks_of(ActuatorContract))
def test_an_emulated_axis_keeps_the_contract(check: str) -> None:
    adapter = EmulatedEsp300()
    bed = Bed(HostClock(), stage(ESP300(adapter)), SoftLimits(-2.0, 8.0, 5.0, 10.0), AtTheBed())
    with suppress(NotApplicable):
        getattr(ActuatorContract.of(bed), check)()
    bed.close()
    assert adapter.closed
    assert adapter.at_mm() == adapter.to_mm


def test_a_port_that_is_none_is_said_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "bed.toml"
    keys = 'kind = "esp300"\nport = "ASRL/dev/nothing::INSTR"\nlower_mm = 0\nupper_mm = 5\nspeed_mm_s = 1\n'
    path.write_text(f"schema = 1\n[actuator]\n{keys}", encoding="utf-8")
    with pytest.raises(DataError, match=r"port in line 4 .*nothing"):
        open_bed(str(path))
