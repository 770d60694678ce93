"""Step data: the numbered blocks stored in a motor controller, each of which defines one motion.

The two ways of defining a block, by cycle time or by speed, follow section 3 of Hricko and Havlik (2015).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

MOST_STEPS = 15


class Coordinates(StrEnum):
    """Whether the target position of a block is absolute, or relative to the start of the motion."""

    ABSOLUTE = "absolute"
    RELATIVE = "relative"


class Operation(StrEnum):
    """What the controller does at the target of a block: hold the position, or push with a limited force."""

    MOVING = "moving"
    PUSHING = "pushing"


@dataclass(frozen=True, slots=True)
class CycleTime:
    """Motion defined by its duration, from which speed and acceleration follow.

    Parameters
    ----------
    positioning_time_s : float
        Time from the start of the motion to rest at the target.
    """

    positioning_time_s: float


@dataclass(frozen=True, slots=True)
class SpeedEntry:
    """Motion defined by its speed and accelerations, from which the duration follows.

    Parameters
    ----------
    speed_mm_s : float
        Constant speed between acceleration and deceleration; a short motion does not reach this speed.
    acceleration_mm_s2, deceleration_mm_s2 : float
        Magnitudes of acceleration and deceleration, both positive.
    """

    speed_mm_s: float
    acceleration_mm_s2: float
    deceleration_mm_s2: float


@dataclass(frozen=True, slots=True)
class Step:
    """One block of step data: one motion of the controller.

    Parameters
    ----------
    target_mm : float
        Target position, or displacement if coordinates are relative.
    load_kg : float
        Moved mass.
    entry : CycleTime or SpeedEntry
        Timing of the motion: by its duration, or by its speed and accelerations.
    coordinates : Coordinates
        Whether the target is absolute or relative.
    operation : Operation
        Operation at the target: moving or pushing.
    pushing_force_n : float or None
        Pushing force; given if, and only if, the operation is pushing.
    """

    target_mm: float
    load_kg: float
    entry: CycleTime | SpeedEntry
    coordinates: Coordinates = Coordinates.ABSOLUTE
    operation: Operation = Operation.MOVING
    pushing_force_n: float | None = None

    def end_mm(self, start_mm: float) -> float:
        """Position at the end of the motion that starts at `start_mm` (mm)."""
        return self.target_mm if self.coordinates is Coordinates.ABSOLUTE else start_mm + self.target_mm


@dataclass(frozen=True, slots=True)
class StepData:
    """All step data of a controller, and the order in which its blocks are executed.

    Parameters
    ----------
    name : str
        Name that states the purpose of the blocks.
    steps : mapping of int to Step
        Blocks by number, 1 to 15.
    sequence : tuple of int
        Numbers of the blocks in the order of execution; a number may occur more than once.
    start_mm : float
        Position before the first block.
    """

    name: str
    steps: Mapping[int, Step]
    sequence: tuple[int, ...] = field(default=())
    start_mm: float = 0.0
