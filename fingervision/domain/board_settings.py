"""Settings of a microcontroller board: its wiring to a motor controller and a force sensor, and its time limits."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum


class Role(IntEnum):
    """Function of a pin of the board; the numbers are defined by the Arduino sketch of the board (`lines.h`)."""

    SELECT_0 = 0
    SELECT_1 = 1
    SELECT_2 = 2
    SELECT_3 = 3
    DRIVE = 4
    ENABLE = 5
    HOLD = 6
    BUSY = 7
    ALARM = 8
    IN_POSITION = 9
    FORCE = 10


SELECT = (Role.SELECT_0, Role.SELECT_1, Role.SELECT_2, Role.SELECT_3)
NEEDED_TO_MOVE = (*SELECT, Role.DRIVE, Role.BUSY, Role.ALARM)


@dataclass(frozen=True, slots=True)
class Line:
    """One digital or analogue line between the board and a device.

    Parameters
    ----------
    pin : int
        Pin number of the Arduino: 2 to 13 are D2 to D13, 14 to 19 are A0 to A5.
    active_high : bool
        Whether the high level means true.
    """

    pin: int
    active_high: bool = True


@dataclass(frozen=True, slots=True)
class BoardSettings:
    """A microcontroller board: its port, its wiring, and its time limits.

    Parameters
    ----------
    port : str
        Name of the serial port to which the board is connected.
    lines : mapping of Role to Line
        The wiring. It contains all of the roles `NEEDED_TO_MOVE` or none of them; a board without these roles serves as
        a force sensor only.
    force_period_ms : int
        Time between two samples of the force, in ms.
    silence_ms : int
        Time without a received message, in ms, after which the board switches the drive line off.
    settle_ms : int
        Time between setting the select lines and setting the drive line, in ms; 0 if all of them change at the same
        instant.
    """

    port: str
    lines: Mapping[Role, Line]
    force_period_ms: int = 5
    silence_ms: int = 80
    settle_ms: int = 5

    @property
    def moves(self) -> bool:
        """Whether a motor controller is wired to the board."""
        return Role.DRIVE in self.lines

    @property
    def senses_force(self) -> bool:
        """Whether a force sensor is wired to the board."""
        return Role.FORCE in self.lines
