"""Every kind of real stage with what it is tested against: an emulator, and the lines of its test bed's file."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import sleep
from typing import Any

from tests.testbed.stages import emulators
from tests.testbed.stages.motor_record import HangingServer, MotorRecordServer

LIMITS = "lower_mm = -2\nupper_mm = 8\naccuracy_mm = 0.002\nspeed_mm_s = {}\nsettling_s = {}\n"
CAMERA = f"""
[camera]
kind = "{Path(__file__).with_name("still_camera.py").as_posix()}"
rate_hz = 100.0
width_px = 320
height_px = 120
px_per_mm = 17.0
[gripper]
file = "gripper.csv"
[scale]
px_per_mm = 17.0
"""
GRIPPER = "input_mm,gap_mm\n-2,0.5\n8,5.5\n"


@dataclass(frozen=True)
class Case:
    """A kind of stage; the emulator has `plant`, `port`, `plug`, `unplug`, `close`, and maybe `nonsense`, `silent`.

    `virtual`: it follows the clock of the test bed; otherwise it moves in real time. `wired`: instead of a socket.
    """

    make: Callable[[], Any]
    lines: str
    library: str = ""
    settling_s: float = 0.2
    virtual: bool = True
    speed_mm_s: float = 5.0
    wired: bool = True

    def bed_at(self, folder: Path, emulator: Any, camera: str = "") -> Path:
        path = folder / "bed.toml"
        (folder / "demo.cfg").write_text(DEMO, encoding="utf-8")
        (folder / "gripper.csv").write_text(GRIPPER, encoding="utf-8")
        actuator = self.lines.replace("PORT", emulator.port)
        path.write_text(
            f"schema = 1\n[actuator]\n{actuator}\n{LIMITS.format(self.speed_mm_s, self.settling_s)}"
            f"[limits]\nlower_mm = -0.4\nupper_mm = 6\n{camera}",
            encoding="utf-8",
        )
        return path


def text(words: str, more: str = "") -> str:
    return f'kind = "serial_text"\nwords = "{words}"\nport = "PORT"\n{more}'


class Library:
    """A stage that a library simulates in this process; there is no cable to pull."""

    port = ""

    def close(self) -> None:
        """Nothing is open."""


class Statuses(Library):
    """A stage of ophyd's, whose motions end in threads of their own, for which virtual time waits."""

    def __init__(self) -> None:
        emulators.Emulator.plugged.add(self)

    def settle(self) -> None:
        while any("sleep_and_finish" in each.name or "_run_callbacks" in each.name for each in threading.enumerate()):
            sleep(1e-4)

    def close(self) -> None:
        emulators.Emulator.plugged.discard(self)


class Demo(Library):
    """The demo devices of Micro-Manager."""

    def __init__(self) -> None:
        import mm_test_adapters

        self.port = mm_test_adapters.device_adapter_path()


class VirtualController(Library):
    """The virtual controller of Standa's library, which keeps its state in a file."""

    def __init__(self) -> None:
        self._folder = TemporaryDirectory()
        self.port = f"xi-emu:///{self._folder.name}/controller.bin"

    def close(self) -> None:
        self._folder.cleanup()


MICROMANAGER = 'kind = "micromanager"\nfolder = "PORT"\nconfiguration = "demo.cfg"\n'
DEMO = """
Device,Stage,NotificationTester,NTAsyncStage
Device,XY,DemoCamera,DXYStage
Device,Cam,DemoCamera,DCam
Property,Core,Initialize,1
Property,Stage,SlewTimePerStep_s,0.0001
Property,Stage,UpdateInterval_s,0.01
"""
CASES: dict[str, Case] = {
    "grbl": Case(emulators.Grbl, text("grbl")),
    "marlin": Case(emulators.Marlin, text("marlin", f"set = {{ steps_per_mm = {emulators.STEPS_PER_MM} }}\n")),
    "pi_gcs": Case(emulators.PiGcs, text("pi_gcs")),
    "smaract_mcs": Case(emulators.SmarAct, text("smaract_mcs")),
    "newport_esp": Case(emulators.NewportEsp, text("newport_esp")),
    # The same words, over a socket.
    "esp300": Case(emulators.NewportEsp, 'kind = "esp300"\nport = "PORT"\naxis = 1\n', wired=False),
    "zaber": Case(emulators.Zaber, 'kind = "zaber"\nport = "PORT"\nmicrostep_mm = 0.0001\n'),
    "kinesis": Case(
        emulators.Kinesis,
        f'kind = "kinesis"\nport = "PORT"\ncontroller = "dc_servo"\ncounts_per_mm = {emulators.COUNTS_PER_MM}\n',
    ),
    "standa": Case(
        VirtualController,
        'kind = "standa"\ndevice = "PORT"\nstep_mm = 0.0025\nacceleration_mm_s2 = 200\n',
        "libximc",
        virtual=False,
    ),
    # The simulated record moves in ticks of 50 ms, each a little late.
    "epics_motor": Case(HangingServer, 'kind = "epics_motor"\nrecord = "PORT"\n', "caproto", 0.8, virtual=False),
    "ophyd_epics": Case(
        MotorRecordServer,
        'kind = "ophyd"\ndevice = "ophyd:EpicsMotor"\narguments = ["PORT"]\nnamed = { name = "stage" }\n',
        "ophyd",
        0.8,
        virtual=False,
    ),
    "ophyd_ramp": Case(
        Statuses, 'kind = "ophyd"\ndevice = "ophyd.sim:SynAxis"\nnamed = { name = "stage" }\nspeed = ""\n', "ophyd"
    ),
    # This motor accelerates for half a second.
    "ophyd_async": Case(
        Library,
        'kind = "ophyd"\ndevice = "ophyd_async.sim:SimMotor"\nnamed = { name = "stage", instant = false }\n',
        "ophyd_async",
        1.0,
        virtual=False,
    ),
    # The tester's stage goes at most 1 mm/s (test_micromanager_stage.py), and a ramp must be slower than the stage.
    "micromanager": Case(Demo, f'{MICROMANAGER}device = "Stage"\n', "mm_test_adapters", virtual=False, speed_mm_s=0.5),
    "micromanager_xy": Case(
        Demo,
        f'{MICROMANAGER}device = "XY"\naxis = "y"\nspeed_property = "Velocity"\nspeed_per_mm_s = 1\n',
        "mm_test_adapters",
        virtual=False,
    ),
}
