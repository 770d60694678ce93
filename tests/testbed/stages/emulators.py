"""Controllers of stages in the network, written from their makers' protocols and apart from the kinds of stages."""

import re
import select
import socket
import struct
import threading
from collections.abc import Callable
from contextlib import suppress
from itertools import cycle
from operator import itemgetter
from time import monotonic, sleep
from typing import Any, ClassVar

import pytest
import serial

from fingervision.testbed.clocks.clock import VirtualClock


class Time:
    """The time of all emulators: the computer's, or that of a test bed whose time is virtual."""

    now_s: Callable[[], float] = staticmethod(monotonic)
    # What a controller does by itself, at its virtual time; none of it where time is the computer's.
    due: list[tuple[float, Callable[[], None]]] | None = None


class EmulatorsClock(VirtualClock):
    """A virtual clock that advances only when every controller has heard what it was told.

    Otherwise, seconds of virtual time may pass while the computer does not find a moment for a controller's thread.
    """

    def wait_until(self, time_s: float) -> None:
        for each in tuple(Emulator.plugged):
            each.settle()
        super().wait_until(time_s)
        for at_s, act in sorted(Time.due or (), key=itemgetter(0)):
            if at_s <= self.now_s() and Time.due is not None:
                Time.due.remove((at_s, act))
                act()


# GRBL and Marlin state their position in steps of a motor.
STEPS_PER_MM = 8000.0


