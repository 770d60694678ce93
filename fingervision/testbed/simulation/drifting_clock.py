"""An instrument's own clock, with an offset to the test bed's clock and a slightly different rate."""

from dataclasses import dataclass

import numpy as np

# Relative rate error of quartz crystals on microcontroller boards and in webcams (data sheets of HC-49 crystals: 30
# ppm).
LARGEST_RATE_ERROR = 3e-5
BEGAN_WITHIN_S = 1000.0


@dataclass(frozen=True, slots=True)
class OwnClock:
    """A clock that is not synchronised with the test bed's clock.

    Parameters
    ----------
    began_s : float
        Time of the test bed at which the clock showed 0.
    rate : float
        Seconds of this clock per second of the test bed.
    """

    began_s: float
    rate: float

    @staticmethod
    def drawn(rng: np.random.Generator) -> "OwnClock":
        """Return a clock with random offset and rate."""
        began_s = rng.uniform(-BEGAN_WITHIN_S, 0.0)
        return OwnClock(float(began_s), float(1.0 + rng.uniform(-LARGEST_RATE_ERROR, LARGEST_RATE_ERROR)))

    def shows_s(self, bed_s: float) -> float:
        """Reading (s) of the instrument's clock at a time of the test bed."""
        return (bed_s - self.began_s) * self.rate

    def bed_s(self, shown_s: float) -> float:
        """Time of the test bed (s) at which the instrument's clock shows a given time."""
        return self.began_s + shown_s / self.rate
