"""Plain comparison of the gap on two days: rest gap, ratio, bend and reversal, without a model of the mechanism."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingervision.diagnosis.bodies.healthy_reference import DEGREE, GAIN, OFFSET_MM, SCALE, Recording

Array = NDArray[np.float64]

SIGNIFICANT = 4.0
"""Standard uncertainties beyond which a figure of the gap changed: by chance in one of 4 000 pairs of recordings, as
four figures are compared."""
NAMES = ("rest gap", "ratio of gap to input", "bend", "reversal")


@dataclass(frozen=True, slots=True)
class GapChange:
    """Change of one figure of the gap, faulty minus healthy.

    Parameters
    ----------
    name : str
        `rest gap` (at the middle of the inputs), `ratio of gap to input`, `bend` (largest distance of the gap from a
        straight line, as a parabola), `reversal` (difference between opening and closing).
    change, u : float
        The change and its standard uncertainty, from noise and from two calibrations of the picture's scale.
    gauge : float
        Standard uncertainty in addition if the gauge of the input was set up anew between the recordings.
    unit : str
        Unit of both.
    """

    name: str
    change: float
    u: float
    gauge: float
    unit: str

    @property
    def is_significant(self) -> bool:
        """Whether the figure changed, for whatever reason."""
        return abs(self.change) > SIGNIFICANT * self.u

    @property
    def is_of_the_part(self) -> bool:
        """Whether the figure changed by more than a gauge explains that was set up anew."""
        return abs(self.change) > SIGNIFICANT * float(np.hypot(self.u, self.gauge))


def gap_changes(healthy: Recording, faulty: Recording) -> tuple[GapChange, ...]:
    """Compare the gap of two recordings, each with the gap as its only channel.

    The gap is a free polynomial of the input that both recordings share; what is left are the differences.
    """
    inputs = [one.input_mm for one in (healthy, faulty)]
    low, high = (float(end(np.concatenate(inputs))) for end in (np.min, np.max))
    half = 0.5 * (high - low)
    t = [np.asarray((u - 0.5 * (low + high)) / half, dtype=np.float64) for u in inputs]
    shared = [np.asarray(np.polynomial.legendre.legvander(one, DEGREE), dtype=np.float64) for one in t]
    timed = all(np.ptp(one.way) > 0.0 for one in (healthy, faulty))
    own = np.column_stack([np.ones_like(t[1]), t[1], t[1] ** 2 - 0.5, *([0.5 * faulty.way] if timed else [])])
    if timed:
        shared = [np.column_stack([one, 0.5 * each.way]) for one, each in zip(shared, (healthy, faulty), strict=True)]
    columns = [
        np.concatenate([healthy.noise.whitened(shared[0][:, [k]]), faulty.noise.whitened(shared[1][:, [k]])])
        for k in range(shared[0].shape[1])
    ]
    still = np.zeros((healthy.input_mm.size, 1))
    columns += [
        np.concatenate([healthy.noise.whitened(still), faulty.noise.whitened(own[:, [k]])]) for k in range(own.shape[1])
    ]
    rows = np.stack(columns, axis=1)
    measured = np.concatenate([healthy.noise.whitened(healthy.values), faulty.noise.whitened(faulty.values)])
    size = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    inverse = np.linalg.pinv((rows / size).T @ (rows / size))
    fitted = inverse @ (rows / size).T @ measured / size
    u = np.sqrt(np.maximum(np.diag(inverse), 0.0)) / size
    rest = measured - rows @ fitted
    excess = np.sqrt(max(1.0, float(rest @ rest) / max(measured.size - size.size, 1)))
    first = shared[0].shape[1]
    slope, middle_mm = float(np.ptp(healthy.values)) / (2.0 * half), float(np.median(np.abs(healthy.values)))
    scale, gauge = (SCALE * middle_mm, SCALE * slope, 0.0, 0.0), (OFFSET_MM * slope, GAIN * slope, 0.0, 0.0)
    factors, units = (1.0, 1.0 / half, 0.5, 1.0), ("mm", "", "mm", "mm")
    found = []
    for k in range(own.shape[1]):
        own_u = abs(factors[k]) * float(u[first + k] * excess)
        by = factors[k] * float(fitted[first + k])
        found.append(GapChange(NAMES[k], by, float(np.hypot(own_u, scale[k])), gauge[k], units[k]))
    return tuple(found)
