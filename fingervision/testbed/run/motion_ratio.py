"""Ratio of the gap's motion to that of the model: what tells wrong units of a stage that commands and reports alike."""

from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.model import Model
from fingervision.testbed.motion.soft_limits import SoftLimits

LARGEST_RATIO = 3.0
"""Largest ratio, or its inverse, that the effects of the catalogue cause together (1.3 * 1.3 * 1.2 = 2.03), with a
margin; units that are confused differ by 10, 25.4, 100 or 1000."""
FEWEST, SURE = 5, 30.0
"""Frames, and standard deviations, from which on a ratio counts: Student's t with three degrees of freedom exceeds 30
by chance four times in 100 000."""
# Positions at which the model is computed, and their margin beyond the limits: readings may lie beyond them.
POSITIONS, BEYOND_MM = 201, 0.06


def inputs_within(limits: SoftLimits) -> NDArray[np.float64]:
    """Positions at which the model is tabulated, in mm, shape (n,)."""
    return np.linspace(limits.lower_mm - BEYOND_MM, limits.upper_mm + BEYOND_MM, POSITIONS)


class MotionRatio:
    """Fits a line to the gaps of one motion over the gaps that the model predicts.

    Parameters
    ----------
    model : Model
        Model of the gripper.
    limits : SoftLimits
        Limits of the test bed, within which the model is computed.
    """

    def __init__(self, model: Model, limits: SoftLimits) -> None:
        self._inputs_mm = inputs_within(limits)
        self._gaps_mm = model.respond(self._inputs_mm).gap_mm
        self.begin()

    def begin(self) -> None:
        """Begin another motion."""
        self._count, self._means, self._squares = 0, np.zeros(2), np.zeros((2, 2))

    def add(self, input_mm: float, gap_mm: float) -> None:
        """Add a frame (Welford's update of means and squares)."""
        pair = np.array([np.interp(input_mm, self._inputs_mm, self._gaps_mm), gap_mm])
        self._count += 1
        before = pair - self._means
        self._means = self._means + before / self._count
        self._squares = self._squares + np.outer(before, pair - self._means)

    @property
    def interval(self) -> tuple[float, float]:
        """Ratios within which that of this motion surely lies."""
        (predicted, both), (_, seen) = self._squares.tolist()
        if self._count < FEWEST or predicted <= 0.0:
            return -inf, inf
        ratio = both / predicted
        u = sqrt(max(seen - ratio * both, 0.0) / (self._count - 2) / predicted)
        return ratio - SURE * u, ratio + SURE * u

    @property
    def words(self) -> str:
        """The ratio and what to check, as a sentence without its end."""
        (predicted, both), _ = self._squares.tolist()
        return (
            f"the gap moved {both / predicted:.3g} times as far as the model predicts: check the units of the stage "
            "(such as per_mm, counts_per_mm or microstep_mm), the scale px_per_mm, and the units of the model"
        )
