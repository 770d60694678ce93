"""Messages between computer and board, one per line, as defined by the board's sketch (`firmware/README.md`).

A line is `words*CRC` with a line feed; the CRC is CRC-16/XMODEM of the words, in four hexadecimal digits.
"""

from binascii import crc_hqx
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntFlag

PROTOCOL = 1
NAME = "fingervision-board"
# Cause reported by a board that has not switched off its drive line.
GOING = "-"


class Levels(IntFlag):
    """Lines that are active."""

    DRIVE = 1
    ENABLE = 2
    HOLD = 4
    BUSY = 8
    ALARM = 16
    IN_POSITION = 32
    BUSY_SEEN = 64


@dataclass(frozen=True, slots=True)
class Identity:
    """Identity that a board reports about itself."""

    number: int
    name: str
    protocol: int
    version: str


@dataclass(frozen=True, slots=True)
class Answer:
    """Response of the board to an executed command, with the state after it.

    Parameters
    ----------
    number : int
        Number of the command.
    time_us : int
        Time on the board's clock at which the command was received; wraps at 2**32.
    session : int
        Number of the set-up; 0 after a reset.
    levels : Levels
        Active lines.
    changes : int
        Number of changes of lines noticed by the board, wrapping at 256.
    cause : str
        Reason why the drive line was released: w no message from the computer, l motion too long, a alarm, h by the
        computer, - not released.
    """

    number: int
    time_us: int
    session: int
    levels: Levels
    changes: int
    cause: str


@dataclass(frozen=True, slots=True)
class Refusal:
    """Response of the board to a command that was not executed, with the reason in one word."""

    number: int
    reason: str


@dataclass(frozen=True, slots=True)
class Sample:
    """Level of the force channel, with its number (modulo 65536) and the board's time."""

    number: int
    time_us: int
    level: int


@dataclass(frozen=True, slots=True)
class Change:
    """New levels of the board's lines after a change, with its number (modulo 256) and the board's time."""

    number: int
    time_us: int
    levels: Levels


Message = Identity | Answer | Refusal | Sample | Change


def encoded(words: str) -> bytes:
    r"""Encode a message as a line.

    Examples
    --------
    >>> encoded("00 I")
    b'00 I*3647\n'
    """
    text = words.encode("ascii")
    return b"%s*%04X\n" % (text, crc_hqx(text, 0))


def decoded(line: bytes) -> Message | None:
    r"""Decode a line without its line feed; None if it is damaged.

    Examples
    --------
    >>> decoded(encoded("N 05 busy").rstrip())
    Refusal(number=5, reason='busy')
    >>> decoded(b"N 05 bvsy*0000") is None
    True
    """
    text, star, crc = line.rpartition(b"*")
    if not star or crc != b"%04X" % crc_hqx(text, 0):
        return None
    try:
        kind, *words = text.decode("ascii").split(" ")
        return _READERS[kind](*words)
    except (UnicodeDecodeError, KeyError, TypeError, ValueError):
        return None


def _hex(word: str) -> int:
    return int(word, 16)


_READERS: dict[str, Callable[..., Message]] = {
    "I": lambda number, name, protocol, version: Identity(_hex(number), name, _hex(protocol), version),
    "A": lambda number, time, session, levels, changes, cause: Answer(
        _hex(number), _hex(time), _hex(session), Levels(_hex(levels)), _hex(changes), cause
    ),
    "N": lambda number, reason: Refusal(_hex(number), reason),
    "F": lambda number, time, level: Sample(_hex(number), _hex(time), _hex(level)),
    "L": lambda number, time, levels: Change(_hex(number), _hex(time), Levels(_hex(levels))),
}


class Unwrapped:
    """Counts beyond the range of a wrapping counter: each total is the one nearest to the last total.

    Parameters
    ----------
    bits : int
        The counter wraps at 2**bits.
    """

    def __init__(self, bits: int) -> None:
        self._turn = 1 << bits
        self._last: int | None = None

    def of(self, value: int) -> int:
        """Return the total count for a value of the wrapping counter."""
        if self._last is None:
            self._last = value
        ahead = (value - self._last + self._turn // 2) % self._turn - self._turn // 2
        count = self._last + ahead
        self._last = max(self._last, count)
        return count