class Plant:
    """A stage that moves at constant speed: its position is exact, and it is asked from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        # Time of its beginning, begin, end and speed of every motion.
        self._motions = [(-1e9, 0.0, 0.0, 0.0)]
        self.speed = 1.0
        self._sides = cycle((1.0, -1.0))
        self.lost_mm = self.strays_mm = 0.0
        self.homed = self.homing = False

    def at(self) -> float:
        with self._lock:
            return self._at() + next(self._sides) * self.strays_mm

    def was_at(self, time_s: float) -> float:
        """True position at a time that has passed."""
        with self._lock:
            return self._at(time_s)

    def _at(self, time_s: float | None = None) -> float:
        time_s = Time.now_s() if time_s is None else time_s
        began_s, start, to, speed = next(each for each in reversed(self._motions) if each[0] <= time_s)
        done = min(abs(to - start), speed * (time_s - began_s))
        return start + (done if to > start else -done)

    @property
    def target(self) -> float:
        return self._motions[-1][2]

    @property
    def moves(self) -> bool:
        began_s, start, to, speed = self._motions[-1]
        return Time.now_s() < began_s + abs(to - start) / max(speed, 1e-9)

    def go(self, to: float, speed: float | None = None) -> None:
        with self._lock:
            self._motions.append((Time.now_s(), self._at(), to + self.lost_mm, speed or self.speed))

    def halt(self) -> None:
        self.stands_at(self._at())

    def stands_at(self, mm: float) -> None:
        with self._lock:
            self._motions.append((Time.now_s(), mm, mm, 0.0))


class Emulator:
    """A controller behind a socket; `unplug` cuts the connection, and `plug` makes it possible again.

    A subclass states `end` of a line, `immediate` bytes that are answered without an end, and `answer`.
    """

    end = b"\n"
    immediate = b""
    plugged: ClassVar[set[Any]] = set()

    def __init__(self) -> None:
        self.plant, self.heard = Plant(), list[str]()
        self._turn = threading.Lock()
        self.nonsense = self.silent = False
        self._listener: socket.socket | None = None
        self._client: socket.socket | Wire | None = None
        self._number = 0
        self.plug()

    @property
    def port(self) -> str:
        return f"socket://127.0.0.1:{self._number}"

    def plug(self) -> None:
        self._listener = socket.create_server(("127.0.0.1", self._number))
        self._number = self._listener.getsockname()[1]
        threading.Thread(target=self._serve, args=(self._listener,), daemon=True).start()
        self.plugged.add(self)

    def wired(self, wire: "Wire") -> threading.Lock:
        """Talk over a wire from now on; only one thread at a time does."""
        self._client = wire
        return self._turn

    def unplug(self) -> None:
        self.plugged.discard(self)
        for each in (self._listener, self._client):
            if each is not None:
                with suppress(OSError):
                    each.shutdown(socket.SHUT_RDWR)
                each.close()

    close = unplug

    def _serve(self, listener: socket.socket) -> None:
        while True:
            try:
                self._client, _ = (client, _) = listener.accept()
                client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            except OSError:
                return
            threading.Thread(target=self._talk, args=(client,), daemon=True).start()

    def _talk(self, client: socket.socket) -> None:
        rest = b""
        with client, suppress(OSError, ValueError):  # the connection is cut
            while select.select([client], [], []):
                with self._turn:
                    if not (data := client.recv(4096)):
                        self._client = None if self._client is client else self._client
                        return
                    rest = self.take(rest + data, client)

    def settle(self) -> None:
        """Wait until everything that was sent to this controller has been heard and answered."""
        with suppress(OSError, ValueError):
            while not isinstance(self._client, Wire):
                with self._turn:
                    if self._client is None or not select.select([self._client], [], [], 0.0)[0]:
                        return
                sleep(1e-4)

    def take(self, data: bytes, client: "socket.socket | Wire") -> bytes:
        """Hear bytes, answer the whole messages among them, and return the rest."""
        line = b""
        for k in range(len(data)):
            byte = data[k : k + 1]
            if byte in self.immediate and self.immediate:
                self._reply(client, byte.decode("latin-1"))
            elif byte == self.end:
                self._reply(client, line.decode("latin-1"))
                line = b""
            else:
                line += byte
        return line

    def _reply(self, client: "socket.socket | Wire", line: str) -> None:
        self.heard.append(line)
        for said in self.answer(line):
            if self.silent:
                continue
            text = "\x7f#" if self.nonsense else said
            client.sendall(text.encode("latin-1") + self.answer_end)

    answer_end = b"\r\n"

    def answer(self, line: str) -> list[str]:
        raise NotImplementedError

    def later(self, seconds: float, act: Callable[[], None]) -> None:
        if Time.due is None:
            threading.Timer(seconds, act).start()
        else:
            Time.due.append((Time.now_s() + seconds, act))


class Wire:
    """The port of a plugged emulator without a socket: answers are there at once, and waiting in vain takes no time."""

    waited_s = 0.0

    def __init__(self, port: str, timeout: float = 0.0, **settings: object) -> None:
        found = next((each for each in Emulator.plugged if each.port == port), None)
        if found is None:
            raise serial.SerialException(f"nothing is connected to {port}")
        self.port, self.timeout = port, timeout
        self._device, self._half, self._answers, self._cut = found, b"", bytearray(), False
        self._turn = found.wired(self)

    @classmethod
    def now_s(cls) -> float:
        return cls.waited_s

    def write(self, data: bytes) -> None:
        with self._turn:
            if self._cut:
                raise serial.SerialException("the wire is cut")
            self._half = self._device.take(self._half + data, self)

    def sendall(self, data: bytes) -> None:
        self._answers += data

    @property
    def in_waiting(self) -> int:
        return len(self._answers)

    def read(self, size: int) -> bytes:
        with self._turn:
            if self._cut:
                raise serial.SerialException("the wire is cut")
            got = bytes(self._answers[:size])
            del self._answers[:size]
        if not got:
            Wire.waited_s += self.timeout
        return got

    def reset_input_buffer(self) -> None:
        self._answers.clear()

    def close(self) -> None:
        self._cut = True

    def shutdown(self, how: int) -> None:
        """Let the emulator cut it."""


def virtual_time(monkeypatch: pytest.MonkeyPatch, clock: EmulatorsClock | None = None, wires: bool = True) -> None:
    """Let the next test beds and the emulators share a virtual clock, and wires, from now on."""
    clock = clock or EmulatorsClock(begin_s=monotonic())
    monkeypatch.setattr("fingervision.testbed.bed_factory.HostClock", lambda: clock)
    monkeypatch.setattr(Time, "now_s", clock.now_s)
    monkeypatch.setattr(Time, "due", [])
    if wires:
        monkeypatch.setattr(serial, "serial_for_url", Wire)
        for each in ("text_protocol.line", "actuators.kinesis"):
            monkeypatch.setattr(f"fingervision.testbed.{each}.monotonic", Wire.now_s)


class Grbl(Emulator):
    """GRBL 1.1: `?`, 0x85 and 0x18 at any time, jogs, homing that answers when it is done."""

    immediate = b"?\x85\x18"
    refuses = ""

    def answer(self, line: str) -> list[str]:
        plant = self.plant
        if line == "?":
            state = "Home" if plant.homing and plant.moves else "Jog" if plant.moves else "Idle"
            return [f"<{state}|MPos:{plant.at():.4f},0.0000,0.0000|FS:0,0>"]
        if line in "\x85\x18":
            plant.halt()
            if line == "\x18" and plant.homing:
                plant.homing = False
                return ["ALARM:6", "Grbl 1.1h ['$' for help]"]
            return []
        if line == "$I":
            return ["[VER:1.1h.20190825:]", "[OPT:V,15,128]", "ok"]
        if line == "$H":
            plant.homing = True
            plant.go(0.0, 5.0)
            self.later(abs(plant.at()) / 5.0 + 0.01, self._home_done)
            return []
        if self.refuses:
            return [self.refuses]
        found = re.fullmatch(r"\$J=G90 G21 G53 X(-?[\d.]+) F([\d.]+)", line)
        if not found:
            return ["error:2"]
        plant.go(float(found[1]), float(found[2]) / 60.0)
        return ["ok"]

    def _home_done(self) -> None:
        if self.plant.homing and self._client is not None:
            self.plant.homing = False
            self._client.sendall(b"ok\r\n")


class Marlin(Emulator):
    """Marlin 2: M114 with the motor's count, G28 that blocks, M410."""

    def answer(self, line: str) -> list[str]:
        plant = self.plant
        if line == "M115":
            return [
                "FIRMWARE_NAME:Marlin 2.1.2 (Github) PROTOCOL_VERSION:1.0",
                "Cap:EEPROM:1",
                "ok",
            ]
        if line == "M114":
            steps = round(plant.at() * STEPS_PER_MM)
            return [f"X:{plant.target:.2f} Y:0.00 Z:0.00 E:0.00 Count X:{steps} Y:0 Z:0", "ok"]
        if line == "M410":
            plant.halt()
            return ["ok"]
        if line == "G28 X":
            plant.go(0.0, 5.0)
            client = self._client
            self.later(abs(plant.at()) / 5.0 + 0.01, lambda: client and client.sendall(b"echo:busy: processing\nok\n"))
            return []
        if found := re.fullmatch(r"G1 X(-?[\d.]+) F([\d.]+)", line):
            plant.go(float(found[1]), float(found[2]) / 60.0)
            return ["ok"]
        return ["ok"] if line in ("G21", "G90") else [f'echo:Unknown command: "{line}"', "ok"]


