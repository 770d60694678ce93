"""The real sketch on an emulated ATmega328P, with a motor controller and a force signal on its pins."""

import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from mmap import mmap
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Condition, Thread
from time import sleep

import serial

from fingervision.domain.board_settings import SELECT, BoardSettings, Line, Role

HERE = Path(__file__).parent
SKETCH = HERE.parents[1] / "fingervision" / "testbed" / "firmware" / "fingervision_board"
ARDUINO = Path("/usr/share/arduino/hardware/arduino/avr")
CORE_FILES = (
    "wiring.c", "wiring_digital.c", "hooks.c", "main.cpp", "HardwareSerial.cpp", "HardwareSerial0.cpp", "Print.cpp",
    "abi.cpp", "new.cpp", "WString.cpp",
)  # fmt: skip
HERTZ = 16_000_000
# Output of the force sensor's amplifier without a load (live zero).
UNLOADED_MV = 500
# Offset of the host's clock from the board's clock, and host seconds per board second: the board's resonator is slow by
# its largest tolerance.
BEGAN_S, CRYSTAL_SLOW_BY = 5000.0, 1.005

WIRING = {
    **dict(zip(SELECT, (Line(2), Line(3), Line(4), Line(5)), strict=True)),
    Role.DRIVE: Line(6),
    Role.ENABLE: Line(7),
    Role.BUSY: Line(8, active_high=False),
    Role.ALARM: Line(9, active_high=False),
    Role.HOLD: Line(11),
    Role.FORCE: Line(14),
}


def missing_tools() -> str | None:
    """Reason why the sketch cannot be run on this computer; None if it can."""
    tools = [tool for tool in ("gcc", "avr-gcc", "avr-g++") if shutil.which(tool) is None]
    if not ARDUINO.is_dir():
        tools.append("arduino-core-avr")
    if not Path("/usr/include/simavr/sim_avr.h").is_file():
        tools.append("libsimavr-dev")
    return f"needs {', '.join(tools)}" if tools else None


def compiled(folder: Path) -> tuple[Path, Path]:
    """Compile the emulator program and the sketch; return the paths of both."""
    host, elf = folder / "avrhost", folder / "board.elf"
    _run("gcc", "-O2", "-I/usr/include/simavr", "-o", host, HERE / "avrhost.c", "-lsimavr", "-lelf", "-lutil")
    common = (
        "-mmcu=atmega328p", f"-DF_CPU={HERTZ}UL", "-DARDUINO=10819", "-DARDUINO_AVR_UNO", "-DARDUINO_ARCH_AVR",
        # gcc-avr 5 does not define this name, which WString.cpp uses.
        "-DDECIMAL_DIG=__DECIMAL_DIG__", f"-I{ARDUINO}/cores/arduino", f"-I{ARDUINO}/variants/standard", "-Os",
        "-ffunction-sections", "-fdata-sections", "-c",
    )  # fmt: skip
    cpp = ("-std=gnu++11", "-fno-exceptions", "-fno-threadsafe-statics", "-fpermissive")
    objects = []
    for name in CORE_FILES:
        objects.append(folder / f"{name}.o")
        tool, options = ("avr-gcc", ("-std=gnu11",)) if name.endswith(".c") else ("avr-g++", cpp)
        _run(tool, *common, *options, ARDUINO / "cores" / "arduino" / name, "-o", objects[-1])
    objects.append(folder / "sketch.o")
    sketch = ("-Wall", "-Wextra", "-Werror", "-x", "c++", "-include", "Arduino.h", SKETCH / f"{SKETCH.name}.ino")
    _run("avr-g++", *common, *cpp, *sketch, "-o", objects[-1])
    _run("avr-g++", "-mmcu=atmega328p", "-Wl,--gc-sections", *objects, "-o", elf, "-lm")
    return host, elf


