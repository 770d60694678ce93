"""Protocol of an actuator: simulated, driven by the Arduino board, turned by hand, or from a plug-in."""

from dataclasses import dataclass
from typing import Annotated, Protocol

from fingervision.domain.errors import error_words
from fingervision.domain.field import Field
from fingervision.testbed.force_sensor import Reading


@dataclass(frozen=True, slots=True)
class StageLimits:
    """Capabilities and accuracy of an actuator; no command exceeds these limits.

    Parameters
    ----------
    lower_mm, upper_mm : float
        Range of positions; positive positions open the gripper.
    speed_mm_s : float
        Highest speed.
    force_n : float
        Highest force.
    accuracy_mm : float
        Largest distance between the target and the position at which the stage stops; the encoder gives the actual
        position.
    encoder_step_mm : float
        Step of the encoder; readings are multiples of this step. 0 for an actuator without encoder steps.
    repeatability_mm : float
        Largest scatter of readings at rest, and of the reference position.
    settling_s : float
        Largest time by which a motion takes longer than distance over requested speed: acceleration, deceleration, and
        settling.
    """

    lower_mm: float
    upper_mm: float
    speed_mm_s: Annotated[float, Field(above=0.0)]
    force_n: Annotated[float, Field(above=0.0)]
    accuracy_mm: Annotated[float, Field(low=0.0)] = 0.0
    encoder_step_mm: Annotated[float, Field(low=0.0)] = 0.0
    repeatability_mm: Annotated[float, Field(low=0.0)] = 0.0
    settling_s: Annotated[float, Field(low=0.0)] = 0.0


@dataclass(frozen=True, slots=True)
class Alarm:
    """Reason why an actuator refuses to move: the actuator's own code, and a sentence."""

    code: str
    words: str


class RefusedError(Exception):
    """A device answered that it does not execute a command, or that it has an error.

    Parameters
    ----------
    code, words : str
        The device's own code, and what it said.
    """

    def __init__(self, code: str, words: str) -> None:
        super().__init__(words)
        self.code, self.words = code, words


class MoveCheck(Protocol):
    """Limits of an actuator as stated in its configuration: sufficient to check a plan without opening the test bed.

    A kind of actuator whose `build` opens hardware returns a `MoveCheck` from `without_hardware(section, folder)`.
    """

    @property
    def limits(self) -> StageLimits:
        """The limits of the actuator."""
        ...

    @property
    def has_steps(self) -> bool:
        """Whether the actuator has step data (stored motions that are called by number).

        An actuator with step data supports `run_step`, and can reach only the end positions of its steps.
        """
        ...

    def check(self, from_mm: float, to_mm: float, speed_mm_s: float) -> None:
        """Raise an error if the actuator would refuse to go from one position to another."""
        ...


class Actuator(MoveCheck, Protocol):
    """A linear stage whose motions start at once and end by themselves.

    The property `busy` states whether a motion is in progress.

    Every method raises `FingervisionError` with a sentence if the connection is lost or the motion is refused (beyond
    the limits, alarm, still busy); a refused motion is not started.
    """

    @property
    def name(self) -> str:
        """Name for run.json: kind, port and firmware of the actuator."""
        ...

    @property
    def busy(self) -> bool:
        """Whether a motion is in progress."""
        ...

    @property
    def alarm(self) -> Alarm | None:
        """Reason why the actuator refuses to move; None if it does not refuse."""
        ...

    def home(self) -> None:
        """Go to the reference and define it as position 0."""
        ...

    def move(self, to_mm: float, speed_mm_s: float) -> None:
        """Begin to move to a position at a positive speed."""
        ...

    def jog(self, speed_mm_s: float) -> None:
        """Begin to move until stopped or until a limit is reached; positive speeds open the gripper."""
        ...

    def run_step(self, number: int) -> None:
        """Begin the motion of a step data block, numbered 1 to 15."""
        ...

    def stop(self) -> None:
        """Stop at once, from any thread, during any command; no exception is raised as long as the connection lasts."""
        ...

    def readings(self) -> tuple[Reading, ...]:
        """Positions (mm) since the last call, the oldest first; the last position is read by this call."""
        ...

    def close(self) -> None:
        """Stop and release the hardware; closing twice is allowed."""
        ...


def in_a_line(error: Exception) -> str:
    """Message of an exception within a sentence, as by `error_words`; of a refusal, the device's own words."""
    return error.words.rstrip(".") if isinstance(error, RefusedError) else error_words(error)
