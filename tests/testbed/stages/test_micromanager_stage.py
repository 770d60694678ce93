"""How fast the stage of Micro-Manager's notification tester can go, asked by Micro-Manager's core alone."""

from time import monotonic, sleep

import pytest

from tests.testbed.stages.stage_cases import CASES


def test_the_testers_stage_goes_at_most_one_millimetre_per_second() -> None:
    """A step of 0.1 um takes 0.1 ms at the least, so that a ramp at 2 mm/s would take twice its time."""
    adapters = pytest.importorskip("mm_test_adapters", reason="mm_test_adapters is not installed")
    import pymmcore

    core = pymmcore.CMMCore()
    core.setDeviceAdapterSearchPaths([adapters.device_adapter_path()])
    core.loadDevice("Stage", "NotificationTester", "NTAsyncStage")
    core.initializeAllDevices()
    assert core.isPropertyReadOnly("Stage", "UmPerStep")
    step_um, least_s = (
        float(core.getProperty("Stage", "UmPerStep")),
        core.getPropertyLowerLimit("Stage", "SlewTimePerStep_s"),
    )
    fastest_mm_s = 1e-3 * step_um / least_s
    assert fastest_mm_s == pytest.approx(1.0)
    core.setProperty("Stage", "SlewTimePerStep_s", least_s)
    began_s = monotonic()
    core.setPosition("Stage", 200.0)
    while core.deviceBusy("Stage"):
        sleep(0.001)
    assert monotonic() - began_s >= 0.2 / fastest_mm_s - 0.002
    assert CASES["micromanager"].speed_mm_s <= 0.5 * fastest_mm_s
    core.unloadAllDevices()
