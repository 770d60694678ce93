"""Soft limits: the range allowed for recipes and jogs, within the limits of the actuator."""

from dataclasses import dataclass, replace

from fingervision.testbed.actuator import StageLimits


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

    lower_mm: float
    upper_mm: float
    speed_mm_s: float
    force_n: float
    gap_mm: float = 0.0

    def within(self, able: StageLimits) -> "SoftLimits":
        """Narrow the limits to those of an actuator."""
        return replace(
            self,
            lower_mm=max(self.lower_mm, able.lower_mm),
            upper_mm=min(self.upper_mm, able.upper_mm),
            speed_mm_s=min(self.speed_mm_s, able.speed_mm_s),
            force_n=min(self.force_n, able.force_n),
        )