class PiGcs(Emulator):
    """PI GCS 2.0: #5, SVO, VEL, MOV, POS?, FRF, STP, ERR?."""

    immediate = b"\x05"
    answer_end = b"\n"
    error = 0

    def answer(self, line: str) -> list[str]:
        plant, words = self.plant, line.split()
        match words:
            case ["\x05"]:
                return [f"{int(plant.moves):x}"]
            case ["*IDN?"]:
                return ["(c)2011 Physik Instrumente (PI) Karlsruhe, C-863.11,0,1.2.0"]
            case ["POS?", "1"]:
                return [f"1={plant.at():.6f}"]
            case ["ERR?"]:
                error, self.error = self.error, 0
                return [str(error)]
            case ["SVO", "1", "1"]:
                pass
            case ["VEL", "1", speed]:
                plant.speed = float(speed)
            case ["MOV", "1", to] if plant.homed:
                plant.go(float(to))
            case ["MOV", *_]:
                self.error = 5  # unallowable move attempted on unreferenced axis
            case ["FRF", "1"]:
                plant.homed = True
                plant.go(0.0, 5.0)
            case ["STP"]:
                plant.halt()
                self.error = 10
            case _:
                self.error = 2
        return []


class SmarAct(Emulator):
    """SmarAct MCS: ASCII commands in nanometres, each answered."""

    answer_end = b"\n"

    def answer(self, line: str) -> list[str]:
        plant = self.plant
        if line == ":GSI":
            return [":ID2714728543"]
        if line == ":GP0":
            return [f":P0,{round(plant.at() * 1e6)}"]
        if line == ":GS0":
            return [f":S0,{(7 if plant.homing else 4) if plant.moves else 3}"]
        if found := re.fullmatch(r":SCLS0,(\d+)", line):
            plant.speed = int(found[1]) / 1e6
        elif found := re.fullmatch(r":MPA0,(-?\d+),60000", line):
            plant.go(int(found[1]) / 1e6)
        elif line == ":FRM0,0,60000,1":
            plant.go(0.0, 5.0)
        elif line == ":S0":
            plant.halt()
        else:
            return [":E-1,1"]
        return [":E0,0"]


