"""Connection to a board: commands and their answers, streamed messages, and the board's watchdog.

A thread of the link reads messages from the board all the time. The thread also requests the state every few
milliseconds: this shows the board that the computer works, shows the link that the board works, and synchronises the
clocks of board and computer.
"""

import random
from abc import ABC, abstractmethod
from contextlib import suppress
from threading import Condition, Lock, Thread

import serial

from fingervision.domain.errors import DeviceError, FingervisionError
from fingervision.testbed.board import wire
from fingervision.testbed.clocks.clock import Clock, ClockJoin, JoinedClock

BAUD = 115200
# Longest wait for input in the link's thread, which must send messages regularly to keep the board awake.
READ_TIMEOUT_S = 0.005
ASK_EVERY_S = 0.02
# Interval at which a stop is repeated until it is confirmed. It must be longer than a question and its answer take (3.5
# ms); otherwise the answers would block force samples for a tenth of a second.
STOP_EVERY_S = 0.005
# An answer takes 3 ms on the line, and up to 16 ms more in the buffers of a USB adapter.
ANSWER_WITHIN_S, TRIES = 0.1, 5
# The motor is at rest much earlier, because the board switches off the drive line by itself.
LOST_AFTER_S = 1.0
REFIT_EVERY_S = 0.25
# Shortest duration of a byte of ten bits; the 115200 baud of an ATmega328P are 2.1 % too fast (data sheet, table of
# baud rates).
BYTE_S = 10.0 / BAUD / 1.03
LONGEST_LINE = 80
US_PER_S = 1_000_000
# Commands and questions are numbered separately, so that a question between them never hides a repeated command.
NUMBERS = 128


class BoardRefusalError(DeviceError):
    """The board did not execute a command; `reason` is the cause, as stated by the board."""

    def __init__(self, port: str | None, reason: str) -> None:
        super().__init__(f"The board on {port} refused a command ({reason}).")
        self.reason = reason


