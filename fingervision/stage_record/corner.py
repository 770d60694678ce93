"""A corner of a motion between two recorded rows."""

from dataclasses import dataclass

MOST_SHORT = 0.999
"""Largest share of the way back to the row at which the stage turned: the points of the path keep different times. For
the same reason, a stage that turned within a thousandth of the meeting place turned there."""
KNOWN = 0.01
"""Range of this share below which the turning point is known."""


@dataclass(frozen=True, slots=True)
class Corner:
    """A corner of the motion between two rows.

    Parameters
    ----------
    after : int
        Index of the row before it.
    time_s, input_mm : float
        Its time and input.
    least_mm : float or None
        At a reversal, input of the farther one of the two rows beside it: a stage that stops for a moment, or slows
        down, turns anywhere between this row and `input_mm`. None at a start or stop.
    passed_s : (float, float)
        Times at which the continued motions before and after a reversal pass `least_mm`.
    short_by : (float, float)
        Least and largest share of the way from `input_mm` back to `least_mm` at which the stage can have turned.
    """

    after: int
    time_s: float
    input_mm: float
    least_mm: float | None = None
    passed_s: tuple[float, float] = (0.0, 0.0)
    short_by: tuple[float, float] = (0.0, MOST_SHORT)

    @property
    def free(self) -> bool:
        """Whether the place of the reversal is not known from the rows."""
        return self.least_mm is not None and self.short_by[1] - self.short_by[0] > KNOWN

    def points(self, short_by: float) -> list[tuple[float, float]]:
        """Time and input of the path's points here.

        Parameters
        ----------
        short_by : float
            At a reversal, share of the way from `input_mm` back to `least_mm` at which the stage stops, until the
            motion after the reversal passes this place.
        """
        if self.least_mm is None or short_by < 1.0 - MOST_SHORT:
            return [(self.time_s, self.input_mm)]
        place_mm = self.input_mm + short_by * (self.least_mm - self.input_mm)
        return [(self.time_s + short_by * (at_s - self.time_s), place_mm) for at_s in self.passed_s]
