"""A stage behind a Thorlabs Kinesis or APT controller (KDC101, TDC001, KST101, TST001, BSC, BBD, K10CR1, LTS).

Messages as in Thorlabs, "Host-Controller Communications Protocol" (issue 38): a header of six bytes, and data where
the fifth byte has its highest bit set; numbers are little-endian. The port is the controller's USB serial port
(`/dev/ttyUSB0`; on Windows, tick *Load VCP* in the device manager). Tested against an emulator written from that
document, both compared message by message with thorlabs-apt-protocol, an independent library; not on hardware.
"""

import struct
from time import monotonic

import serial

from fingervision.domain.errors import DeviceError
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import RefusedError
from fingervision.testbed.actuators._single_axis import KEYS as AXIS
from fingervision.testbed.actuators._single_axis import (
    AxisSettings,
    SingleAxis,
    stated_axis,
    without_hardware,
)
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.serial_port import opened_port, told

__all__ = ["KEYS", "SIMULATED", "KinesisStage", "build", "without_hardware"]
KEYS = ("port", "channel", "bay", "counts_per_mm", "controller", "acceleration_mm_s2", *AXIS)
SIMULATED = False
BAUD = 115_200
HOST, UNIT, HAS_DATA = 0x01, 0x50, 0x80
HEADER = struct.Struct("<HBBBB")
# Messages (section 4 and 5 of the protocol).
ASK_INFO, INFO, ENABLE, HOME, MOVE_ABSOLUTE, STOP = 0x0005, 0x0006, 0x0210, 0x0443, 0x0453, 0x0465
SET_SPEED, ASK_SPEED, SPEED = 0x0413, 0x0414, 0x0415
ASK_POSITION, POSITION, ASK_STATUS, STATUS = 0x0411, 0x0412, 0x0429, 0x042A
AT_ONCE = 1
SPEEDS, TARGET = struct.Struct("<Hiii"), struct.Struct("<Hi")
STATE, SERIAL_NUMBER = struct.Struct("<HI"), struct.Struct("<I")
MOVES = 0x10 | 0x20 | 0x40 | 0x80 | 0x200  # forward, reverse, jogging either way, homing
HOMED, OFF_COURSE = 0x400, 0x4000  # excessive position error
PERIODS_S = {"dc_servo": 2048 / 6e6, "brushless": 102.4e-6, "stepper": 0.0}
"""Sampling period T of a servo's position loop: speed in counts/s times 65536 T (section 8). A stepper's controller
counts 53.68 units for a microstep per second, and 1/90.9 for a microstep per second squared."""
STEPPER_SPEED, STEPPER_ACCELERATION = 53.68, 1.0 / 90.9
ANSWER_S = 1.0


