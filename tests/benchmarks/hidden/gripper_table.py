"""Random simulation tables of grippers: straight or curved, with or without the two edges."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class GripperTable:
    """A simulation table: gap and midline over the input.

    Parameters
    ----------
    input_mm, gap_mm, midline_mm : ndarray, shape (n,)
        Increasing input, gap, and midline; the midline is zero if the simulation has no edges.
    has_edges : bool
        Whether `simulation.csv` has the columns left and right.
    force_n : ndarray, shape (n,), or None
        Force at the drive.
    """

    input_mm: Array
    gap_mm: Array
    midline_mm: Array
    has_edges: bool
    force_n: Array | None = None

    def _along(self, values: Array, u_mm: Array) -> Array:
        inside = np.interp(u_mm, self.input_mm, values)
        quarter = max(2, len(self.input_mm) // 4)
        for end, rows in ((0, slice(0, quarter)), (-1, slice(-quarter, None))):
            slope = np.polyfit(self.input_mm[rows], values[rows], 1)[0]
            beyond = u_mm - self.input_mm[end]
            inside = inside + slope * (np.minimum(beyond, 0.0) if end == 0 else np.maximum(beyond, 0.0))
        return inside

    def gap(self, u_mm: Array) -> Array:
        """Simulated gap (mm); beyond an end, on the straight line through the quarter of the rows at that end."""
        return self._along(self.gap_mm, u_mm)

    def midline(self, u_mm: Array) -> Array:
        """Simulated midline in mm."""
        return self._along(self.midline_mm, u_mm)

    def force(self, u_mm: Array) -> Array:
        """Simulated force (N); zero if the simulation has no force."""
        return np.zeros_like(u_mm) if self.force_n is None else self._along(self.force_n, u_mm)

    @property
    def rest_gap_mm(self) -> float:
        """Gap at zero input."""
        return float(self.gap(np.zeros(1))[0])

    def slope(self, u_mm: Array) -> Array:
        """Gap per input, mm per mm."""
        step = 1e-4 * np.ptp(self.input_mm)
        return (self.gap(u_mm + step) - self.gap(u_mm - step)) / (2 * step)

    def write(self, path: Path) -> None:
        """Write the table in the form that a finite-element program exports."""
        columns = {"input_mm": self.input_mm, "gap_mm": self.gap_mm}
        if self.has_edges:
            columns |= {"left_mm": self.midline_mm - self.gap_mm / 2, "right_mm": self.midline_mm + self.gap_mm / 2}
        if self.force_n is not None:
            columns["force_n"] = self.force_n
        rows = zip(*columns.values(), strict=True)
        path.write_text(
            ",".join(columns) + "\n" + "".join(",".join(f"{v:.9g}" for v in row) + "\n" for row in rows),
            encoding="utf-8",
        )


@dataclass(frozen=True, slots=True)
class InputRange:
    """Range of inputs that a run may use, in mm."""

    lower_mm: float
    upper_mm: float

    @property
    def width_mm(self) -> float:
        """Width of the range."""
        return self.upper_mm - self.lower_mm


def draw_table(rng: np.random.Generator, *, with_force: bool = False) -> tuple[GripperTable, InputRange]:
    """A gripper with a rest gap of 1.5 to 4.5 mm that closes to some tenths of a millimetre, and its input range."""
    rest_mm = rng.uniform(1.5, 4.5)
    slope = rng.uniform(2.0, 8.0)
    closed_mm = rng.uniform(0.15, 0.5)
    lower = -(rest_mm - closed_mm) / slope
    upper = -lower * rng.uniform(0.6, 1.8)
    margin = 0.25 * (upper - lower) + 0.1
    straight = rng.random() < 0.4
    count = int(rng.integers(5, 20)) if straight else int(rng.integers(60, 120))
    u = np.linspace(lower - margin, upper + margin, count)
    u = np.sort(np.append(u, 0.0)) if np.min(np.abs(u)) > 1e-6 else u
    opening = slope * u
    if not straight:
        reach = max(abs(lower), upper)
        opening = opening * (1 + rng.uniform(-0.15, 0.15) * u / reach + rng.uniform(-0.06, 0.06) * (u / reach) ** 2)
    has_edges = bool(rng.random() < 0.5)
    midline = np.full_like(u, rng.uniform(-0.1, 0.1) if has_edges else 0.0)
    force = rng.uniform(2.0, 6.0) * u if with_force else None
    return GripperTable(u, rest_mm + opening, midline, has_edges, force), InputRange(lower, upper)
