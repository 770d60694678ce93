"""A simulated actuator modelled on that of Hricko & Havlik (2015), with its encoder, accuracy and play."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import DeviceError, StateError
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import Alarm, StageLimits
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.force_sensor import Reading
from fingervision.testbed.motion.move_limits import FreeMoves, check_move, stage_limits
from fingervision.testbed.simulation.drifting_clock import OwnClock
from fingervision.testbed.simulation.gripper import Motion
from fingervision.testbed.simulation.stage import SimulatedStage

KEYS = ("lower_mm", "upper_mm", "speed_mm_s", "force_n", "encoder_step_mm", "accuracy_mm", "play_mm")
SIMULATED = True
# Hricko & Havlik (2015), section 3: stroke 10 mm, 400 mm/s, encoder 30 um, accuracy +-90 um, 5.5 N. The gripper is at
# rest at position 0.
LIMITS = StageLimits(-2.0, 8.0, speed_mm_s=400.0, force_n=5.5, accuracy_mm=0.09, encoder_step_mm=0.03)
# Rate at which the board reads the encoder by itself; shortest answer time, and mean of the additional time (serial
# port at 115200 baud; a median of 1.2 ms was measured with an ATmega328P).
RATE_HZ = 200.0
ANSWER_S, SLOW_ANSWER_S = 0.001, 0.0005
# Interrupts time-stamp the edges of the encoder and of the BUSY line: micros() of an ATmega328P counts in steps of 4
# us.
EDGE_WITHIN_S = 2e-6
# Grid on which step transitions of the encoder are searched, and number of bisections: each transition is then known to
# half a microsecond.
EDGE_GRID_S, BISECTIONS = 0.0005, 10
HOMING_MM_S = 1.0
Array = NDArray[np.float64]


class SimulatedActuator(FreeMoves):
    """The simulated stage, connected to a board with its own clock.

    Parameters
    ----------
    clock : Clock
        Clock of the test bed.
    stage : SimulatedStage
        The stage that moves.
    limits : StageLimits
        Limits of the stage.
    rng : numpy.random.Generator
        Generator for the board's clock and response times.
    """

    def __init__(self, clock: Clock, stage: SimulatedStage, limits: StageLimits, rng: np.random.Generator) -> None:
        super().__init__(limits, "simulated actuator")
        self._clock, self._stage, self._step_mm, self._rng = clock, stage, limits.encoder_step_mm, rng
        self._board = OwnClock.drawn(rng)
        self._read_until_s = clock.now_s()
        self._answered_s = clock.now_s()
        self._alarm: Alarm | None = None

    @property
    def busy(self) -> bool:
        """Whether the actuator moves."""
        return self._clock.now_s() < self._stage.planned_until_s

    @property
    def alarm(self) -> Alarm | None:
        """Reason why the actuator refuses to move."""
        return self._alarm

    def raise_alarm(self, alarm: Alarm | None) -> None:
        """Raise an alarm as a motor controller does (the stage stops and refuses to move), or reset it with None."""
        self._alarm = alarm
        if alarm is not None:
            self.stop()

    def home(self) -> None:
        """Go to the reference and define it as position 0."""
        self._ready()
        self._stage.home(self._clock.now_s(), HOMING_MM_S)

    def move(self, to_mm: float, speed_mm_s: float) -> None:
        """Begin to move to a position at a positive speed."""
        check_move(self.limits, to_mm, speed_mm_s)
        self._ready()
        self._stage.go(self._clock.now_s(), to_mm, speed_mm_s)

    def stop(self) -> None:
        """Stop the motion at once."""
        self._stage.halt(self._clock.now_s())

    def readings(self) -> tuple[Reading, ...]:
        """Positions since the last call: at the board's sampling times, around every edge of a signal, and now."""
        asked_s = self._clock.now_s()
        answer_s = ANSWER_S + SLOW_ANSWER_S * float(self._rng.random())
        self._clock.wait_until(asked_s + answer_s)
        got_s = self._clock.now_s()
        began_s, self._read_until_s = self._read_until_s, asked_s + 0.5 * answer_s
        at_s = np.unique(np.concatenate([self._ticks_s(began_s), self._edges_s(began_s), [self._read_until_s]]))
        earliest_s, self._answered_s = self._answered_s, got_s
        read_mm, moving = self._encoder_mm(at_s), self._stage.moves(at_s)
        streamed = [
            Reading(self._board.shows_s(at), earliest_s, got_s, mm, busy)
            for at, mm, busy in zip(at_s.tolist(), read_mm.tolist(), moving.tolist(), strict=True)
        ]
        return (*streamed[:-1], replace(streamed[-1], asked_s=asked_s))

    def _ticks_s(self, began_s: float) -> Array:
        """Sampling times (s) of the board since the last reading."""
        first, last = (self._board.shows_s(at_s) * RATE_HZ for at_s in (began_s, self._read_until_s))
        return np.array([self._board.bed_s(tick / RATE_HZ) for tick in range(int(first) + 1, int(last) + 1)])

    def _edges_s(self, began_s: float) -> Array:
        """Times (s) just before and after every change of the encoder's and the BUSY signal since the last reading."""
        edges_s = self._stage.turns_s(began_s, self._read_until_s)
        if self._step_mm > 0.0:
            edges_s += self._borders_s(began_s)
        around_s = [at_s + aside_s for at_s in edges_s for aside_s in (-EDGE_WITHIN_S, EDGE_WITHIN_S)]
        return np.array([at_s for at_s in around_s if began_s < at_s < self._read_until_s])

    def _borders_s(self, began_s: float) -> list[float]:
        """Times (s) at which the stage passed from one encoder step to the next, found by bisection."""
        grid_s = np.linspace(began_s, self._read_until_s, int((self._read_until_s - began_s) / EDGE_GRID_S) + 2)
        cells = self._stage.at_mm(grid_s) / self._step_mm + 0.5
        low_s, high_s, border = [], [], []
        for k in np.flatnonzero(np.diff(np.floor(cells))).tolist():
            passed = range(int(np.floor(min(cells[k : k + 2]))) + 1, int(np.floor(max(cells[k : k + 2]))) + 1)
            low_s += [grid_s[k]] * len(passed)
            high_s += [grid_s[k + 1]] * len(passed)
            border += list(passed)
        if not border:
            return []
        low, high, level = np.array(low_s), np.array(high_s), np.array(border, dtype=float)
        rises = self._stage.at_mm(high) > self._stage.at_mm(low)
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            beyond = (self._stage.at_mm(middle) / self._step_mm + 0.5 >= level) == rises
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        return [float(at_s) for at_s in 0.5 * (low + high)]

    def _encoder_mm(self, at_s: Array) -> Array:
        true_mm = self._stage.at_mm(at_s)
        if self._step_mm == 0.0:
            return true_mm
        return np.asarray(np.round(np.floor(true_mm / self._step_mm + 0.5) * self._step_mm, 9))

    def close(self) -> None:
        """Stop."""
        self.stop()

    def _ready(self) -> None:
        if self._alarm is not None:
            raise DeviceError(
                f"The actuator must have no alarm, but has {self._alarm.code} ({self._alarm.words}): reset "
                "the alarm first."
            )
        if self.busy:
            raise StateError("The actuator must be at rest before a new motion, but is still moving: stop it first.")


def without_hardware(section: Section, folder: Path) -> FreeMoves:
    """Limits of the stage, for checking a plan without opening the test bed."""
    return FreeMoves(stage_limits(section, LIMITS))


def build(section: Section, context: BuildContext) -> SimulatedActuator:
    """Build the actuator from its section of the configuration."""
    limits = stage_limits(section, LIMITS)
    rng = np.random.default_rng([context.seed, 1])
    # The controller is assumed to have the test bed's limits as its own, so that positioning errors do not lead beyond
    # these limits.
    ends_mm = max(limits.lower_mm, context.limits.lower_mm), min(limits.upper_mm, context.limits.upper_mm)
    stage = SimulatedStage(*ends_mm, limits.accuracy_mm, rng)
    context.motion = Motion(
        stage.at_mm,
        lambda: stage.planned_until_s,
        lambda: stage.version,
        lambda: list(stage.homed_s),
        lambda: stage.began_s,
    )
    context.play_mm = section.number("play_mm", 0.0, low=0.0)
    return SimulatedActuator(context.clock, stage, limits, rng)