class NewportEsp(Emulator):
    """Newport ESP300: axis 1, commands end with a carriage return."""

    end = b"\r"
    units, motor_on, error = "2", False, "0, 451322, NO ERROR DETECTED"

    def answer(self, line: str) -> list[str]:
        plant = self.plant
        match line:
            case "1SN?":
                return [self.units]
            case "1TP":
                return [f"{plant.at():.6f}"]
            case "1MD?":
                return [str(int(not plant.moves))]
            case "TB?":
                error, self.error = self.error, "0, 451322, NO ERROR DETECTED"
                return [error]
            case "1MO":
                self.motor_on = True
            case "1ST":
                plant.halt()
            case "1OR1":
                plant.go(0.0, 5.0)
            case _ if line.startswith("1VA"):
                plant.speed = float(line[3:])
            case _ if line.startswith("1PA") and self.motor_on:
                plant.go(float(line[3:]))
            case _ if line.startswith("1PA"):
                self.error = "113, 4523, AXIS-1 MOTOR NOT ENABLED"
            case _:
                self.error = "6, 4523, COMMAND DOES NOT EXIST"
        return []


class Zaber(Emulator):
    """Zaber's ASCII protocol: microsteps, replies with the message's number, and with a checksum if it was sent one."""

    PER_MM, SPEED_UNIT = 10_000.0, 1.6384
    maxspeed, serial = 32_768, 55_123

    def __init__(self) -> None:
        super().__init__()
        self.plant.homed = True

    def answer(self, line: str) -> list[str]:
        message, _, checksum = line.strip().removeprefix("/").partition(":")
        words = message.split()
        numbers = [int(word) for word in words[:3] if word.isdigit()]
        flag, data = self.do(words[len(numbers) :])
        number = f" {numbers[2]:02d}" if len(numbers) > 2 else ""
        device, axis = (*numbers, 0, 0)[:2]
        state = "BUSY" if self.plant.moves else "IDLE"
        reply = f"{device:02d} {axis}{number} {flag} {state} -- {data}"
        return [f"@{reply}" + (f":{-sum(reply.encode()) & 0xFF:02X}" if checksum else "")]

    def do(self, words: list[str]) -> tuple[str, str]:
        plant = self.plant
        match words:
            case ["get", "system.serial"]:
                return "OK", str(self.serial)
            case ["get", "maxspeed"]:
                return "OK", str(self.maxspeed)
            case ["get", "pos"]:
                return "OK", str(round(plant.at() * self.PER_MM))
            case ["set", "maxspeed", speed]:
                self.maxspeed = int(speed)
            case ["move", "abs", _] if not plant.homed:
                return "RJ", "NOREF"
            case ["move", "abs", to]:
                plant.go(float(to) / self.PER_MM, self.maxspeed / self.SPEED_UNIT / self.PER_MM)
            case ["home"]:
                plant.homed = True
                plant.go(0.0, 5.0)
            case ["stop"]:
                plant.halt()
            case [_, *_]:
                return "RJ", "BADCOMMAND"
        return "OK", "0"


class Conex(Emulator):
    """Newport CONEX-CC: two letters and a value, states as hexadecimal numbers, errors as letters."""

    error = "@"

    def answer(self, line: str) -> list[str]:
        plant, name, value = self.plant, line[1:3], line[3:].strip()
        match name:
            case "ID":
                return ["1IDTRA12CC"]
            case "TP":
                return [f"1TP{plant.at():.6g}"]
            case "TS":
                state = ("1E" if plant.homing else "28") if plant.moves else "33" if plant.homed else "0A"
                return [f"1TS0000{state}"]
            case "TE":
                error, self.error = self.error, "@"
                return [f"1TE{error}"]
            case "VA":
                plant.speed = float(value)
            case "PA" if plant.homed:
                plant.homing = False
                plant.go(float(value))
            case "OR":
                plant.homed = plant.homing = True
                plant.go(0.0, 5.0)
            case "ST":
                plant.halt()
            case _:
                self.error = "H"  # not allowed before the reference was found
        return []


