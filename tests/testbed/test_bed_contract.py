"""Contract tests for every actuator, force sensor and camera; a new part without hardware is tested if it is listed
here.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from fingervision.domain.errors import LimitError
from fingervision.testbed.bed import Bed
from fingervision.testbed.bed_factory import open_bed
from fingervision.testbed.manual import manual_control
from fingervision.testing import ActuatorContract, CameraContract, ForceSensorContract, NotApplicable, checks_of
from tests.testbed.simulated_beds import live_camera_at

# A part is tested as a part of a test bed.
BEDS: dict[str, Callable[[pytest.FixtureRequest], Bed]] = {
    "simulated": lambda request: open_bed("simulated"),
    "source": lambda request: request.getfixturevalue("source_bed"),
    "hand_screw": lambda request: request.getfixturevalue("hand_screw_bed"),
}


@pytest.fixture
def source_bed(tmp_path: Path) -> Bed:
    """A camera that runs continuously, with times on the host's clock."""
    return open_bed(str(live_camera_at(tmp_path)))


@pytest.fixture(params=sorted(BEDS))
def bed(request: pytest.FixtureRequest) -> Iterator[Bed]:
    opened = BEDS[request.param](request)
    yield opened
    opened.close()


@pytest.mark.parametrize("check", checks_of(ActuatorContract))
def test_every_actuator_keeps_the_contract(bed: Bed, check: str) -> None:
    contract = ActuatorContract.of(bed)
    contract.has_motor = bed.actuator.name != "hand screw"
    with suppress(NotApplicable):
        getattr(contract, check)()


@pytest.mark.parametrize("check", checks_of(ForceSensorContract))
def test_every_force_sensor_keeps_the_contract(bed: Bed, check: str) -> None:
    with suppress(NotApplicable):
        getattr(ForceSensorContract.of(bed), check)()


@pytest.mark.parametrize("check", checks_of(CameraContract))
def test_every_camera_keeps_the_contract(bed: Bed, check: str) -> None:
    with suppress(NotApplicable):
        getattr(CameraContract.of(bed), check)()


def test_the_board_keeps_the_contract(homed_board_bed: Bed) -> None:
    """One emulated board for all checks, at its reference before each."""
    for contract in (ForceSensorContract, CameraContract, ActuatorContract):
        for check in sorted(checks_of(contract), key=lambda name: "closing" in name):
            with suppress(NotApplicable):
                getattr(contract.of(homed_board_bed), check)()
            if "closing" not in check:
                at_rest(homed_board_bed)
                manual_control.home(homed_board_bed)


def at_rest(bed: Bed) -> None:
    while bed.actuator.busy:
        bed.clock.wait_until(bed.clock.now_s() + 0.01)


def test_a_motion_that_is_refused_says_that_nothing_was_moved(bed: Bed) -> None:
    limits = bed.actuator.limits
    with pytest.raises(LimitError, match=r"but is .*nothing was moved"):
        bed.actuator.move(limits.upper_mm + 0.1, 1.0)
    with pytest.raises(LimitError, match=r"The speed must be .*nothing was moved"):
        bed.actuator.move(0.0, limits.speed_mm_s * 1.01)
