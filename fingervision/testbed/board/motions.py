"""Motions through a board: handshakes one after another in a separate thread, and the resulting position."""

from collections.abc import Sequence
from dataclasses import dataclass
from threading import Event, Thread

from fingervision.domain.errors import FingervisionError
from fingervision.domain.step_data import Coordinates
from fingervision.testbed.board.board import Board
from fingervision.testbed.board.controller_settings import Waits
from fingervision.testbed.board.handshake import Handshake
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.motion.commanded_path import CommandedPath
from fingervision.testbed.motion.motion_profile import MotionProfile
from fingervision.testbed.motion.step_checks import PlannedMotion

STILL = MotionProfile(0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Run:
    """One handshake: a code, its time limit, and its change of position (None for the return to the reference)."""

    code: int
    at_most_s: float
    motion: PlannedMotion | None


class Motions:
    """Executes handshakes, and computes the position from their profiles, because parallel lines report none.

    Parameters
    ----------
    board : Board
        The board, after its set-up.
    waits : Waits
        Time limits for the controller's signals.
    clock : Clock
        Clock of the test bed.
    start_mm : float
        Assumed position of the stage at the start.
    """

    def __init__(self, board: Board, waits: Waits, clock: Clock, start_mm: float) -> None:
        self.path = CommandedPath(start_mm)
        # After a start or a stop, the position is known only after an absolute step or homing.
        self.known = False
        self.failure: str | None = None
        self._board, self._waits, self._clock = board, waits, clock
        self._worker: Thread | None = None
        self._stopped = Event()
        self._ready_s = clock.now_s()
        self._handshake = Handshake(board, clock, waits.busy_s, self._stopped)

    @property
    def busy(self) -> bool:
        """Whether a motion is under way."""
        return self._worker is not None and self._worker.is_alive()

    def forget_stop(self) -> None:
        """Ignore stops requested before this call."""
        self._stopped.clear()

    def stop(self) -> None:
        """Release the drive line at once; may be called from a signal handler."""
        self._stopped.set()
        self._board.stop()

    def begin(self, runs: Sequence[Run]) -> None:
        """Begin to execute handshakes, one after another."""
        if not runs:
            return
        self._board.wait_for_stop()
        if not self._board.ready:
            self._board.clear()
            self._ready_s = self._clock.now_s() + self._waits.enable_s
        self._worker = Thread(target=self._work, args=(runs,), name="motion", daemon=True)
        self._worker.start()

    def wait(self, seconds: float) -> None:
        """Wait for the end of the present motions, at most for the given number of seconds."""
        if self._worker is not None:
            self._worker.join(timeout=seconds)

    def _work(self, runs: Sequence[Run]) -> None:
        try:
            self._clock.wait_until(self._ready_s)
            for run in runs:
                if self._stopped.is_set() or not self._do(run):
                    return
        except FingervisionError as error:
            self.path.break_off(self._clock.now_s())
            self.failure = str(error)

    def _do(self, run: Run) -> bool:
        known, self.known = self.known, False
        motion = STILL if run.motion is None else run.motion.motion
        done = self._handshake.run(run.code, run.at_most_s, lambda at_s: self.path.begin(at_s, motion))
        now_s = self._clock.now_s()
        if not done:
            self.path.break_off(now_s)
            return False
        self.path.jump(now_s, 0.0 if run.motion is None else run.motion.to_mm)
        self.known = known or run.motion is None or run.motion.step.coordinates is Coordinates.ABSOLUTE
        return True