class Invented(Emulator):
    """The invented controller of the manual's page on stages: micrometres, every command is answered."""

    answer_end = b"\n"
    # The position is refreshed at this interval, if it is not zero, and is that of as much later or earlier.
    refreshed_s = ahead_s = 0.0

    def stated_mm(self) -> float:
        if not self.refreshed_s:
            return self.plant.at()
        scanned_s = Time.now_s() // self.refreshed_s * self.refreshed_s
        return self.plant.was_at(scanned_s + self.ahead_s)

    def answer(self, line: str) -> list[str]:
        plant, words = self.plant, line.strip().split()
        match words:
            case ["1ID?"]:
                return ["INVENTED STAGE 1.0"]
            case ["1POS?"]:
                return [f"{self.stated_mm() * 1000.0:.3f}"]
            case ["1STATE?"]:
                return ["MOVE" if plant.moves else "IDLE"]
            case ["1SPEED", speed]:
                plant.speed = float(speed) / 1000.0
            case ["1GOTO", to]:
                plant.go(float(to) / 1000.0)
            case ["1HOME"]:
                plant.go(0.0, 5.0)
            case ["1STOP"]:
                plant.halt()
            case _:
                return ["ERR unknown command"]
        return ["OK"]


class Meter(Emulator):
    """A multimeter or a balance: it answers SCPI's READ? and MT-SICS' SI, as slowly as it is told."""

    value = 1.25
    takes_s = 0.0

    def answer(self, line: str) -> list[str]:
        sleep(self.takes_s)
        answers = {"*IDN?": "Maker,DMM,1,1.0", "READ?": f"{self.value:+.6E}", "SI\r": f"S S {self.value:9.2f} g"}
        return [answers[line]] if line in answers else []


class PrintedNumbers(Emulator):
    """A board with a load cell that prints 80 numbers a second without being asked."""

    value = 84_000

    def _talk(self, client: socket.socket) -> None:
        with suppress(OSError):
            while True:
                sleep(1.0 / 80.0)
                if not self.silent:
                    client.sendall(b"what\r\n" if self.nonsense else f"{self.value}\r\n".encode())


COUNTS_PER_MM = 34304.0
PERIOD_S = 2048 / 6e6


class Kinesis(Emulator):
    """Thorlabs KDC101: binary messages of the Host-Controller Communications Protocol, channel 1, unit 0x50."""

    fault, serial = 0, 27_000_123

    def __init__(self) -> None:
        super().__init__()
        self.plant.homed = True

    def take(self, data: bytes, client: "socket.socket | Wire") -> bytes:
        while len(data) >= 6:
            message, first, second, to = struct.unpack_from("<HBBB", data)
            size = 6 + (first + 256 * second if to & 0x80 else 0)
            if len(data) < size:
                break
            whole, data = data[:size], data[size:]
            self.heard.append(whole.hex())
            back = self.message(message, first, second, whole[6:])
            if back and not self.silent:
                client.sendall(b"\xff" * 12 if self.nonsense else back)
        return data

    def message(self, number: int, first: int, second: int, data: bytes) -> bytes:
        plant = self.plant
        match number:
            case 0x0005:
                return struct.pack("<HHBBI80x", 0x0006, 84, 0x81, 0x50, self.serial)
            case 0x0210:
                pass
            case 0x0443:
                plant.homing = plant.homed = True
                plant.go(0.0, 5.0)
            case 0x0465:
                plant.halt()
                return struct.pack("<HHBBHiiI", 0x0466, 14, 0x81, 0x50, 1, *self._place(), self._bits())  # stopped
            case 0x0413:
                _, _, _, speed = struct.unpack("<Hiii", data)
                plant.speed = speed / (65536 * PERIOD_S) / COUNTS_PER_MM
            case 0x0414:
                return struct.pack("<HHBBHiii", 0x0415, 14, 0x81, 0x50, 1, 0, 263, 772981)
            case 0x0453:
                plant.homing = False
                plant.go(struct.unpack("<Hi", data)[1] / COUNTS_PER_MM)
            case 0x0411:
                return struct.pack("<HHBBHi", 0x0412, 6, 0x81, 0x50, 1, self._place()[0])
            case 0x0429:
                return struct.pack("<HHBBHI", 0x042A, 6, 0x81, 0x50, 1, self._bits())
        return b""

    def _place(self) -> tuple[int, int]:
        counts = round(self.plant.at() * COUNTS_PER_MM)
        return counts, counts

    def _bits(self) -> int:
        moves = self.plant.moves
        forward = self.plant.target > self.plant.at()
        return (
            0x80000000
            | self.fault
            | self.plant.homed * 0x400
            | moves * (0x200 if self.plant.homing else 0x10 if forward else 0x20)
        )
