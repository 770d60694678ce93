"""Limits of a stage and of recipes (soft limits): what a configuration states, and what a motion must keep."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from math import inf
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.errors import LimitError
from fingervision.domain.field import Field, names_of
from fingervision.domain.model import Model
from fingervision.storage.toml_section import Section
from fingervision.testbed.actuator import StageLimits


def check_move(limits: "StageLimits | SoftLimits", to_mm: float, speed_mm_s: float) -> None:
    """Refuse a target outside the stroke of the stage, and a speed that is not positive or too high.

    Raises
    ------
    LimitError
        The message states the limit and the requested value.
    """
    if not limits.lower_mm <= to_mm <= limits.upper_mm:
        raise LimitError(
            f"The target must lie between {limits.lower_mm:g} and {limits.upper_mm:g} mm, but is {to_mm:g} mm: nothing "
            "was moved."
        )
    if speed_mm_s == 0.0:
        raise LimitError("The speed must be positive, but is 0 mm/s: nothing was moved.")
    check_speed(limits, speed_mm_s)


def check_speed(limits: "StageLimits | SoftLimits", speed_mm_s: float) -> None:
    """Refuse a speed that is negative or too high.

    Raises
    ------
    LimitError
        The message states the limit and the requested value.
    """
    if not 0.0 <= speed_mm_s <= limits.speed_mm_s:
        raise LimitError(
            f"The speed must be at most {limits.speed_mm_s:g} mm/s, but is {speed_mm_s:g} mm/s: nothing was moved."
        )


class FreeMoves:
    """A stage that can move to any position within its limits, and has no step data.

    Parameters
    ----------
    limits : StageLimits
        Limits of the stage.
    name : str
        Name of the stage in errors.
    """

    has_steps = False

    def __init__(self, limits: StageLimits, name: str = "stage") -> None:
        self.limits, self.name = limits, name

    def check(self, from_mm: float, to_mm: float, speed_mm_s: float) -> None:
        """Refuse motions beyond the limits of the stage."""
        check_move(self.limits, to_mm, speed_mm_s)

    def move(self, to_mm: float, speed_mm_s: float) -> None:
        """Begin to move to a position at a positive speed."""
        raise NotImplementedError

    def jog(self, speed_mm_s: float) -> None:
        """Begin to move until stopped or until a limit is reached, by the limits of the test bed's file."""
        check_speed(self.limits, abs(speed_mm_s))
        if speed_mm_s != 0.0:
            self.move(self.limits.upper_mm if speed_mm_s > 0.0 else self.limits.lower_mm, abs(speed_mm_s))

    def run_step(self, number: int) -> None:
        """Refuse: such a stage has no step data that a test bed could use."""
        raise LimitError(
            f"Step {number} must be stored in a motor controller, but the {self.name} has none: use move, or a step of "
            'kind "move" in the recipe.'
        )


LIMIT_KEYS = names_of(StageLimits)
ENDLESS_N = 1e9
"""Value used for a force limit that is not stated."""


def stage_limits(section: Section, default: StageLimits | None = None) -> StageLimits:
    """Limits of a stage from its section of the configuration.

    Without defaults, the range and the speed must be stated, the force is unlimited, and the stage is exact.
    """
    given = {"force_n": ENDLESS_N} if default is None else asdict(default)
    stated = replace(section, values={**given, **section.values}, is_open=True)
    limits = stated.record(StageLimits)
    stated.number("upper_mm", above=limits.lower_mm)
    return limits


# Hricko and Havlik (2015), section 3: stroke 10 mm, 400 mm/s, positioning accuracy +-90 um, 5.5 N.
PUBLISHED = StageLimits(lower_mm=0.0, upper_mm=10.0, speed_mm_s=400.0, force_n=5.5, accuracy_mm=0.09)
PUBLISHED_KEYS = LIMIT_KEYS[:5]


# Soft limits: the range allowed for recipes and jogs, within the limits of the actuator.

# Tolerance of the limits for the rounding of positions.
SLACK_MM = 1e-9
# Positions at which the model is computed, and their margin beyond the limits: readings may lie beyond them.
POSITIONS, BEYOND_MM = 201, 0.06


@dataclass(frozen=True, slots=True)
class SoftLimits:
    """Soft limits of one test bed, checked before any motion and monitored during it.

    Parameters
    ----------
    lower_mm, upper_mm : float
        Range of positions of the stage.
    speed_mm_s : float
        Highest speed of the stage.
    force_n : float
        Largest force at the drive, in either direction; above it the stage stops.
    gap_mm : float
        Smallest gap while the stage closes; below it the stage stops.
    """

    lower_mm: float = -inf
    upper_mm: float = inf
    speed_mm_s: Annotated[float, Field(above=0.0)] = inf
    force_n: Annotated[float, Field(above=0.0)] = inf
    gap_mm: Annotated[float, Field(low=0.0)] = 0.0

    @property
    def tabulated_mm(self) -> NDArray[np.float64]:
        """Positions at which a model is tabulated, in mm, shape (n,)."""
        return np.linspace(self.lower_mm - BEYOND_MM, self.upper_mm + BEYOND_MM, POSITIONS)

    def broken_at(
        self, at_mm: float, model: Model | None, most_n: float | None = None
    ) -> Iterator[tuple[float, float, str, str]]:
        """Yield the limits that the gripper breaks at a position by its model: value, limit, its unit and name."""
        if model is None:
            return
        answer, limit_n = model.respond(np.array([at_mm])), self.force_n if most_n is None else most_n
        if answer.force_n is not None and (needed_n := abs(float(answer.force_n[0]))) > limit_n:
            yield needed_n, limit_n, "N", "force"
        if (gap_mm := float(answer.gap_mm[0])) < self.gap_mm - SLACK_MM:
            yield gap_mm, self.gap_mm, "mm", "gap"

    def within(self, able: StageLimits) -> "SoftLimits":
        """Narrow the limits to those of an actuator."""
        return replace(
            self,
            lower_mm=max(self.lower_mm, able.lower_mm),
            upper_mm=min(self.upper_mm, able.upper_mm),
            speed_mm_s=min(self.speed_mm_s, able.speed_mm_s),
            force_n=min(self.force_n, able.force_n),
        )
