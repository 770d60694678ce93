"""Check a requested motion against the limits of the stage."""

from dataclasses import dataclass

from fingervision.domain.errors import LimitError
from fingervision.testbed.actuator import StageLimits


def check_move(limits: StageLimits, to_mm: float, speed_mm_s: float) -> None:
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


def check_speed(limits: StageLimits, speed_mm_s: float) -> None:
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


@dataclass(frozen=True, slots=True)
class FreeMoves:
    """A stage that can move to any position within its limits.

    Parameters
    ----------
    limits : StageLimits
        Limits of the stage.
    """

    limits: StageLimits
    has_steps: bool = False

    def check(self, from_mm: float, to_mm: float, speed_mm_s: float) -> None:
        """Refuse motions beyond the limits of the stage."""
        check_move(self.limits, to_mm, speed_mm_s)