class KinesisStage(SingleAxis):
    """One channel of a controller.

    Parameters
    ----------
    port : serial.SerialBase
        The open port; reads end after a short time.
    channel, unit : int
        Channel of the controller, from 1, and address of the unit or bay.
    counts_per_mm, period_s : float
        Encoder counts (or microsteps) per millimetre, and sampling period of the servo; 0 for a stepper.
    acceleration_mm_s2 : float or None
        Acceleration; by default that which the controller has.
    clock, settings
        As in `SingleAxis`.
    """

    def __init__(
        self, port: "serial.Serial", channel: int, unit: int, counts_per_mm: float, period_s: float,
        acceleration_mm_s2: float | None, clock: Clock, settings: AxisSettings,
    ) -> None:  # fmt: skip
        super().__init__(f"Thorlabs controller at {port.port}, channel {channel}", clock, settings)
        self._port, self._channel, self._unit, self._per_mm = port, channel, unit, counts_per_mm
        servo = 65536.0 * period_s
        self._speed_unit, acceleration_unit = (
            (servo, servo * period_s) if period_s else (STEPPER_SPEED, STEPPER_ACCELERATION)
        )
        self._rest = b""
        self._acceleration = acceleration_mm_s2 and round(acceleration_mm_s2 * counts_per_mm * acceleration_unit)

    def _set_up(self) -> None:
        (number,) = self._asked(lambda: SERIAL_NUMBER.unpack_from(self._ask(ASK_INFO, INFO)))
        self.name = f"Thorlabs controller {number} at {self._port.port}, channel {self._channel}"
        self._asked(lambda: self._send(ENABLE, self._channel, 1))
        held = self._asked(lambda: SPEEDS.unpack_from(self._ask(ASK_SPEED, SPEED)))
        self._acceleration = self._acceleration or held[2]

    def _moving(self) -> bool:
        bits = STATE.unpack_from(self._ask(ASK_STATUS, STATUS))[1]
        if bits & OFF_COURSE:
            raise RefusedError("0x4000", "an excessive position error: the stage is blocked or too heavily loaded")
        self._homed = bool(bits & HOMED)
        return bool(bits & MOVES)

    def _position_mm(self) -> float:
        return float(TARGET.unpack_from(self._ask(ASK_POSITION, POSITION))[1]) / self._per_mm

    def _go_home(self) -> None:
        self._send(HOME, self._channel)

    def _begin(self, to_mm: float, speed_mm_s: float) -> None:
        speed = max(1, round(speed_mm_s * self._per_mm * self._speed_unit))
        self._send(SET_SPEED, data=SPEEDS.pack(self._channel, 0, self._acceleration, speed))
        self._send(MOVE_ABSOLUTE, data=TARGET.pack(self._channel, round(to_mm * self._per_mm)))

    def _halt(self) -> None:
        self._send(STOP, self._channel, AT_ONCE)

    def _release(self) -> None:
        self._port.close()

    def _send(self, message: int, first: int = 0, second: int = 0, data: bytes = b"") -> None:
        """Send one message by one write, so that a stop from another thread falls between two messages."""
        if data:
            header = HEADER.pack(message, len(data), 0, self._unit | HAS_DATA, HOST)
        else:
            header = HEADER.pack(message, first, second, self._unit, HOST)
        told(self._port, header + data)

    def _ask(self, message: int, awaited: int) -> bytes:
        """Ask for a message; messages that the controller sends unasked, such as the end of a motion, are skipped."""
        self._rest = b""
        self._port.reset_input_buffer()
        self._send(message, self._channel)
        until_s = monotonic() + ANSWER_S
        while monotonic() < until_s:
            self._rest += self._port.read(max(1, self._port.in_waiting))
            while len(self._rest) >= HEADER.size:
                came, first, second, to, _ = HEADER.unpack_from(self._rest)
                size = HEADER.size + (first | second << 8 if to & HAS_DATA else 0)
                if size > 300 or to & ~HAS_DATA not in (HOST, 0x00):  # no message of the protocol: spoilt bytes
                    raise DeviceError(
                        f"{self.name} must answer by a message of the APT protocol, but answered {self._rest[:12]!r}: "
                        "check that the port is the controller's."
                    )
                if len(self._rest) < size:
                    break
                data, self._rest = self._rest[HEADER.size : size], self._rest[size:]
                if came == awaited:
                    return data
        raise DeviceError(f"{self.name} must answer within {ANSWER_S:g} s, but did not: check its cable and power.")


def build(section: Section, context: BuildContext) -> KinesisStage:
    """Open the controller that the configuration states."""
    settings, name = stated_axis(section), section.word("port")
    period_s = PERIODS_S[section.word("controller", of=PERIODS_S)]
    channel, bay = section.whole("channel", 1, low=1, high=3), section.whole("bay", 0, low=0, high=10)
    counts = section.number("counts_per_mm", above=0.0)
    ramp = section.number("acceleration_mm_s2", above=0.0) if "acceleration_mm_s2" in section.values else None
    unit = 0x20 + bay if bay else UNIT
    try:
        port = opened_port(name, BAUD, 0.02)
    except DeviceError as error:
        section.refuse("port", f"must be that of a controller, but was not opened. {error}")
    return KinesisStage(port, channel, unit, counts, period_s, ramp, context.clock, settings).at_rest()
