"""A board after its set-up, with its lines, its force channel and its clock."""

import random
from collections import deque
from dataclasses import dataclass
from math import ceil
from threading import Lock
from typing import NoReturn

import serial

from fingervision.domain.board_settings import BoardSettings, Role
from fingervision.domain.errors import DeviceError, FingervisionError
from fingervision.storage.board_toml import read_board
from fingervision.storage.toml_section import Section
from fingervision.testbed.board import wire
from fingervision.testbed.board.link import ASK_EVERY_S, BAUD, READ_TIMEOUT_S, BoardLink, BoardRefusalError
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import FEWEST, Clock, JoinedClock
from fingervision.testbed.serial_port import opened_port

# Opening the port may reset the board, which then starts its sketch within two seconds.
STARTS_WITHIN_S = 1.0
JOINED_WITHIN_S = 20 * FEWEST * ASK_EVERY_S
# Number of unread samples that are kept: the newest ten minutes at 200 Hz.
MOST_SAMPLES = 120_000
DROPPED = {
    "w": "the board received no message from this program for {silence_ms} ms (is the computer overloaded?)",
    "l": "the motion took longer than its time limit",
    "a": "the motor controller raised its alarm",
    "h": "this program stopped it",
}


@dataclass(frozen=True, slots=True)
class ForceSample:
    """Level of the force channel, 0 to 1023, with the time on the board's clock."""

    board_s: float
    level: int


