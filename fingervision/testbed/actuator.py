"""Protocol of an actuator: simulated, behind the Arduino board, a hand screw, or a plug-in's."""

from dataclasses import dataclass
from typing import Protocol

from fingervision.testbed.reading import Reading


@dataclass(frozen=True, slots=True)
class StageLimits:
    """Capabilities and accuracy of an actuator; no command exceeds these limits.

    Parameters
    ----------
    lower_mm, upper_mm : float
        Positions that it can reach; positive opens the gripper.
    speed_mm_s : float
        Highest speed.
    force_n : float
        Highest force.
    accuracy_mm : float
        It comes to a stand within +- this of where it was sent; its encoder says where.
    encoder_step_mm : float
        Positions are read in multiples of it; 0 where they are not.
    repeatability_mm : float
        Positions at rest stray by at most this from one reading to another, and the reference is found again within it.
    settling_s : float
        A motion takes at most so much longer than its way at the asked speed: ramps at both ends, and coming to rest.
    """

    lower_mm: float
    upper_mm: float
    speed_mm_s: float
    force_n: float
    accuracy_mm: float = 0.0
    encoder_step_mm: float = 0.0
    repeatability_mm: float = 0.0
    settling_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Alarm:
    """Reason why an actuator refuses to move: its own code, and a sentence."""

    code: str
    words: str


class MoveCheck(Protocol):
    """Limits of an actuator as far as its configuration states them: enough to check a plan without the bed.

    A kind of actuator whose `build` opens hardware provides it by `without_hardware(section, folder)`.
    """

    @property
    def limits(self) -> StageLimits:
        """The limits of the actuator."""
        ...

    @property
    def has_steps(self) -> bool:
        """Whether the actuator keeps step data.

        Then `run_step` is possible, and it can reach only the ends of steps.
        """
        ...

    def check(self, from_mm: float, to_mm: float, speed_mm_s: float) -> None:
        """Raise an error if the actuator would refuse to go from one position to another."""
        ...


class Actuator(MoveCheck, Protocol):
    """A linear stage. An actuator whose motions begin at once and end by themselves.

    `busy` tells whether one is under way.

    Every method raises `FingervisionError` with a sentence if the connection is lost or the motion was refused (beyond
    the limits, alarm, still busy); a refused motion has not begun.
    """

    @property
    def name(self) -> str:
        """Name for run.json: kind, port, firmware."""
        ...

    @property
    def busy(self) -> bool:
        """Whether it moves."""
        ...

    @property
    def alarm(self) -> Alarm | None:
        """Reason why the actuator refuses to move; None if it does not."""
        ...

    def home(self) -> None:
        """Go to the reference and define it as position 0."""
        ...

    def move(self, to_mm: float, speed_mm_s: float) -> None:
        """Begin to move to a position at a positive speed."""
        ...

    def jog(self, speed_mm_s: float) -> None:
        """Begin to move until stopped or at a limit; positive speeds open the gripper."""
        ...

    def run_step(self, number: int) -> None:
        """Begin one of the step data blocks, 1 to 15."""
        ...

    def stop(self) -> None:
        """Stop at once, from any thread, whatever command is under way; never raises while the connection lasts."""
        ...

    def readings(self) -> tuple[Reading, ...]:
        """Positions in mm since the last call, oldest first, the newest read now; at least one."""
        ...

    def close(self) -> None:
        """Stop and release the hardware; closing twice is allowed."""
        ...