class BoardLink(ABC):
    """The connection through one open port; a subclass receives its messages, in the thread of the connection.

    Parameters
    ----------
    port : serial.Serial
        The open port.
    clock : Clock
        Clock of the computer; it must run in real time (a virtual clock does not advance while the board works).

    Attributes
    ----------
    joined : JoinedClock or None
        Relation of the board's clock to the computer's; None in the first moments.
    stopping : bool
        Whether a stop was requested that the board has not yet confirmed.
    """

    def __init__(self, port: serial.Serial, clock: Clock) -> None:
        self.damaged_lines = 0
        self._port, self._clock = port, clock
        self._session: int | None = None
        self._failure: str | None = None
        self._awake = self.stopping = False
        self._closed = False
        self._news = Condition()
        self._one_command, self._writing = Lock(), Lock()
        self._answers: dict[int, wire.Message] = {}
        self._command, self._question = random.SystemRandom().randrange(NUMBERS), 0
        self._asked_s: dict[int, float] = {}
        self._last_asked_s = self._last_heard_s = self._last_fit_s = clock.now_s()
        self._time_us = wire.Unwrapped(32)
        self._join = ClockJoin()
        self.joined: JoinedClock | None = None
        self._thread = Thread(target=self._read_on, name=f"board on {port.name}", daemon=True)
        self._thread.start()

    @abstractmethod
    def on_message(self, message: wire.Answer | wire.Change | wire.Sample, board_s: float) -> None:
        """Receive a state (about fifty in a second), a change of lines or a force sample, with the board's time."""

    def keep_awake(self, session: int) -> None:
        """Start to request the state; fail if the board is lost or was reset."""
        self._session = session
        self._last_heard_s = self._clock.now_s()
        self._awake = True

    def check(self) -> None:
        """Raise an error if the connection is lost."""
        if self._failure is not None:
            raise DeviceError(self._failure)

    def wait(self, seconds: float) -> None:
        """Wait until a message has come from the board, at most for the given number of seconds."""
        with self._news:
            if self._failure is None:
                self._news.wait(seconds)
        self.check()

    def command(self, words: str, within_s: float = ANSWER_WITHIN_S) -> wire.Answer | wire.Identity:
        """Send a command, repeat the command if the response is lost, and return the response.

        The board executes a repeated command only once, because every command has a number.

        Raises
        ------
        DeviceError
            The connection is lost.
        BoardRefusalError
            The board refused to execute the command.
        """
        with self._one_command:
            self._command = (self._command + 1) % NUMBERS
            line = wire.encoded(f"{self._command:02X} {words}")
            for _ in range(TRIES):
                with self._news:
                    self._answers.pop(self._command, None)
                self._send(line)
                answer = self._answer(self._command, within_s)
                if isinstance(answer, wire.Refusal):
                    raise BoardRefusalError(self._port.name, answer.reason)
                if isinstance(answer, wire.Answer | wire.Identity):
                    return answer
        raise DeviceError(
            f"The board on {self._port.name} must answer within {within_s:g} s, but did not, {TRIES} times: is it the "
            "right port, and is the sketch in fingervision/testbed/firmware uploaded?"
        )

    def stop(self) -> None:
        """Let the link's thread send a stop to the board, repeatedly until the board confirms the stop.

        `stop` only sets a flag, so that a signal handler may call it at any time.
        """
        self.stopping = True

    def disconnect(self) -> None:
        """Close the port; closing twice is allowed."""
        self._closed = True
        self._thread.join(timeout=1.0)
        with suppress(OSError, serial.SerialException):
            self._port.close()

    def _answer(self, number: int, within_s: float) -> wire.Message | None:
        until_s = self._clock.now_s() + within_s
        with self._news:
            while number not in self._answers and self._failure is None:
                left_s = until_s - self._clock.now_s()
                if left_s <= 0.0:
                    return None
                self._news.wait(left_s)
            self.check()
            return self._answers.pop(number)

    def _send(self, line: bytes) -> None:
        try:
            with self._writing:
                self._port.write(line)
        except (OSError, serial.SerialException) as error:
            self._fail(self._pulled(error))
        self.check()

    def _pulled(self, error: Exception) -> str:
        return (
            f"The board on {self._port.name} was lost ({error}): check that its cable is plugged in, and start again."
        )

    def _fail(self, sentence: str) -> None:
        with self._news:
            if self._failure is None and not self._closed:
                self._failure = sentence
            self._news.notify_all()

    def _read_on(self) -> None:
        rest = b""
        while not self._closed and self._failure is None:
            try:
                rest += self._port.read(max(1, self._port.in_waiting))
            except (
                OSError,
                serial.SerialException,
                TypeError,
            ) as error:  # TypeError: another thread has closed the port
                self._fail(self._pulled(error))
                return
            got_s = self._clock.now_s()
            *lines, rest = rest.split(b"\n")
            rest = rest[-LONGEST_LINE:]
            for line in lines:
                self._take(line, got_s)
            if lines:
                with self._news:
                    self._news.notify_all()
            if self._awake:
                self._stay_awake(got_s)

    def _take(self, line: bytes, got_s: float) -> None:
        message = wire.decoded(line)
        if message is None:
            self.damaged_lines += 1
            return
        self._last_heard_s = got_s
        if isinstance(message, wire.Sample | wire.Change):
            self.on_message(message, self._time_us.of(message.time_us) / US_PER_S)
            return
        if isinstance(message, wire.Answer) and self._session is not None:
            if message.session != self._session:
                self._fail(
                    f"The board on {self._port.name} was reset during the run, by its button, its power supply or "
                    "another program; all its lines are off: start again."
                )
                return
            if message.cause != wire.GOING:
                self.stopping = False
            board_s = self._time_us.of(message.time_us) / US_PER_S
            if message.number in self._asked_s:
                self._join.add(board_s, self._asked_s.pop(message.number), got_s - BYTE_S * (len(line) + 1))
            self.on_message(message, board_s)
        if message.number < NUMBERS:
            with self._news:
                self._answers[message.number] = message

    def _stay_awake(self, now_s: float) -> None:
        if now_s - self._last_heard_s > LOST_AFTER_S:
            self._fail(
                f"The board on {self._port.name} was lost: it has sent no message for {LOST_AFTER_S:g} s. Check its "
                "cable and its power supply, and start again."
            )
            return
        if now_s - self._last_asked_s >= (STOP_EVERY_S if self.stopping else ASK_EVERY_S):
            self._ask("Z" if self.stopping else "S")
        if now_s - self._last_fit_s >= REFIT_EVERY_S or self.joined is None:
            self._last_fit_s = now_s
            self.joined = self._join.joined()

    def _ask(self, words: str) -> None:
        self._question = (self._question + 1) % NUMBERS
        number = NUMBERS + self._question
        line = wire.encoded(f"{number:02X} {words}")
        self._last_asked_s = self._clock.now_s()
        self._asked_s[number] = self._last_asked_s + BYTE_S * len(line)
        with suppress(FingervisionError):
            self._send(line)
