"""Errors of measured gaps over their stated uncertainty, and the table of classes that several benchmarks print.

Columns of the table: frames with a value, and their share; RMS and mean of the error of `gap_px`, and the largest;
share beyond 0.25 px; medians of the stated `u_gap_px` (random), of `u_shift_px` (the picture's own systematic part) and
of both together; share of errors within one and two u by the random part alone, and by both; share beyond 0.25 px and
beyond 2 u of both (wrong and not said); processor time a frame; refused frames with their statuses.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fingervision.domain.frame import Frame
from fingervision.domain.gap import GapMeasurement, NoGap
from fingervision.vision.pipeline import Settings
from fingervision.vision.single_picture import measure_picture

Floats = NDArray[np.float64]
BEYOND_PX = 0.25


def rms(values: Floats) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def percent(held: NDArray[np.bool_]) -> float:
    """Share of what holds."""
    return 100.0 * float(np.mean(held))


def within(scores: Iterable[float], factor: float = 2.0) -> str:
    """Say how many errors, over their standard uncertainties, are within so many of them, and how large they are."""
    z = np.array(list(scores))
    return f"{percent(np.abs(z) < factor):.1f} % of {z.size} within {factor:g} u, RMS of error / u {rms(z):.2f}"


@dataclass
class Scores:
    """What the frames of a class gave: error and both parts of the uncertainty of each gap, and the refused ones."""

    found: list[tuple[float, float, float]] = field(default_factory=list)
    lost: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0

    def measure(self, frame: Frame, settings: Settings, gap_px: float) -> None:
        """Measure a frame of known gap."""
        begun = time.process_time()
        outcome = measure_picture(frame, settings)
        self.seconds += time.process_time() - begun
        self.take(outcome, gap_px)

    def take(self, outcome: GapMeasurement | NoGap, gap_px: float) -> None:
        """Note what a frame of known gap gave."""
        if isinstance(outcome, GapMeasurement):
            self.found.append((outcome.gap_px - gap_px, outcome.u_gap_px, outcome.u_picture_px))
        else:
            self.lost[str(outcome.status)] += 1

    @cached_property
    def columns(self) -> Floats:
        """Error, random and systematic part of the standard uncertainty (px), shape (3, n)."""
        return np.array(self.found).reshape(-1, 3).T

    @property
    def error(self) -> Floats:
        """Errors of the gaps (px)."""
        return np.asarray(self.columns[0])

    @property
    def u(self) -> Floats:
        """Standard uncertainty of each gap, both parts together (px)."""
        return np.hypot(*self.columns[1:])

    @property
    def unsaid(self) -> float:
        """Percentage of gaps that are off by more than 0.25 px and by more than twice their uncertainty."""
        off = np.abs(self.error)
        return percent((off > BEYOND_PX) & (off > 2.0 * self.u))

    @property
    def refused(self) -> dict[str, int] | str:
        """Statuses of the frames without a gap."""
        return dict(self.lost) or ""

    def line(self, name: str) -> str:
        """Line of a class in the table."""
        if not self.found:
            return f"{name:22}{0:9} {self.refused}"
        off, (_, random, shift), count = np.abs(self.error), self.columns, len(self.found)
        tried = count + self.lost.total()
        figures = (
            count, 100 * count / tried, rms(off), self.error.mean(), off.max(), percent(off > BEYOND_PX),
            np.median(random), np.median(shift), np.median(self.u), percent(off < random), percent(off < 2 * random),
            percent(off < self.u), percent(off < 2 * self.u), self.unsaid, 1e3 * self.seconds / tried,
        )  # fmt: skip
        cells = (f"{each:{form}}" for each, form in zip(figures, COLUMNS.values(), strict=True))
        return f"{name:22}{''.join(cells)} {self.refused}"


COLUMNS = {
    "frames": "9.0f", "value %": "9.1f", "RMS px": "9.4f", "mean px": "+9.4f", "max px": "9.4f", ">.25 %": "9.1f",
    "u px": "9.4f", "shift px": "9.4f", "both px": "9.4f", "<1u %": "9.1f", "<2u %": "9.1f", "both<1 %": "9.1f",
    "both<2 %": "9.1f", "unsaid %": "9.1f", "ms": "9.2f",
}  # fmt: skip


def print_classes(names: Iterable[str], scored: Callable[[str], Scores]) -> None:
    """Print the table of some classes, and a line of all."""
    print(f"{'class':22}" + "".join(f"{name:>9}" for name in COLUMNS) + " refused")
    every = Scores()
    for name in names:
        of = scored(name)
        print(of.line(name), flush=True)
        every.found += of.found
        every.lost.update(of.lost)
        every.seconds += of.seconds
    print(every.line("all"))