def _run(*words: str | Path) -> None:
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@dataclass(frozen=True, slots=True)
class Edge:
    """A change of a port's registers.

    `host_s` is the time of the change on the host's clock.
    """

    cycle: int
    host_s: float
    ports: dict[str, int]
    directions: dict[str, int]

    def level(self, pin: int) -> int | None:
        """Level to which the board drives a pin; None if the pin is an input."""
        letter, bit = ("D", pin) if pin < 8 else ("B", pin - 8) if pin < 14 else ("C", pin - 14)
        return self.ports[letter] >> bit & 1 if self.directions[letter] >> bit & 1 else None


class Shared:
    """Numbers in memory shared by emulator and computer: the cycle, and the numbers of bytes sent and received at each
    end.

    Parameters
    ----------
    path : Path
        File that the emulator and this process map into memory.
    """

    CYCLE, OUT, IN, READ, WRITTEN = range(5)
    HUNG_UP = 2**64 - 1

    def __init__(self, path: Path) -> None:
        path.write_bytes(bytes(8 * 5))
        with path.open("r+b") as file:
            self._shared = mmap(file.fileno(), 8 * 5)

    def __getitem__(self, which: int) -> int:
        return int.from_bytes(self._shared[8 * which : 8 * which + 8], "little")

    def __setitem__(self, which: int, value: int) -> None:
        self._shared[8 * which : 8 * which + 8] = value.to_bytes(8, "little")

    def counted(self, port: serial.Serial) -> serial.Serial:
        """Count the bytes that pass an open port from now on; return this port."""
        self[self.READ], self[self.WRITTEN] = self[self.OUT], self[self.IN]
        read, write, close = port.read, port.write, port.close

        def counting_read(size: int = 1) -> bytes:
            got = read(size)
            self[self.READ] += len(got)
            return got

        def counting_write(line: bytes) -> int | None:
            done = write(line)
            self[self.WRITTEN] += len(line)
            return done

        def hanging_up() -> None:
            self[self.READ] = self.HUNG_UP
            close()

        port.read, port.write, port.close = counting_read, counting_write, hanging_up  # type: ignore[method-assign]
        return port


class EmulatedTime:
    """A clock of the host that follows the emulated crystal, independent of the speed of the emulation.

    Parameters
    ----------
    shared : Shared
        Shared memory to which the emulator writes its cycle.
    """

    def __init__(self, shared: Shared) -> None:
        self._shared = shared

    def now_s(self) -> float:
        """Present time in seconds."""
        return self.at(self._shared[Shared.CYCLE])

    def wait_until(self, time_s: float) -> None:
        """Sleep until a time of this clock."""
        while self.now_s() < time_s:
            sleep(1e-3)

    def at(self, cycle: int) -> float:
        """Time of this clock at a cycle of the crystal."""
        return BEGAN_S + CRYSTAL_SLOW_BY * cycle / HERTZ


