"""Motions through a board: codes and times of the controller, handshakes in a thread, and the resulting position."""

import gc
from collections.abc import Sequence
from dataclasses import dataclass, replace
from threading import Event, Thread
from typing import Annotated

from fingervision.domain.board_settings import Role
from fingervision.domain.errors import DeviceError, FingervisionError
from fingervision.domain.field import Field
from fingervision.domain.step_data import Coordinates, StepData
from fingervision.storage.toml_section import Section
from fingervision.testbed.board import wire
from fingervision.testbed.board.board import Board
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.motion.motion_profile import MotionPath, MotionProfile
from fingervision.testbed.motion.step_checks import PlannedMotion

HIGHEST_CODE, LONGEST_S = 15, 60.0
Code = Field(low=0.0, high=HIGHEST_CODE)


@dataclass(frozen=True, slots=True)
class Controller:
    """How a motor controller differs from others: its codes on the select lines, and its response times.

    Parameters
    ----------
    first_code : int
        Code of step 1; the codes of the other steps follow in order.
    home_code : int or None
        Code for the return to the reference, if the controller has one.
    home_within_s : float
        Time for the return to the reference.
    busy_within_s : float
        Time from the drive line to the busy line.
    enable_s : float
        Time from the enable line to readiness; 0 without an enable line.
    """

    first_code: Annotated[int, Code] = 1
    home_code: Annotated[int | None, Code] = None
    home_within_s: Annotated[float, Field(above=0.0, high=LONGEST_S)] = 10.0
    busy_within_s: Annotated[float, Field(above=0.0, high=LONGEST_S)] = 0.5
    enable_s: Annotated[float, Field(low=0.0, high=LONGEST_S)] = 0.5


def controller_of(section: Section, data: StepData) -> Controller:
    """Read the controller's settings, by which all steps must have a code on four lines."""
    controller = replace(section, is_open=True).record(Controller)
    if (first := controller.first_code) + max(data.steps) - 1 > HIGHEST_CODE:
        section.refuse(
            "first_code",
            f"must leave codes for step {max(data.steps)} on four lines (at most {HIGHEST_CODE}), but is {first}.",
        )
    return controller


# One motion by parallel lines: select, settle, drive, busy, not busy; each phase has its own time limit.

LINE_WITHIN_S = 0.3
WAIT_S = 0.01


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
    controller : Controller
        Time limits for the controller's signals.
    clock : Clock
        Clock of the test bed.
    start_mm : float
        Assumed position of the stage at the start.
    """

    def __init__(self, board: Board, controller: Controller, clock: Clock, start_mm: float) -> None:
        self.path = MotionPath(start_mm)
        # After a start or a stop, the position is known only after an absolute step or homing.
        self.known = False
        self.failure: str | None = None
        self._board, self._controller, self._clock = board, controller, clock
        self._worker: Thread | None = None
        self._stopped = Event()
        self._ready_s = clock.now_s()

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
            self._ready_s = self._clock.now_s() + self._controller.enable_s
        self._worker = Thread(target=self._work, args=(runs,), name="motion", daemon=True)
        self._worker.start()

    def wait(self, seconds: float) -> None:
        """Wait for the end of the present motions, at most for the given number of seconds."""
        if self._worker is not None:
            self._worker.join(timeout=seconds)

    def _work(self, runs: Sequence[Run]) -> None:
        was_on = gc.isenabled()
        # A collection may stop all threads for 0.1 s, which the board would take for a lost connection.
        gc.disable()
        try:
            self._clock.wait_until(self._ready_s)
            for run in runs:
                if self._stopped.is_set() or not self._do(run):
                    return
        except FingervisionError as error:
            self.path.break_off(self._clock.now_s())
            self.failure = str(error)
        finally:
            if was_on:
                gc.enable()

    def _do(self, run: Run) -> bool:
        known, self.known = self.known, False
        done = self._shake(run)
        now_s = self._clock.now_s()
        if not done:
            self.path.break_off(now_s)
            return False
        self.path.jump(now_s, 0.0 if run.motion is None else run.motion.to_mm)
        self.known = known or run.motion is None or run.motion.step.coordinates is Coordinates.ABSOLUTE
        return True

    # The handshake: each phase has its own time limit.

    def _shake(self, run: Run) -> bool:
        """Execute the step of a code to its end; return False if it was stopped, or ended by the board."""
        board, busy_s = self._board, self._controller.busy_within_s
        board.run(run.code, busy_s + run.at_most_s)
        within_s = 1e-3 * board.settings.settle_ms + LINE_WITHIN_S
        if not self._until(wire.Levels.DRIVE, within_s, "the board has not raised its drive line within"):
            return False
        # If the message of this change was damaged, the change was found in the reported state: take the present time.
        at_s, now_s = board.driven_board_s, self._clock.now_s()
        driven_s = now_s if at_s is None else min(board.clock.host_at(at_s), now_s)
        self.path.begin(driven_s, STILL if run.motion is None else run.motion.motion)
        if not (
            self._until(wire.Levels.BUSY_SEEN, busy_s, "the motor controller has not become busy within")
            and self._until(wire.Levels.BUSY, run.at_most_s, "the motor controller was still busy after", goes=True)
        ):
            return False
        board.release()
        return Role.IN_POSITION not in board.settings.lines or self._until(
            wire.Levels.IN_POSITION,
            LINE_WITHIN_S,
            "the motor controller has signalled no position within",
        )

    def _until(self, level: wire.Levels, within_s: float, otherwise: str, *, goes: bool = False) -> bool:
        """Wait until a line becomes active, or goes off; return False if the motion has ended otherwise."""
        until_s = self._clock.now_s() + within_s
        while (level in self._board.levels) is goes:
            if self._ended():
                return False
            if self._clock.now_s() > until_s:
                self._board.stop()
                raise DeviceError(
                    f"A motion was interrupted, because {otherwise} {within_s:.3g} s: check the wiring, and home the "
                    "stage."
                )
            self._board.wait(WAIT_S)
        return not self._ended()

    def _ended(self) -> bool:
        return self._stopped.is_set() or self._board.dropped is not None
