"""A force sensor with an analogue output, which the board's analogue-to-digital converter reads."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fingervision.domain.errors import DeviceError
from fingervision.storage.toml_section import Section
from fingervision.testbed.board.board import KEY, Board, board_of
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.force_sensor import Reading

KEYS = (KEY, "volts", "newtons", "reference_v")
SIMULATED = False
CONVERTER_STEPS = 1024
REFERENCE_V = 5.0
# Longest delay of a sample: a few lines on the serial port, and the buffer of a USB adapter.
ON_ITS_WAY_S = 0.1
WAIT_S = 0.005


class BoardForceSensor:
    """Force sensor that converts volts to newtons by a measured table.

    Parameters
    ----------
    board : Board
        The board, after its set-up, with a force line.
    volts, newtons : sequence of float, length n
        Calibration table with increasing volts. The force is interpolated linearly between rows, and extrapolated
        linearly beyond them, so that an overload is not underestimated.
    reference_v : float
        Reference voltage of the converter (AVcc, the board's 5 V).
    clock : Clock
        Clock of the test bed.
    """

    def __init__(
        self, board: Board, volts: Sequence[float], newtons: Sequence[float], reference_v: float, clock: Clock
    ) -> None:
        self.full_scale_n = float(max(abs(value) for value in newtons))
        self._board, self._clock, self._reference_v = board, clock, reference_v
        self._volts, self._newtons = np.array(volts), np.array(newtons)
        self._closed = False

    @property
    def name(self) -> str:
        """Names of board, port and firmware."""
        return f"force sensor at {self._board.name}"

    def readings(self) -> tuple[Reading, ...]:
        """Forces since the last call, each with bounds of its time on the computer's clock.

        Raises
        ------
        DeviceError
            The board is lost, or sends no samples.
        """
        until_s = self._clock.now_s() + 1e-3 * self._board.settings.force_period_ms + ON_ITS_WAY_S
        samples = self._board.samples()
        while not samples and self._clock.now_s() < until_s:
            self._board.wait(WAIT_S)
            samples = self._board.samples()
        if not samples:
            raise DeviceError(
                f"{self._board.name} must send force samples, but has sent none for some time: check the connection of "
                "the board."
            )
        clock = self._board.clock
        return tuple(
            Reading(sample.board_s, *clock.bounds_at(sample.board_s), self.force_n(sample.level)) for sample in samples
        )

    def force_n(self, level: int) -> float:
        """Force (N) at a level of the analogue-to-digital converter, evaluated at the middle of the level's step."""
        volts, newtons = self._volts, self._newtons
        at_v = (level + 0.5) * self._reference_v / CONVERTER_STEPS
        if volts[0] <= at_v <= volts[-1]:
            return float(np.interp(at_v, volts, newtons))
        a, b = (0, 1) if at_v < volts[0] else (-2, -1)
        slope = (newtons[b] - newtons[a]) / (volts[b] - volts[a])
        return float(newtons[a] + slope * (at_v - volts[a]))

    def close(self) -> None:
        """Release the board."""
        if not self._closed:
            self._closed = True
            self._board.close()


def build(section: Section, context: BuildContext) -> BoardForceSensor:
    """Build the sensor from its section of the configuration."""
    volts, newtons = _column(section, "volts"), _column(section, "newtons")
    if len(newtons) != len(volts):
        section.refuse("newtons", f"must have as many values as volts ({len(volts)}), but has {len(newtons)}.")
    if any(b <= a for a, b in pairwise(volts)):
        section.refuse("volts", f"must increase, but is {volts!r}.")
    reference_v = section.number("reference_v", REFERENCE_V, above=0.0)
    board = board_of(section, context)
    if not board.settings.senses_force:
        board.close()
        section.refuse(KEY, "must have a force sensor on its lines, but has none: add its force line.")
    return BoardForceSensor(board, volts, newtons, reference_v, context.clock)


def _column(section: Section, key: str) -> list[float]:
    raw = section.values.get(key)
    if raw is None:
        section.refuse(None, f"must state {key}, a list of at least two numbers, but does not: add it.")
    if not isinstance(raw, list) or len(raw) < 2 or not all(isinstance(each, int | float) for each in raw):
        section.refuse(key, f"must be a list of at least two numbers, but is {raw!r}.")
    return [float(each) for each in raw]
