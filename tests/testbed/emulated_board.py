"""The real sketch on an emulated ATmega328P, with a motor controller and a force on its pins."""

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
# What the force sensor's amplifier gives without a load: a live zero.
UNLOADED_MV = 500
# The host's clock began at another time than the board's, whose resonator is fast by as much as one may be.
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
    """Why the sketch cannot be run here; None if it can."""
    tools = [tool for tool in ("gcc", "avr-gcc", "avr-g++") if shutil.which(tool) is None]
    if not ARDUINO.is_dir():
        tools.append("arduino-core-avr")
    if not Path("/usr/include/simavr/sim_avr.h").is_file():
        tools.append("libsimavr-dev")
    return f"needs {', '.join(tools)}" if tools else None


def compiled(folder: Path) -> tuple[Path, Path]:
    """The host that runs a sketch, and the sketch."""
    host, elf = folder / "avrhost", folder / "board.elf"
    _run("gcc", "-O2", "-I/usr/include/simavr", "-o", host, HERE / "avrhost.c", "-lsimavr", "-lelf", "-lutil")
    common = (
        "-mmcu=atmega328p", f"-DF_CPU={HERTZ}UL", "-DARDUINO=10819", "-DARDUINO_AVR_UNO", "-DARDUINO_ARCH_AVR",
        # gcc-avr 5 lacks the name that WString.cpp uses.
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

    `host_s` is the time of it on the host's clock.
    """

    cycle: int
    host_s: float
    ports: dict[str, int]
    directions: dict[str, int]

    def level(self, pin: int) -> int | None:
        """Level that the board drives a pin to; None if it is an input."""
        letter, bit = ("D", pin) if pin < 8 else ("B", pin - 8) if pin < 14 else ("C", pin - 14)
        return self.ports[letter] >> bit & 1 if self.directions[letter] >> bit & 1 else None


class Shared:
    """Numbers that emulator and computer share: the cycle, and how many bytes went out and in at either end.

    Parameters
    ----------
    path : Path
        Of the file that both map.
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
        """Count what goes through an open port from now on."""
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
    """A host's clock that goes with the emulated crystal, however fast the emulator gets on.

    Parameters
    ----------
    shared : Shared
        Where the emulator shows its cycle.
    """

    def __init__(self, shared: Shared) -> None:
        self._shared = shared

    def now_s(self) -> float:
        """Seconds."""
        return self.at(self._shared[Shared.CYCLE])

    def wait_until(self, time_s: float) -> None:
        """Sleep until then."""
        while self.now_s() < time_s:
            sleep(1e-3)

    def at(self, cycle: int) -> float:
        """Seconds at a cycle of the crystal."""
        return BEGAN_S + CRYSTAL_SLOW_BY * cycle / HERTZ


class EmulatedBoard:
    """A running board, wired as `WIRING` says.

    Parameters
    ----------
    host, elf : Path
        As `compiled` makes them.
    slower : int
        How many times slower than in truth. Emulating takes most of a processor in real time; in slow motion, with the
        computer's side of the connection living in `clock`, the same happens on a machine that has other work.
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
        """Settings for it."""
        return BoardSettings(port=self.port, lines=WIRING, **others)

    def say(self, words: str) -> int:
        """Tell the host to change something outside; give the number of that command."""
        assert self._process.stdin is not None
        with self._news:
            self._process.stdin.write(words + "\n")
            self._said += 1
            return self._said - 1

    def done_s(self, command: int) -> float:
        """Wait until a command was done; when that was, on the host's clock."""
        with self._news:
            self._news.wait_for(lambda: len(self._done_s) > command)
            return self._done_s[command]

    def outside(self, role: Role, on: bool) -> None:
        """Let a line from the motor controller say yes or no."""
        line = WIRING[role]
        self.say(f"pin {line.pin} {int(on == line.active_high)}")

    def wait_for(self, edge: Callable[[Edge], bool], within_s: float = 5.0, since: int = 0) -> Edge:
        """The first change from `since` on for which something holds."""
        until_s = self.clock.now_s() + within_s
        with self._news:
            while True:
                for each in self.edges[since:]:
                    if edge(each):
                        return each
                assert self.clock.now_s() < until_s, "the board did not do it"
                self._news.wait(0.05)

    def close(self) -> None:
        """Switch it off."""
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
    """Answers the drive line with busy, for a while, as a motor controller does; the force sensor is not loaded.

    Parameters
    ----------
    board : EmulatedBoard
        Whose lines it is on.
    seconds : callable
        How long a step of a code takes.
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
                if self._until_s is not None:  # the drive line was dropped in the middle of a motion
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
        """End its thread."""
        with self._news:
            self._closed = True
            self._news.notify_all()
        self._thread.join()


@contextmanager
def running(host_and_sketch: tuple[Path, Path], slower: int = 1) -> Iterator[EmulatedBoard]:
    """A board that is switched off at the end."""
    board = EmulatedBoard(*host_and_sketch, slower)
    try:
        yield board
    finally:
        board.close()
