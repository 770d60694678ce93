"""One motion by parallel lines: select, settle, drive, busy, not busy; each phase has its own time limit."""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Event

from fingervision.domain.board_settings import Role
from fingervision.domain.errors import DeviceError
from fingervision.testbed.board import wire
from fingervision.testbed.board.board import Board
from fingervision.testbed.clocks.clock import Clock

LINE_WITHIN_S = 0.3
WAIT_S = 0.01


@contextmanager
def _no_collection() -> Iterator[None]:
    """Suspend Python's cyclic garbage collection, which may stop all threads for 0.1 s.

    The board would interpret a pause of the computer as a lost connection, and stop the motor.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


@dataclass(frozen=True, slots=True)
class Handshake:
    """The signal lines of one board.

    Parameters
    ----------
    board : Board
        The board, after its set-up.
    clock : Clock
        Clock of the test bed.
    busy_s : float
        Longest time between the drive line and the controller's busy signal.
    stopped : threading.Event
        Event that is set when the motion should end.
    """

    board: Board
    clock: Clock
    busy_s: float
    stopped: Event

    def run(self, code: int, at_most_s: float, on_driven: Callable[[float], None]) -> bool:
        """Execute the step of a code to its end; return False if it was stopped, or ended by the board.

        Parameters
        ----------
        code : int
            Code on the select lines.
        at_most_s : float
            Longest duration of the motion.
        on_driven : callable
            Called with the computer's time at which the drive line rose.

        Raises
        ------
        DeviceError
            A phase of the handshake did not occur; the drive line is then off.
        """
        with _no_collection():
            return self._run(code, at_most_s, on_driven)

    def _run(self, code: int, at_most_s: float, on_driven: Callable[[float], None]) -> bool:
        self.board.run(code, self.busy_s + at_most_s)
        within_s = 1e-3 * self.board.settings.settle_ms + LINE_WITHIN_S
        driven = self._came(wire.Levels.DRIVE, within_s, "the board has not raised its drive line")
        if not driven:
            return False
        # If the message of this change was damaged, the change was found in the reported state: take the present time.
        at_s, now_s = self.board.driven_board_s, self.clock.now_s()
        on_driven(now_s if at_s is None else min(self.board.clock.host_at(at_s), now_s))
        done = (
            self._came(wire.Levels.BUSY_SEEN, self.busy_s, "the motor controller has not become busy")
            and self._went(wire.Levels.BUSY, at_most_s, "the motor controller was still busy")
        )  # fmt: skip
        if not done:
            return False
        self.board.release()
        if Role.IN_POSITION in self.board.settings.lines:
            return self._came(
                wire.Levels.IN_POSITION, LINE_WITHIN_S, "the motor controller has not signalled that it is in position"
            )
        return True

    def _came(self, level: wire.Levels, within_s: float, otherwise: str) -> bool:
        return self._until(lambda: level in self.board.levels, within_s, f"{otherwise} within {within_s:.3g} s")

    def _went(self, level: wire.Levels, within_s: float, otherwise: str) -> bool:
        return self._until(lambda: level not in self.board.levels, within_s, f"{otherwise} after {within_s:.3g} s")

    def _until(self, holds: Callable[[], bool], within_s: float, otherwise: str) -> bool:
        until_s = self.clock.now_s() + within_s
        while not holds():
            if self._ended():
                return False
            if self.clock.now_s() > until_s:
                self.board.stop()
                raise DeviceError(
                    f"A motion was interrupted, because {otherwise}: check the wiring, and home the stage."
                )
            self.board.wait(WAIT_S)
        return not self._ended()

    def _ended(self) -> bool:
        return self.stopped.is_set() or self.board.dropped is not None