class EmulatedBoard:
    """A running board with the wiring in `WIRING`.

    Parameters
    ----------
    host, elf : Path
        Paths returned by `compiled`.
    slower : int
        Factor by which the emulation is slower than real time. Emulation in real time takes most of a processor. If it
        is slower, and the host uses `clock`, the sequence of events is the same on a loaded computer.
    """

    def __init__(self, host: Path, elf: Path, slower: int) -> None:
        self._folder = TemporaryDirectory()
        path = Path(self._folder.name) / "shared"
        self.shared = Shared(path)
        self.clock = EmulatedTime(self.shared)
        self.edges: list[Edge] = [Edge(0, 0.0, dict.fromkeys("BCD", 0), dict.fromkeys("BCD", 0))]
        self.on_edge: list[Callable[[Edge, Edge], None]] = []
        self._said = 0
        self._done_s: list[float] = []
        self._news = Condition()
        self._process = subprocess.Popen(
            [host, elf, str(slower), path],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            bufsize=1,
        )
        self.port = self._line_of("pty")
        self._thread = Thread(target=self._follow, daemon=True)
        self._thread.start()

    def settings(self, **others: int) -> BoardSettings:
        """Settings with which the package opens this board."""
        return BoardSettings(port=self.port, lines=WIRING, **others)

    def say(self, words: str) -> int:
        """Send a command to the emulator program, to change an input of the board; return the number of the command."""
        assert self._process.stdin is not None
        with self._news:
            self._process.stdin.write(words + "\n")
            self._said += 1
            return self._said - 1

    def done_s(self, command: int) -> float:
        """Wait until a command was executed; return the time on the host's clock."""
        with self._news:
            self._news.wait_for(lambda: len(self._done_s) > command)
            return self._done_s[command]

    def outside(self, role: Role, on: bool) -> None:
        """Set a line from the motor controller active or inactive."""
        line = WIRING[role]
        self.say(f"pin {line.pin} {int(on == line.active_high)}")

    def wait_for(self, edge: Callable[[Edge], bool], within_s: float = 5.0, since: int = 0) -> Edge:
        """First change, from index `since` on, that satisfies a condition."""
        until_s = self.clock.now_s() + within_s
        with self._news:
            while True:
                for each in self.edges[since:]:
                    if edge(each):
                        return each
                assert self.clock.now_s() < until_s, "the board did not do it"
                self._news.wait(0.05)

    def close(self) -> None:
        """Switch the board off."""
        self._process.kill()
        self._process.wait()
        self._thread.join()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()
        self._folder.cleanup()

    def _line_of(self, word: str) -> str:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith(word):
                return line.split()[1]
        raise AssertionError("the emulator ended")

    def _follow(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            word, *values = line.split()
            if word == "done":
                with self._news:
                    self._done_s.append(self.clock.at(int(values[0])))
                    self._news.notify_all()
                continue
            letter, port, direction, cycle = values
            last = self.edges[-1]
            edge = Edge(
                int(cycle),
                self.clock.at(int(cycle)),
                {**last.ports, letter: int(port, 16)},
                {**last.directions, letter: int(direction, 16)},
            )
            with self._news:
                self.edges.append(edge)
                self._news.notify_all()
            for told in self.on_edge:
                told(last, edge)


class MotorController:
    """Emulated motor controller: it sets the busy line for a while after the drive line was set; the force sensor has
    no load.

    Parameters
    ----------
    board : EmulatedBoard
        Board to which the motor controller is connected.
    seconds : callable
        Duration of the step with a given code, in seconds.
    """

    def __init__(self, board: EmulatedBoard, seconds: Callable[[int], float]) -> None:
        self.codes: list[int] = []
        self._board, self._seconds = board, seconds
        self._until_s: float | None = None
        self._news, self._closed = Condition(), False
        board.outside(Role.BUSY, False)
        board.outside(Role.ALARM, False)
        board.say(f"adc 0 {UNLOADED_MV}")
        board.on_edge.append(self._on_edge)
        self._thread = Thread(target=self._work, daemon=True)
        self._thread.start()

    def _on_edge(self, before: Edge, now: Edge) -> None:
        drive = WIRING[Role.DRIVE].pin
        if before.level(drive) != 1 and now.level(drive) == 1:
            code = sum((now.level(WIRING[role].pin) or 0) << bit for bit, role in enumerate(SELECT))
            self.codes.append(code)
            self._begin(code)
        elif before.level(drive) == 1 and now.level(drive) != 1:
            with self._news:
                if self._until_s is not None:  # the board released the drive line during a motion
                    self._until_s = self._board.clock.now_s()
                    self._news.notify_all()

    def _begin(self, code: int) -> None:
        with self._news:
            self._board.outside(Role.BUSY, True)
            self._until_s = self._board.clock.now_s() + self._seconds(code)
            self._news.notify_all()

    def _work(self) -> None:
        with self._news:
            while not self._closed:
                left_s = None if self._until_s is None else self._until_s - self._board.clock.now_s()
                if left_s is not None and left_s <= 0.0:
                    self._until_s = None
                    self._board.outside(Role.BUSY, False)
                else:
                    self._news.wait(left_s)

    def close(self) -> None:
        """End the thread of the motor controller."""
        with self._news:
            self._closed = True
            self._news.notify_all()
        self._thread.join()


@contextmanager
def running(host_and_sketch: tuple[Path, Path], slower: int = 1) -> Iterator[EmulatedBoard]:
    """Context with a running board, which is switched off at the end."""
    board = EmulatedBoard(*host_and_sketch, slower)
    try:
        yield board
    finally:
        board.close()
