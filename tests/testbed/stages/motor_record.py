"""The motor record that caproto's project simulates, in a process of its own on the loopback."""

import os
import signal
import socket
import subprocess
import sys

IOC = """
import sys
from caproto.ioc_examples.fake_motor_record import FakeMotor
from caproto.server import PVGroup, SubGroup, run

class Ioc(PVGroup):
    motor = SubGroup(FakeMotor, velocity=1.0, precision=5, user_limits=(-2.0, 8.0), tick_rate_hz=20.0, prefix="mtr")

async def ready(library):
    print("ready", flush=True)

run(Ioc(prefix="sim:").pvdb, interfaces=["127.0.0.1"], log_pv_names=False, startup_hook=ready)
"""


class MotorRecordServer:
    """A server that can be ended and started again; its record is `sim:mtr`."""

    port = "sim:mtr"

    def __init__(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", 0))
            number = str(free.getsockname()[1])
        os.environ |= {
            "EPICS_CA_ADDR_LIST": "127.0.0.1",
            "EPICS_CA_AUTO_ADDR_LIST": "NO",
            "EPICS_CA_SERVER_PORT": number,
            "EPICS_CAS_SERVER_PORT": number,
        }
        self.plug()

    def plug(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", IOC], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "ready\n"

    def unplug(self) -> None:
        self._process.kill()
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()

    close = unplug


class HangingServer(MotorRecordServer):
    """A server that may stop answering while its connection stays open."""

    _silent = False

    @property
    def silent(self) -> bool:
        return self._silent

    @silent.setter
    def silent(self, silent: bool) -> None:
        self._silent = silent
        self._process.send_signal(signal.SIGSTOP if silent else signal.SIGCONT)