class Board(BoardLink):
    """A board, opened by `opened`. Several parts of a test bed may use the same board.

    Parameters
    ----------
    settings : BoardSettings
        Wiring of the board.
    port : serial.Serial
        The open port.
    clock : Clock
        Clock of the computer.

    Attributes
    ----------
    dropped_code : str
        The board's code for the reason why the drive line was released.
    driven_board_s : float or None
        Time of the drive line's last rising edge since the last `run`, on the board's clock (s).
    lost_samples : int
        Number of force samples that did not arrive.
    """

    def __init__(self, settings: BoardSettings, port: serial.Serial, clock: Clock) -> None:
        self.settings = settings
        self.name = f"{wire.NAME} on {settings.port}"
        self.lost_samples = 0
        self._levels, self.dropped_code = wire.Levels(0), wire.GOING
        self._users = 0
        self.driven_board_s: float | None = None
        self._samples: deque[ForceSample] = deque(maxlen=MOST_SAMPLES)
        self._numbers = wire.Unwrapped(16)
        self._next_number: int | None = None
        self._guard = Lock()
        super().__init__(port, clock)  # from now on, messages come

    @property
    def levels(self) -> wire.Levels:
        """Active output lines of the board, as last reported."""
        self.check()
        return self._levels

    @property
    def dropped(self) -> str | None:
        """Reason in words why the drive line was released; None if the drive line was not released."""
        words = DROPPED.get(self.dropped_code)
        return None if words is None else words.format(silence_ms=self.settings.silence_ms)

    @property
    def clock(self) -> JoinedClock:
        """Relation of the board's clock to the computer's clock."""
        assert self.joined is not None  # noqa: S101 - a board is opened only with its clock joined
        return self.joined

    def run(self, code: int, at_most_s: float) -> None:
        """Set the select lines, wait until they have settled, and raise the drive line.

        The board releases the drive line after `at_most_s` at the latest.
        """
        self.driven_board_s = None
        self._do(f"R {code:X} {ceil(1e3 * at_most_s):X}")

    def release(self) -> None:
        """Lower the drive line."""
        self._do("X")

    def wait_for_stop(self) -> None:
        """Wait until a requested stop has been executed: drive and enable line released, hold line raised."""
        while self.stopping:
            self.wait(ASK_EVERY_S)

    @property
    def ready(self) -> bool:
        """Whether a motion may begin: no fault has switched the drive off, and the enable line (if any) is high."""
        enabled = Role.ENABLE not in self.settings.lines or wire.Levels.ENABLE in self.levels
        return enabled and self.dropped is None

    def clear(self) -> None:
        """Allow motions, initially and after a stop: release the hold line, raise the enable line."""
        self._do("K")
        self.dropped_code = wire.GOING
        if Role.ENABLE in self.settings.lines:
            self._do("E 1")

    def samples(self) -> tuple[ForceSample, ...]:
        """Force samples since the last call."""
        with self._guard:
            taken = tuple(self._samples)
            self._samples.clear()
        if not taken:
            self.check()
        return taken

    def hold(self) -> "Board":
        """Register a further part of the test bed that uses the board."""
        self._users += 1
        return self

    def close(self) -> None:
        """Unregister one part of the test bed; when the last one unregisters, release all lines and close the port."""
        self._users -= 1
        if self._users != 0:
            return
        try:
            self.command("U")
        except FingervisionError:
            return  # the board is disconnected; its watchdog has switched off the lines
        finally:
            self.disconnect()

    def on_message(self, message: wire.Answer | wire.Change | wire.Sample, board_s: float) -> None:
        """Note the state, changed lines, or a force sample."""
        match message:
            case wire.Answer():
                self._levels, self.dropped_code = message.levels, message.cause
            case wire.Change():
                if message.levels & ~self._levels & wire.Levels.DRIVE:
                    self.driven_board_s = board_s
                self._levels = message.levels
            case wire.Sample():
                number = self._numbers.of(message.number)
                if self._next_number is not None:
                    self.lost_samples += max(number - self._next_number, 0)
                self._next_number = number + 1
                with self._guard:
                    self._samples.append(ForceSample(board_s, message.level))

    def set_up(self) -> None:
        """Check the board's identity, state its wiring and watchdog, and wait until its clock is known.

        Raises
        ------
        DeviceError
            Nothing answers, the board has another firmware, or its sketch cannot drive the stated wiring.
        """
        settings = self.settings
        identity = self.command("I", STARTS_WITHIN_S)
        if not isinstance(identity, wire.Identity) or identity.name != wire.NAME:
            raise DeviceError(f"The board on {settings.port} must run the sketch {wire.NAME}, but does not: upload it.")
        if identity.protocol != wire.PROTOCOL:
            raise DeviceError(
                f"The board on {settings.port} must speak protocol {wire.PROTOCOL}, but its firmware "
                f"{identity.version} speaks {identity.protocol}: upload the sketch of this fingervision "
                "(fingervision/testbed/firmware)."
            )
        self.name = f"{identity.name} {identity.version} on {settings.port}"
        session = random.SystemRandom().randrange(1, 0x10000)
        self.command("U")
        for role, line in sorted(settings.lines.items()):
            self.command(f"M {int(role):X} {line.pin:X} {int(line.active_high)}")
        times = f"{settings.force_period_ms:X} {settings.silence_ms:X} {settings.settle_ms:X}"
        started = self.command(f"G {session:X} {times}")
        assert isinstance(started, wire.Answer)  # noqa: S101 - only I is answered otherwise
        self.on_message(started, 0.0)
        self.keep_awake(session)
        until_s = self._clock.now_s() + JOINED_WITHIN_S
        while self.joined is None:
            if self._clock.now_s() > until_s:
                raise DeviceError(
                    f"{self.name} must send readable replies, but most of them are damaged: check its cable."
                )
            self.wait(ASK_EVERY_S)

    def _do(self, words: str) -> None:
        try:
            self.command(words)
        except BoardRefusalError as refusal:
            self._explain(refusal.reason)

    def _explain(self, reason: str) -> NoReturn:
        sentences = {
            "alarm": "The motor controller must have no alarm, but its alarm line is active: clear it there.",
            "busy": "The motor must be at rest before a new motion, but the motor controller's busy line is active.",
            "stopped": f"The board must be cleared before a new motion, because {self.dropped or 'it was stopped'}: "
            "home the stage.",
        }
        raise DeviceError(
            sentences.get(
                reason, f"{self.name} refused a command ({reason}): start the program again to set up the board."
            )
        )


def opened(settings: BoardSettings, clock: Clock) -> Board:
    """Open a board and set it up; each part that uses the board then calls `hold`.

    Raises
    ------
    DeviceError
        There is no such port, another program has it, nothing answers, it has another firmware, or its sketch cannot
        drive the stated wiring.
    """
    board = Board(settings, opened_port(settings.port, BAUD, READ_TIMEOUT_S), clock)
    try:
        board.set_up()
    except BaseException:
        board.disconnect()
        raise
    return board


KEY = "board"


def board_of(section: Section, context: BuildContext) -> Board:
    """Return the board named by the key `board` of a part's section; it is opened once.

    Raises
    ------
    DataError, DeviceError, InputFileError
        The board's settings are invalid, or the board cannot be opened.
    """
    path = context.folder / section.word(KEY)
    name = f"{KEY} {path.resolve()}"
    if name not in context.shared:
        context.shared[name] = opened(read_board(path), context.clock)
    board: Board = context.shared[name]
    return board.hold()
