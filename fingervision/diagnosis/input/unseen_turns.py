"""Where the stage turned between two rows, as far as the rows beside the reversals show it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fingervision.domain.effect import Array
from fingervision.stage_record.corner import Corner

SIGMA = 0.5
"""Standard deviation of a place before the gap is looked at, as a share of its range."""
MOST_TURNS = 200
"""Number of reversals above which their places are left to the noise: they average out, and each costs a column."""


@dataclass(frozen=True, eq=False)
class UnseenTurns:
    """Corners of the motion between the rows, and where the stage turned at the reversals among them.

    A stage that stops for a moment, or slows down before it reverses, turns between the farther row beside the reversal
    and the place at which the continued motions meet. An effect with memory, such as a play, keeps this place until the
    play is taken up, so that the gap tells where it was.

    Parameters
    ----------
    corners : tuple of Corner
        The corners, sorted by row.
    short_by : tuple of float
        For each of `reversals`, share of the way from the meeting place back to the row at which the stage turned.
    random : bool
        Whether the places are random effects, so that they contribute to the uncertainty of the effects.
    """

    corners: tuple[Corner, ...]
    short_by: tuple[float, ...] = ()
    random: bool = False

    def __post_init__(self) -> None:
        if not self.short_by:
            object.__setattr__(self, "short_by", tuple(corner.short_by[0] for corner in self.reversals))

    @cached_property
    def reversals(self) -> tuple[Corner, ...]:
        """The corners at which the stage reversed at a place that the rows do not determine."""
        return tuple(corner for corner in self.corners if corner.free)

    @property
    def ranges(self) -> Array:
        """Least and largest `short_by` of each reversal; shape (reversals, 2)."""
        return np.array([corner.short_by for corner in self.reversals]).reshape(-1, 2)

    @property
    def sigmas(self) -> Array:
        """Standard deviation of each `short_by` before the gap is looked at; shape (reversals,)."""
        return np.asarray(SIGMA * (self.ranges[:, 1] - self.ranges[:, 0]))

    @property
    def price(self) -> float:
        """-2 log of the probability of the places before the gap is looked at, up to a constant."""
        return float(np.sum(((np.array(self.short_by) - self.ranges[:, 0]) / self.sigmas) ** 2))

    @property
    def uncertain(self) -> int:
        """Number of reversals whose place is estimated from the gap."""
        return len(self.reversals) if len(self.reversals) <= MOST_TURNS else 0

    @cached_property
    def points(self) -> Mapping[int, list[tuple[float, float]]]:
        """Times and inputs of the points of the path that follow a row, by the row's index."""
        shares = dict(zip(self.reversals, self.short_by, strict=True))
        return {corner.after: corner.points(shares.get(corner, corner.short_by[0])) for corner in self.corners}

    def turned(self, short_by: Array) -> "UnseenTurns":
        """Return the same corners with other turning points; shape (reversals,)."""
        return replace(self, short_by=tuple(short_by.tolist()))


NO_TURNS = UnseenTurns(())
"""A motion without corners between its rows."""
