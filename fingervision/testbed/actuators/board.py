"""Actuator connected to the parallel input lines of a motor controller, which executes its stored step data."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from fingervision.domain.errors import DeviceError, LimitError, StateError
from fingervision.domain.field import names_of
from fingervision.domain.step_data import Coordinates, StepData
from fingervision.storage.board_toml import read_board
from fingervision.storage.recipe_toml import read_steps
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import Alarm, StageLimits
from fingervision.testbed.board import wire
from fingervision.testbed.board.board import KEY, Board, board_of
from fingervision.testbed.board.motions import Controller, Motions, Run, controller_of
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.force_sensor import Reading
from fingervision.testbed.motion.move_limits import PUBLISHED, PUBLISHED_KEYS, check_move, check_speed, stage_limits
from fingervision.testbed.motion.step_checks import jog_step, planned, route
from fingervision.testbed.serial_port import fingervision_at

SIMULATED = False
KEYS = (KEY, "steps", *PUBLISHED_KEYS, *names_of(Controller))
# A motion counts as stuck if it takes longer than PATIENCE times the duration of its profile, plus PATIENCE_S.
PATIENCE, PATIENCE_S = 1.5, 1.0
READ_EVERY_S = 0.005
CLOSES_WITHIN_S = 1.0


class Routes:
    """Motions that the step data allow, computed without opening the board.

    Parameters
    ----------
    data : StepData
        Step data stored in the motor controller.
    limits : StageLimits
        Limits of the stage.
    """

    has_steps = True

    def __init__(self, data: StepData, limits: StageLimits) -> None:
        self.data, self.limits = data, limits

    def check(self, from_mm: float, to_mm: float, speed_mm_s: float) -> None:
        """Refuse targets beyond the limits, and targets that no sequence of steps reaches."""
        check_move(self.limits, to_mm, speed_mm_s)
        route(self.data.steps, from_mm, to_mm, speed_mm_s, self.limits.speed_mm_s)


class BoardActuator(Routes):
    """The stage driven by the motor controller that is connected to the board.

    Parallel lines report no position; the position is computed from the profiles of the executed steps, within the
    stage's accuracy.

    Parameters
    ----------
    board : Board
        The board, after its set-up.
    data : StepData
        Step data stored in the controller: the same data as were loaded into the controller by its maker's tool.
    limits : StageLimits
        Limits of the stage.
    controller : Controller
        Codes of the steps on the select lines, and response times.
    clock : Clock
        Clock of the test bed.
    """

    def __init__(self, board: Board, data: StepData, limits: StageLimits, controller: Controller, clock: Clock) -> None:
        super().__init__(data, limits)
        self._board, self._controller, self._clock = board, controller, clock
        self._motions = Motions(board, controller, clock, data.start_mm)
        self._read_s = clock.now_s()
        self._closed = False

    @property
    def name(self) -> str:
        """Names of board, port and firmware."""
        return f"motor controller behind {self._board.name}"

    @property
    def busy(self) -> bool:
        """Whether a motion is under way."""
        self._board.check()
        return self._motions.busy

    @property
    def alarm(self) -> Alarm | None:
        """The controller's alarm line, or the reason why a motion was aborted."""
        if wire.Levels.ALARM in self._board.levels:
            return Alarm("alarm", "the motor controller's alarm line is active: clear the alarm there, then home")
        if self._board.dropped is not None and self._board.dropped_code != "h":
            return Alarm("dropped", f"{self._board.dropped}, and the drive line was switched off: home the stage")
        if self._motions.failure is not None:
            return Alarm("failed", self._motions.failure)
        return None

    def home(self) -> None:
        """Return to the reference, by the controller's homing code or an absolute step to 0; reset an earlier stop."""
        self._stand()
        if wire.Levels.ALARM in self._board.levels:
            raise DeviceError(
                "The motor controller must have no alarm, but its alarm line is active: reset the alarm at "
                "the controller."
            )
        self._motions.failure = None
        if self._controller.home_code is not None:
            self._motions.begin([Run(self._controller.home_code, self._controller.home_within_s, None)])
            return
        for number, step in self.data.steps.items():
            if step.coordinates is Coordinates.ABSOLUTE and step.target_mm == 0.0:
                self._motions.begin([self._run_of(number, self._at_mm())])
                return
        raise DeviceError(
            "Homing needs home_code in the actuator's configuration, or an absolute step to 0 mm, but has neither of "
            "them: add one."
        )

    def move(self, to_mm: float, speed_mm_s: float) -> None:
        """Begin to move, by the sequence of steps that leads to the target."""
        check_move(self.limits, to_mm, speed_mm_s)
        self._ready()
        at_mm = self._at_mm() if self._motions.known else None
        self._begin_steps(route(self.data.steps, at_mm, to_mm, speed_mm_s, self.limits.speed_mm_s))

    def jog(self, speed_mm_s: float) -> None:
        """Begin to move by a repeated relative step, until stopped or until a limit is reached."""
        check_speed(self.limits, abs(speed_mm_s))
        self._ready()
        if speed_mm_s == 0.0:
            return
        number = jog_step(self.data.steps, speed_mm_s, self.limits.speed_mm_s)
        self._check_known(number)
        end_mm = self.limits.upper_mm if speed_mm_s > 0.0 else self.limits.lower_mm
        count = int((end_mm - self._at_mm()) / self.data.steps[number].target_mm + 1e-9)
        self._begin_steps((number,) * count)

    def run_step(self, number: int) -> None:
        """Begin one of the step data blocks."""
        if number not in self.data.steps:
            there = ", ".join(str(each) for each in self.data.steps)
            raise LimitError(f"The step must be stored in the controller (stored steps: {there}), but is {number}.")
        self._ready()
        self._check_known(number)
        self._begin_steps((number,))

    def stop(self) -> None:
        """Release the drive line at once; may be called from a signal handler."""
        self._motions.stop()

    def readings(self) -> tuple[Reading, ...]:
        """Positions since the last call, computed by the host on its own clock from the executed steps."""
        self._board.check()
        now_s = self._clock.now_s()
        path, times = self._motions.path, np.arange(self._read_s + READ_EVERY_S, now_s, READ_EVERY_S)
        times = np.append(times[path.moves(times)], now_s)
        self._read_s = now_s
        return tuple(
            Reading(at_s, at_s, at_s, mm) for at_s, mm in zip(times.tolist(), path.at_mm(times).tolist(), strict=True)
        )

    def close(self) -> None:
        """Stop and release the board."""
        if self._closed:
            return
        self._closed = True
        self.stop()
        self._motions.wait(CLOSES_WITHIN_S)
        self._board.close()

    # Checks before a motion.

    def _stand(self) -> None:
        # This call comes first, so that a stop that arrives during the preparation of the motion is kept.
        self._motions.forget_stop()
        if self.busy:
            raise StateError("The actuator must be at rest before a new motion, but is still moving: stop it first.")

    def _ready(self) -> None:
        self._stand()
        alarm = self.alarm
        if alarm is not None:
            raise DeviceError(
                f"The actuator must have no alarm, but has {alarm.code} ({alarm.words}): nothing was moved."
            )

    def _check_known(self, number: int) -> None:
        if not self._motions.known and self.data.steps[number].coordinates is Coordinates.RELATIVE:
            raise StateError(
                f"The stage's position must be known before the relative step {number}, but is unknown since the start "
                "or the last stop: home the stage first (--home-first)."
            )

    # Execution of a motion.

    def _at_mm(self) -> float:
        return float(self._motions.path.at_mm(self._clock.now_s()))

    def _begin_steps(self, numbers: Sequence[int]) -> None:
        runs: list[Run] = []
        at_mm = self._at_mm()
        for number in numbers:
            runs.append(self._run_of(number, at_mm))
            motion = runs[-1].motion
            assert motion is not None  # noqa: S101 - only homing has none
            at_mm = motion.to_mm
        self._motions.begin(runs)

    def _run_of(self, number: int, at_mm: float) -> Run:
        motion = planned(number, self.data.steps[number], at_mm, self.limits)
        # From an unknown position, the motion may take as long as homing.
        at_most_s = (
            PATIENCE * motion.motion.seconds
            + PATIENCE_S
            + (0.0 if self._motions.known else self._controller.home_within_s)
        )
        return Run(self._controller.first_code + number - 1, at_most_s, motion)


def holder(section: Section, folder: Path) -> int | None:
    """Process number of another fingervision process that has the board's port open; None if there is none."""
    return fingervision_at(read_board(folder / section.word(KEY)).port)


def without_hardware(section: Section, folder: Path) -> Routes:
    """Limits of the stage, for checking a plan without opening the test bed."""
    return Routes(read_steps(folder / section.word("steps")), stage_limits(section, PUBLISHED))


def build(section: Section, context: BuildContext) -> BoardActuator:
    """Build the actuator from its section of the configuration."""
    data = read_steps(context.folder / section.word("steps"))
    controller = controller_of(section, data)
    board = board_of(section, context)
    if not board.settings.moves:
        board.close()
        section.refuse(KEY, "must have a motor controller on its lines, but has a force sensor only: add its lines.")
    return BoardActuator(board, data, stage_limits(section, PUBLISHED), controller, context.clock)
