"""A micrometer screw that a person turns; the person types in its readings."""

from dataclasses import replace
from math import inf, isfinite
from pathlib import Path

from fingervision.domain.errors import LimitError, StateError
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import Alarm, StageLimits
from fingervision.testbed.build_context import BuildContext
from fingervision.testbed.clocks.clock import Clock
from fingervision.testbed.force_sensor import Reading
from fingervision.testbed.motion.move_limits import FreeMoves, check_move, stage_limits
from fingervision.testbed.terminal import TERMINAL, Terminal

KEYS = ("lower_mm", "upper_mm", "speed_mm_s", "accuracy_mm")
SIMULATED = False
# DIN 863-1 allows a micrometer screw of 25 mm an error of 4 um.
ACCURACY_MM = 0.004
# Upper bound for the speed of a screw that is turned by hand; the actual speed is not controlled.
SPEED_MM_S = 10.0
# A typed value that differs by more than this from the requested position counts as a typing error and is requested
# again.
FAR_MM = 1.0
ASK_AT_MOST = 3
# Positions between two readings are interpolated elsewhere. It is only known that the screw is at rest when a reading
# is typed; the old position is therefore repeated this long before a new reading.
AN_INSTANT_S = 1e-4


class HandScrew(FreeMoves):
    """Actuator whose positions are requested on the terminal; a motion lasts until its reading is typed.

    Parameters
    ----------
    limits : StageLimits
        Limits of the screw; the force of the hand is not limited.
    clock : Clock
        Clock of the test bed.
    terminal : Terminal
        Terminal for questions and answers.
    """

    busy = False
    alarm: Alarm | None = None

    def __init__(self, limits: StageLimits, clock: Clock, terminal: Terminal) -> None:
        super().__init__(limits, "hand screw")
        self._clock, self._terminal = clock, terminal
        self._at_mm = 0.0
        self._turned: list[Reading] = []

    def home(self) -> None:
        """Ask the user to set the screw to its zero."""
        self._ask_for(
            "Turn the screw to the position at which the gripper rests, set its reading to zero, and type that reading",
            0.0,
        )

    def move(self, to_mm: float, speed_mm_s: float) -> None:
        """Ask the user to turn the screw; the speed is up to the user."""
        check_move(self.limits, to_mm, speed_mm_s)
        self._ask_for(f"Turn the screw to {to_mm:z.3f} mm and type its reading in mm", to_mm)

    def jog(self, speed_mm_s: float) -> None:
        """Refuse: a hand-turned screw cannot be stopped by command."""
        raise LimitError(
            f"A hand screw can only be moved to positions, but a jog at {speed_mm_s:g} mm/s was requested: use move."
        )

    def stop(self) -> None:
        """Do nothing: the screw does not move by itself."""

    def readings(self) -> tuple[Reading, ...]:
        """Typed positions, each preceded by the previous position just before the change, and the present position."""
        turned, self._turned = self._turned, []
        now_s = self._clock.now_s()
        earlier = [reading for reading in turned if reading.device_s < now_s]
        return (*earlier, Reading(now_s, now_s, now_s, self._at_mm))

    def close(self) -> None:
        """Do nothing: there is no hardware to release."""

    def _ask_for(self, words: str, wanted_mm: float) -> None:
        for _ in range(ASK_AT_MOST):
            line = self._terminal.ask(f"{words} (Enter alone: {wanted_mm:z.3f}): ")
            if line is None:
                raise StateError(
                    "The hand screw must be turned by an operator, but there is no terminal to ask one: run "
                    "the command from a terminal."
                )
            typed_mm = _number(line.strip().replace(",", "."), wanted_mm)
            if typed_mm is None:
                self._terminal.say(f"A reading must be a number in mm, but is '{line.strip()}'.\n")
            elif not self.limits.lower_mm - FAR_MM <= typed_mm <= self.limits.upper_mm + FAR_MM:
                self._terminal.say(
                    f"A reading must lie between {self.limits.lower_mm:g} and {self.limits.upper_mm:g} mm, "
                    f"but is {typed_mm:g}.\n"
                )
            elif abs(typed_mm - wanted_mm) > FAR_MM:
                self._terminal.say(
                    f"The reading must be within {FAR_MM:g} mm of {wanted_mm:z.3f} mm, but is {typed_mm:g} mm.\n"
                )
            else:
                now_s = self._clock.now_s()
                for at_s, mm in ((now_s - AN_INSTANT_S, self._at_mm), (now_s, typed_mm)):
                    self._turned.append(Reading(at_s, at_s, at_s, mm))
                self._at_mm = typed_mm
                return
        raise StateError(
            f"The reading must be typed in mm, but {ASK_AT_MOST} inputs were not valid: the run ends here."
        )


def _number(words: str, otherwise: float) -> float | None:
    try:
        value = float(words) if words else otherwise
    except ValueError:
        return None
    return value if isfinite(value) else None


def _limits(section: Section) -> StageLimits:
    given = {"speed_mm_s": SPEED_MM_S, "accuracy_mm": ACCURACY_MM, **section.values}
    return replace(stage_limits(replace(section, values=given)), force_n=inf, settling_s=inf)


def without_hardware(section: Section, folder: Path) -> FreeMoves:
    """Limits of the stage, for checking a plan without opening the test bed."""
    return FreeMoves(_limits(section))


def build(section: Section, context: BuildContext) -> HandScrew:
    """Build the actuator from its section of the configuration; readings are asked for on the terminal."""
    return HandScrew(_limits(section), context.clock, TERMINAL)
