"""Step data: the blocks stored in a motor controller, each of which is one motion.

Both ways of stating a block, cycle time and speed, are those of section 3 of Hricko & Havlik (2015).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

MOST_STEPS = 15


class Coordinates(StrEnum):
    """Whether a block's target position is absolute, or relative to where the motion starts."""

    ABSOLUTE = "absolute"
    RELATIVE = "relative"


class Operation(StrEnum):
    """What a block does at its target: hold the position, or push with a limited force."""

    MOVING = "moving"
    PUSHING = "pushing"


@dataclass(frozen=True, slots=True)
class CycleTime:
    """Motion stated by its duration; speed and acceleration follow from it.

    Parameters
    ----------
    positioning_time_s : float
        From the start to the stand at the target.
    """

    positioning_time_s: float


@dataclass(frozen=True, slots=True)
class SpeedEntry:
    """Motion stated by its speed and acceleration; its duration follows from them.

    Parameters
    ----------
    speed_mm_s : float
        Speed between speeding up and slowing down; a short motion does not reach it.
    acceleration_mm_s2, deceleration_mm_s2 : float
        Both positive.
    """

    speed_mm_s: float
    acceleration_mm_s2: float
    deceleration_mm_s2: float


@dataclass(frozen=True, slots=True)
class Step:
    """One block.

    Parameters
    ----------
    target_mm : float
        Where to, or with relative coordinates how far.
    load_kg : float
        Mass that is moved along.
    entry : CycleTime or SpeedEntry
        How the motion is timed.
    coordinates : Coordinates
        What the target counts from.
    operation : Operation
        Moving or pushing.
    pushing_force_n : float or None
        Force to push with; there is one where, and only where, the operation is pushing.
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
    """All blocks of a controller, and the order in which they run.

    Parameters
    ----------
    name : str
        What the blocks are for.
    steps : mapping of int to Step
        Blocks by their numbers, 1 to 15.
    sequence : tuple of int
        Numbers in the order of running; a number may come again.
    start_mm : float
        Position before the first.
    """

    name: str
    steps: Mapping[int, Step]
    sequence: tuple[int, ...] = field(default=())
    start_mm: float = 0.0
